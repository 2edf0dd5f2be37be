//! The live scope, at a board's twin on this machine: its pages as browsers see them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use std::{env, fs};

use host_sim::recording::Recording;
use host_sim::rig::Rig;
use serde_json::{Value, json};
use tungstenite::client::IntoClientRequest;
use tungstenite::protocol::WebSocket;
use tungstenite::{Message, client};

const PROGRAM: &str = env!("CARGO_BIN_EXE_pneuma");

/// A program that ends with its test.
struct Running {
    child: Child,
    first_line: String,
}

impl Running {
    fn start(arguments: &[&str], folder: &Path) -> Self {
        let mut child = Command::new(PROGRAM)
            .args(arguments)
            .current_dir(folder)
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let mut first_line = String::new();
        let out = child.stdout.as_mut().expect("its words");
        BufReader::new(out)
            .read_line(&mut first_line)
            .expect("a line");
        let first_line = first_line.trim().to_owned();
        assert!(!first_line.is_empty(), "{arguments:?} says nothing");
        Self { child, first_line }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn rig() -> String {
    let rig = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/paper.toml");
    rig.display().to_string()
}

fn twin(address: &str, folder: &Path) -> Running {
    let rig = rig();
    Running::start(
        &["board", "twin", "--rig", &rig, "--listen", address],
        folder,
    )
}

/// The twin's address, out of `listening at ADDRESS`.
fn address(twin: &Running) -> String {
    twin.first_line
        .rsplit(' ')
        .next()
        .expect("an address")
        .to_owned()
}

fn scope(twin: &Running, folder: &Path, more: &[&str]) -> Running {
    let (rig, address) = (rig(), address(twin));
    let folder_text = folder.display().to_string();
    let first = [
        "scope",
        "--serial",
        &address,
        "--rig",
        &rig,
        "--folder",
        &folder_text,
    ];
    Running::start(&[&first, more].concat(), folder)
}

/// Host and token of `http://HOST/?token=TOKEN`.
fn parts(scope: &Running) -> (String, String) {
    let line = scope
        .first_line
        .strip_prefix("http://")
        .expect("an address");
    let (host, token) = line.split_once("/?token=").expect("a token");
    (host.to_owned(), token.to_owned())
}

/// The status of a page, and its text.
fn get(host: &str, path: &str, named: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(host).expect("it listens");
    let request = format!("GET {path} HTTP/1.1\r\nHost: {named}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).expect("it hears");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("it answers");
    let status = answer.split(' ').nth(1).and_then(|word| word.parse().ok());
    (status.expect("a status"), answer)
}

/// A page without a browser.
struct Page {
    socket: WebSocket<TcpStream>,
    hello: Value,
    status: Value,
    notes: Vec<String>,
    rows: Vec<(u32, Vec<f32>)>,
}

impl Page {
    fn open(host: &str, token: &str, origin: &str) -> Result<Self, String> {
        let url = format!("ws://{host}/live?token={token}");
        let mut request = url
            .into_client_request()
            .map_err(|error| error.to_string())?;
        let origin = origin.parse().map_err(|_| "no origin".to_owned())?;
        request.headers_mut().insert("Origin", origin);
        let stream = TcpStream::connect(host).map_err(|error| error.to_string())?;
        let wait = Some(Duration::from_millis(50));
        let (socket, _) = client(request, stream).map_err(|error| error.to_string())?;
        socket.get_ref().set_read_timeout(wait).expect("a timeout");
        let mut page = Self {
            socket,
            hello: Value::Null,
            status: Value::Null,
            notes: Vec::new(),
            rows: Vec::new(),
        };
        page.until("it greets", |page| !page.hello.is_null());
        Ok(page)
    }

    fn say(&mut self, order: &Value) {
        self.socket
            .send(Message::text(order.to_string()))
            .expect("it hears");
    }

    /// Hears until something holds.
    fn until(&mut self, what: &str, holds: impl Fn(&Self) -> bool) {
        let begun = Instant::now();
        while !holds(self) {
            let waited = begun.elapsed() < Duration::from_secs(30);
            assert!(
                waited,
                "{what}: not within 30 s; {:?} {}",
                self.notes, self.status
            );
            match self.socket.read() {
                Ok(Message::Text(text)) => self.take(&serde_json::from_str(&text).expect("JSON")),
                Ok(Message::Binary(bytes)) => self.take_rows(&bytes),
                Ok(_) => {}
                Err(tungstenite::Error::Io(error))
                    if error.kind() == std::io::ErrorKind::WouldBlock => {}
                Err(error) => panic!("{what}: {error}"),
            }
        }
    }

    fn take(&mut self, said: &Value) {
        if let Some(hello) = said.get("hello") {
            self.hello = hello.clone();
        }
        if let Some(status) = said.get("status") {
            self.status = status.clone();
        }
        let notes = said.get("notes").and_then(Value::as_array);
        let texts = notes
            .into_iter()
            .flatten()
            .map(|note| note["text"].as_str());
        self.notes
            .extend(texts.map(|text| text.expect("words").to_owned()));
    }

    fn take_rows(&mut self, bytes: &[u8]) {
        let width = self.hello["signals"].as_array().expect("signals").len();
        let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).expect("four bytes");
        for begin in (0..bytes.len()).step_by(4 * (width + 1)) {
            let values = (1..=width).map(|place| f32::from_le_bytes(word(begin + 4 * place)));
            self.rows
                .push((u32::from_le_bytes(word(begin)), values.collect()));
        }
    }

    fn place(&self, name: &str) -> usize {
        let signals = self.hello["signals"].as_array().expect("signals");
        signals
            .iter()
            .position(|signal| signal["name"] == name)
            .expect("a signal")
    }

    fn last(&self, name: &str) -> f32 {
        let place = self.place(name);
        self.rows
            .last()
            .map_or(f32::NAN, |(_, values)| values[place])
    }

    fn has_noted(&self, words: &str) -> bool {
        self.notes.iter().any(|note| note.contains(words))
    }
}

fn opened(scope: &Running) -> Page {
    let (host, token) = parts(scope);
    Page::open(&host, &token, &format!("http://{host}")).expect("a page")
}

#[test]
fn prop_only_who_has_the_address_sees_the_board() {
    let place = tempfile::tempdir().expect("a folder");
    let twin = twin("127.0.0.1:0", place.path());
    let scope = scope(&twin, place.path(), &[]);
    let (host, token) = parts(&scope);
    let whole = format!("/?token={token}");
    let (status, text) = get(&host, &whole, &host);
    assert_eq!(status, 200, "{text}");
    assert!(text.contains("content-security-policy") && text.contains("<title>pneuma scope"));
    assert_eq!(get(&host, "/", &host).0, 403);
    assert_eq!(get(&host, "/?token=guess", &host).0, 403);
    // A name of somebody else's that leads here, as rebinding does.
    assert_eq!(get(&host, &whole, "scope.example:80").0, 403);
    let own = format!("http://{host}");
    assert!(Page::open(&host, &token, &own).is_ok());
    for (token, origin) in [("guess", own.as_str()), (&token, "http://other.example")] {
        let refused = Page::open(&host, token, origin).err().expect("refused");
        assert!(refused.contains("403"), "{refused}");
    }
}

#[test]
fn val_pages_show_every_tick_and_the_board_does_as_it_is_told() {
    let place = tempfile::tempdir().expect("a folder");
    let listener = UdpSocket::bind("127.0.0.1:0").expect("a port");
    listener
        .set_read_timeout(Some(Duration::from_secs(10)))
        .expect("a timeout");
    let udp = listener.local_addr().expect("its address").to_string();
    let twin = twin("127.0.0.1:0", place.path());
    let scope = scope(&twin, place.path(), &["--udp", &udp]);
    let mut page = opened(&scope);
    page.until("the axis is idle", |page| {
        page.status["state"]
            .as_str()
            .is_some_and(|s| s.starts_with("idle"))
    });

    // Recorded meanwhile: a move, a gain that is refused under way, and taken at rest.
    page.say(&json!({ "do": "record", "on": true, "mcap": true }));
    page.until("it records", |page| !page.status["recording"].is_null());
    page.say(&json!({ "do": "move", "to_mm": 20.0 }));
    page.until("it tracks", |page| page.last("reference") > 19.9);
    page.say(&json!({ "do": "gain", "key": "position_per_s", "value": 30.0 }));
    page.until("a gain under way is refused", |page| {
        page.has_noted("position_per_s = 30: ")
    });
    page.until("it arrives", |page| page.last("error").abs() < 0.05);
    page.say(&json!({ "do": "stop" }));
    page.until("it lets go", |page| {
        page.status["state"]
            .as_str()
            .is_some_and(|s| s.starts_with("idle"))
    });
    page.say(&json!({ "do": "gain", "key": "position_per_s", "value": 31.0 }));
    page.until("a gain at rest is taken", |page| {
        page.notes.iter().any(|n| n == "position_per_s = 31")
    });
    page.until("the page knows", |page| {
        page.status["gains"]["position_per_s"] == json!(31.0)
    });
    page.say(&json!({ "do": "gain", "key": "position_per_s", "value": 1e6 }));
    page.until("a gain out of range is refused", |page| {
        page.has_noted("position_per_s = 1000000: ")
    });
    page.say(&json!({ "do": "move", "to_mm": 900.0 }));
    page.until("a place out of reach is refused", |page| {
        page.has_noted("beyond the position converter")
    });
    page.say(&json!({ "do": "record", "on": false }));
    page.until("the recording stands", |page| page.has_noted(" rows, "));
    page.until("and as MCAP", |page| page.has_noted(".mcap: written"));

    // No tick is missing, on the page and in the file.
    let gaps = page
        .rows
        .windows(2)
        .filter(|pair| pair[1].0 != pair[0].0 + 1)
        .count();
    assert_eq!((gaps, page.status["losses"].as_str()), (0, Some("")));
    let recording = recorded(place.path());
    let text = fs::read_to_string(&recording).expect("it is there");
    assert!(
        text.contains("s: position_per_s = 31\n"),
        "the log stands in it"
    );
    let positions: Vec<f32> = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .skip(1)
        .map(|line| {
            line.split(',')
                .nth(column(&text, "x_m"))
                .expect("a cell")
                .parse()
                .expect("a number")
        })
        .collect();
    assert!(positions.len() > 500, "{}", positions.len());
    let at = page.place("position");
    let shown: Vec<f32> = page
        .rows
        .iter()
        .map(|(_, values)| 1e-3 * values[at])
        .collect();
    let near = |a: f32, b: f32| (a - b).abs() < 2e-7;
    let is_there = shown
        .windows(positions.len())
        .any(|part| part.iter().zip(&positions).all(|(a, b)| near(*a, *b)));
    assert!(is_there, "the rows of the page are those of the file");

    // The MCAP beside it holds the same.
    let rig = Rig::read(rig()).expect("it is a rig");
    let read = |path: &Path| Recording::read(path, &rig.signals).expect("it is read");
    let (text, packed) = (read(&recording), read(&recording.with_extension("mcap")));
    assert_eq!(text.len(), packed.len());
    for signal in ["x", "p_a", "u"] {
        assert_eq!(text.signal(signal), packed.signal(signal), "{signal}");
    }

    // A second page sees the same, and PlotJuggler's datagrams are numbers by name.
    let mut other = opened(&scope);
    other.until("rows come", |other| other.rows.len() > 200);
    let (tick, values) = &other.rows[100];
    let same = page.rows.iter().find(|row| row.0 == *tick);
    assert!(same.is_none_or(|row| row.1[at].to_bits() == values[at].to_bits()));
    let mut datagram = [0; 2048];
    let length = listener.recv(&mut datagram).expect("a datagram");
    let fields: Value = serde_json::from_slice(&datagram[..length]).expect("JSON");
    assert!(
        fields["t"].is_number() && fields["pressure_a"].as_f64().is_some_and(|bar| bar > 1.0),
        "{fields}"
    );
}

fn recorded(folder: &Path) -> PathBuf {
    let files = fs::read_dir(folder).expect("a folder").flatten();
    let mut csv = files
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "csv"));
    csv.next().expect("a recording")
}

