//! `pneuma commission` on drawn axes that nobody here wrote a rig file for: a board's twin before an axis
//! of `truth-plant`, shop-floor nature, with one effect that its rig file does not know.
//!
//!     cargo run --release -p host-sim --example commissioning -- 1101 1121
//!
//! prints a line a seed; with the name of a step behind the seeds it ends there.

#![allow(clippy::unwrap_used, reason = "a failure ends the show")]

use firmware::settings::Wiring;
use host_sim::board::twin::Twin;
use host_sim::cli::board_port::BoardPort;
use host_sim::cli::commission::{CommissionArguments, run};
use host_sim::cli::on_board::OnBoard;
use host_sim::commission::score::Score;
use host_sim::commission::steps::{Progress, Step};
use host_sim::rig::Rig;
use host_sim::trial::drawn_axis::DrawnAxis;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use truth_plant::{Kind, Nature, Request, Strength};

/// Faster than time, and slow enough for the host's signs of life.
const SPEED: f64 = 3.0;
const EFFECTS: [&str; 3] = ["tube-line", "piston-leakage", "spool-dynamics"];
const MARKS_MM: [f64; 2] = [0.03, 0.5];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = [0, 1].map(|place| words[place].parse::<u64>().unwrap());
    let until = words.get(2).map(|word| {
        let named = Step::ALL.into_iter().find(|step| step.name() == word);
        named.unwrap()
    });
    println!(
        "| seed | effect | at rest before, mm | after | in the sine before, mm | after | verdict or end |"
    );
    println!("|---:|---|---:|---:|---:|---:|---|");
    let mut reached = 0;
    for seed in from..to {
        let effect = EFFECTS[(seed % 3) as usize];
        let (progress, outcome) = commissioned(seed, effect, until);
        let is_reached = progress.after.is_some_and(|after| {
            after.at_rest_mm <= MARKS_MM[0] && after.in_sine_mm <= MARKS_MM[1]
        });
        reached += usize::from(is_reached);
        let figures = |of: fn(&Score) -> f64| {
            let said = |score: Option<Score>| {
                score.map_or("-".into(), |score| format!("{:.3}", of(&score)))
            };
            format!("{} | {}", said(progress.before), said(progress.after))
        };
        let end = match (&outcome, &progress.verdict) {
            (Err(error), _) => error.clone(),
            (Ok(()), verdict) => verdict.clone().unwrap_or_default(),
        };
        println!(
            "| {seed} | {effect} | {} | {} | {} |",
            figures(|score| score.at_rest_mm),
            figures(|score| score.in_sine_mm),
            end.replace('|', "/")
        );
    }
    println!("\n{reached} of {} reach {MARKS_MM:?} mm", to - from);
}

fn commissioned(seed: u64, effect: &str, until: Option<Step>) -> (Progress, Result<(), String>) {
    let request = Request::new(seed, Kind::Single)
        .with_nature(Nature::ShopFloor)
        .with_effect(effect)
        .unwrap()
        .with_strength(Strength::Strong);
    let folder = std::env::temp_dir().join(format!("commissioning-{seed}"));
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let rig = folder.join("rig.toml");
    std::fs::write(&rig, of_a_board(&request.draw().rig_toml)).unwrap();
    let known = Rig::read(&rig).unwrap();
    let address = match board(&request, &known) {
        Ok(address) => address,
        Err(error) => return (Progress::default(), Err(error)),
    };
    let arguments = CommissionArguments {
        board: OnBoard {
            port: BoardPort {
                serial: address,
                baud: 0,
            },
            rig,
            folder: folder.clone(),
            yes: true,
        },
        from: None,
        until,
    };
    let outcome = run(&arguments, &mut std::io::sink()).map_err(|error| error.to_string());
    let progress = Progress::read(&progress_of(&folder)).unwrap();
    (progress, outcome)
}

fn progress_of(folder: &Path) -> PathBuf {
    folder.join("commission.json")
}

/// The rig file with the signals that a board records, in the noise that it states.
fn of_a_board(text: &str) -> String {
    let mut rig = Rig::parse(text, "rig.toml").unwrap();
    let noise = |name: &str, usual: f64| {
        let signal = rig.signals.get(name);
        signal.and_then(|signal| signal.noise).unwrap_or(usual)
    };
    let mut signals = String::from(
        "format = \"rig/1\"\n[signals]\nt = { column = \"t_s\", unit = \"s\" }\nu = { column = \"u_V\", unit = \"V\" }\n",
    );
    for (name, column, unit, usual) in [
        ("p_a", "p_a_Pa", "Pa(abs)", 250.0),
        ("p_b", "p_b_Pa", "Pa(abs)", 250.0),
        ("p_s", "p_s_Pa", "Pa(abs)", 250.0),
        ("x", "x_m", "m", 4e-6),
        ("v", "v_m_s", "m/s", 1.5e-3),
    ] {
        let noise = noise(name, usual);
        signals += &format!(
            "{name} = {{ column = \"{column}\", unit = \"{unit}\", noise = {noise:?} }}\n"
        );
    }
    rig.signals = Rig::parse(&signals, "signals.toml").unwrap().signals;
    rig.to_toml()
}

/// A board on the host, at an address.
fn board(request: &Request, known: &Rig) -> Result<String, String> {
    let axis = DrawnAxis::new(request.plant());
    let twin = Twin::before(axis, (known, Wiring::Unchecked), truth_plant::plant::TICK_S);
    let mut twin = twin.map_err(|fault| format!("{}: {}", fault.key, fault.problem))?;
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        loop {
            let _ = twin.serve_next(&listener, SPEED);
        }
    });
    Ok(address)
}
