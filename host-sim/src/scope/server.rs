//! The page, and a WebSocket for each that is open.

use super::board::{Order, bare, shortest};
use super::feed::Feed;
use super::signals::{COUNT, Row, SIGNALS};
use crate::board::orders::reach_m;
use crate::rig::{GAINS, Rig};
use crate::settings::settings;
use axum::Router;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Query, State};
use axum::http::{HeaderMap, HeaderName, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::time::Duration;

/// From one sending of rows to the next.
const EVERY: Duration = Duration::from_millis(40);
/// Rows in a message: a page that has fallen behind catches up in pieces.
const MOST_ROWS: usize = 8_000;
/// Rows that a page gets when it opens.
const FIRST_ROWS: u64 = 60_000;
/// Sendings from one status to the next.
const STATUS_EVERY: u32 = 5;

/// What a request is answered from.
pub struct Site {
    /// Rows and words.
    pub feed: Arc<Feed>,
    /// Where orders go.
    pub orders: Sender<Order>,
    /// What the address has to hold.
    pub token: String,
    /// `127.0.0.1:PORT`.
    pub host: String,
    /// What a page is told at first.
    pub hello: Value,
    /// The program ends.
    pub stopped: Arc<AtomicBool>,
}

/// What a page is told at first: signals, gains, reach.
pub fn hello(rig: &Rig, port: &str, session: &str, (tick_s, stride): (f64, u16)) -> Value {
    let fields = settings(rig).map(|settings| settings.controller.fields().collect());
    let fields: Vec<firmware::settings::Field> = fields.unwrap_or_default();
    let gains: Vec<Value> = fields
        .iter()
        .map(|field| {
            let key = bare(field.name);
            let known = GAINS.iter().find(|(name, ..)| *name == key);
            let (_, unit, what) = known.copied().unwrap_or(("", "", ""));
            json!({
                "key": key, "value": shortest(field.value), "unit": unit, "what": what,
                "lowest": shortest(field.lowest), "highest": shortest(field.highest),
            })
        })
        .collect();
    json!({
        "session": session, "port": port, "tick_s": tick_s, "stride": stride,
        "signals": SIGNALS, "gains": gains, "reach_mm": reach_m().map(|end_m| 1e3 * end_m),
    })
}

/// Serves until the program ends.
///
/// # Errors
/// Where the listener cannot be used.
pub fn serve(listener: TcpListener, site: Arc<Site>) -> io::Result<()> {
    listener.set_nonblocking(true)?;
    let runtime = tokio::runtime::Builder::new_current_thread();
    let runtime = { runtime }.enable_all().build()?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        let ended = Arc::clone(&site);
        let serving = axum::serve(listener, router(site));
        tokio::select! {
            served = serving => served,
            () = until_stopped(&ended) => Ok(()),
        }
    })
}

async fn until_stopped(site: &Site) {
    while !site.stopped.load(Ordering::Relaxed) {
        tokio::time::sleep(EVERY).await;
    }
}

fn router(site: Arc<Site>) -> Router {
    let script = (header::CONTENT_TYPE, "text/javascript; charset=utf-8");
    let style = (header::CONTENT_TYPE, "text/css; charset=utf-8");
    Router::new()
        .route("/", get(page))
        .route("/live", get(live))
        .route(
            "/scope.js",
            get(move || async move { file(script, include_str!("scope.js")) }),
        )
        .route(
            "/scope.css",
            get(move || async move { file(style, include_str!("scope.css")) }),
        )
        .with_state(site)
}

type Asked = Query<HashMap<String, String>>;

/// What every answer says: nothing from elsewhere, nothing kept, no other page around it.
fn file((name, value): (HeaderName, &'static str), text: &'static str) -> Response {
    let policy = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
                  connect-src 'self' ws:; img-src data:; frame-ancestors 'none'; base-uri 'none'";
    let headers = [
        (name, value),
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ];
    (headers, text).into_response()
}

async fn page(State(site): State<Arc<Site>>, headers: HeaderMap, asked: Asked) -> Response {
    if !is_known(&site, &headers, &asked) {
        return refused();
    }
    file(
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        include_str!("page.html"),
    )
}

async fn live(
    State(site): State<Arc<Site>>,
    headers: HeaderMap,
    asked: Asked,
    upgrade: WebSocketUpgrade,
) -> Response {
    // Browsers always tell where a page is from; another page's socket is refused.
    let origin = headers.get(header::ORIGIN).map(|value| value.as_bytes());
    let own = format!("http://{}", site.host);
    let is_own = origin.is_none_or(|origin| origin == own.as_bytes());
    if !is_known(&site, &headers, &asked) || !is_own {
        return refused();
    }
    upgrade.on_upgrade(move |socket| async move { talk(socket, &site).await })
}

fn is_known(site: &Site, headers: &HeaderMap, Query(asked): &Asked) -> bool {
    let host = headers.get(header::HOST).map(|value| value.as_bytes());
    let is_host = host == Some(site.host.as_bytes());
    is_host && asked.get("token").is_some_and(|token| *token == site.token)
}

fn refused() -> Response {
    let line = "expected the address that `pneuma scope` printed, with its token\n";
    (StatusCode::FORBIDDEN, line).into_response()
}

/// One page: rows and words to it, orders from it.
async fn talk(mut socket: WebSocket, site: &Site) {
    let mut place = site.feed.end().saturating_sub(FIRST_ROWS);
    let (mut noted, mut round) = (0, 0_u32);
    let mut hello = site.hello.clone();
    if let Some(streaming) = site.feed.streaming() {
        hello["tick_s"] = json!(streaming.tick_s());
    }
    let hello = json!({ "hello": hello }).to_string();
    if socket.send(Message::text(hello)).await.is_err() {
        return;
    }
    let mut clock = tokio::time::interval(EVERY);
    clock.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tokio::select! {
            _ = clock.tick() => {
                let Some(sent) = send(&mut socket, site, (&mut place, &mut noted, round)).await else { return };
                round = sent;
            }
            message = socket.recv() => match message {
                Some(Ok(Message::Text(text))) => take(site, text.as_str()),
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => {}
            },
        }
    }
}

/// Rows, status and notes; the next round. `None`: the page has gone.
async fn send(
    socket: &mut WebSocket,
    site: &Site,
    (place, noted, round): (&mut u64, &mut u64, u32),
) -> Option<u32> {
    let (rows, after) = site.feed.rows_from(*place, MOST_ROWS);
    *place = after;
    if !rows.is_empty() {
        socket.send(Message::binary(bytes(&rows))).await.ok()?;
    }
    let (notes, after) = site.feed.notes_from(*noted);
    *noted = after;
    if !notes.is_empty() {
        let text = json!({ "notes": notes }).to_string();
        socket.send(Message::text(text)).await.ok()?;
    }
    if round.is_multiple_of(STATUS_EVERY) {
        let text = json!({ "status": site.feed.condition() }).to_string();
        socket.send(Message::text(text)).await.ok()?;
    }
    Some(round.wrapping_add(1))
}

/// Rows as the page reads them: a 32-bit tick and the signals in single precision, little-endian.
fn bytes(rows: &[Row]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(rows.len() * 4 * (COUNT + 1));
    for (tick, values) in rows {
        bytes.extend(tick.to_le_bytes());
        for value in values {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

fn take(site: &Site, text: &str) {
    match serde_json::from_str::<Order>(text) {
        Ok(order) => {
            // Without anybody to take it the program is about to end.
            let _ = site.orders.send(order);
        }
        Err(error) => site
            .feed
            .note(format!("an order that is none: {error}"), true),
    }
}