fn column(text: &str, name: &str) -> usize {
    let head = text
        .lines()
        .find(|line| !line.starts_with('#'))
        .expect("a head");
    head.split(',')
        .position(|one| one == name)
        .unwrap_or_else(|| panic!("{name} in {head}"))
}

#[test]
fn prop_a_board_that_goes_is_looked_for_until_it_is_back() {
    let place = tempfile::tempdir().expect("a folder");
    let first = twin("127.0.0.1:0", place.path());
    let at = address(&first);
    let scope = scope(&first, place.path(), &[]);
    let mut page = opened(&scope);
    page.until("rows come", |page| page.rows.len() > 100);
    drop(first);
    page.until("it is missed", |page| page.status["state"] == "no board");
    page.say(&json!({ "do": "move", "to_mm": 10.0 }));
    page.until("orders are refused", |page| {
        page.has_noted("move to 10 mm: there is no board")
    });
    let rows = page.rows.len();
    let _second = twin(&at, place.path());
    page.until("it is back", |page| page.rows.len() > rows + 100);
    page.until("and idle", |page| {
        page.status["state"]
            .as_str()
            .is_some_and(|s| s.starts_with("idle"))
    });
}

/// With a real browser: `tests/browser` says what it needs.
#[test]
#[ignore = "long: cargo xtask test --all; needs Node and Chromium, see tests/browser/scope.mjs"]
fn val_a_browser_shows_what_the_board_sends() {
    let place = tempfile::tempdir().expect("a folder");
    let twin = twin("127.0.0.1:0", place.path());
    let scope = scope(&twin, place.path(), &[]);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/browser");
    let run = |words: &[&str]| {
        let mut command = Command::new(words[0]);
        let output = command.args(&words[1..]).current_dir(&folder).output();
        let output = output.unwrap_or_else(|error| panic!("{words:?}: {error}"));
        let said =
            String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{words:?}: {said}");
        said.into_owned()
    };
    run(&["npm", "install", "--silent", "--no-audit", "--no-fund"]);
    let pictures = place.path().display().to_string();
    let seconds = env::var("PNEUMA_SCOPE_SECONDS").unwrap_or_else(|_| "60".into());
    println!(
        "{}",
        run(&["node", "scope.mjs", &scope.first_line, &seconds, &pictures])
    );
}
