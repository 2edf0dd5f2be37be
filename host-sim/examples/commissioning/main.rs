//! From a data sheet to an acceptance sheet on drawn axes that nobody here wrote a rig file for:
//! `pneuma init` with what data sheets say, then `pneuma commission` at a board's twin before an axis of
//! `truth-plant`, shop-floor nature, with an effect that no data sheet knows. Each axis is wired
//! wrongly first, in one of twelve ways; what the check names is put right, and the way goes on.
//!
//!     cargo run --release -p host-sim --example commissioning -- 5001 5021
//!
//! prints a line a seed; with the name of a step behind the seeds it ends there.

#![allow(clippy::unwrap_used, reason = "a failure ends the show")]

mod wires;

use firmware::settings::Wiring;
use host_sim::board::orders;
use host_sim::board::port::Port;
use host_sim::board::twin::Twin;
use host_sim::cli::board_port::BoardPort;
use host_sim::cli::commission::{CommissionArguments, run};
use host_sim::cli::init::{self, InitArguments};
use host_sim::cli::on_board::OnBoard;
use host_sim::commission::score::Score;
use host_sim::commission::steps::{Progress, Step};
use host_sim::rig::Rig;
use host_sim::trial::drawn_axis::DrawnAxis;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use truth_plant::{Kind, Nature, Request, Strength, Truth};
use wires::{Shared, Wired, Wires};

/// Faster than time, and slow enough for the host's signs of life.
const SPEED: f64 = 3.0;
const EFFECTS: [&str; 3] = ["tube-line", "piston-leakage", "spool-dynamics"];
/// At rest and in the sine, mm.
const MARKS_MM: [f64; 2] = [0.03, 0.5];
/// A wrong wiring is named before the load has moved so far, mm.
const NAMED_WITHIN_MM: f64 = 2.0;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = [0, 1].map(|place| words[place].parse::<u64>().unwrap());
    let until = words.get(2).map(|word| {
        let named = Step::ALL.into_iter().find(|step| step.name() == word);
        named.unwrap()
    });
    println!(
        "| seed | wired | named | moved, mm | effect | found | at rest before, mm | after | in the sine before, mm | after | motions | axis time, min | end |"
    );
    println!("|---:|---|---|---:|---|---|---:|---:|---:|---:|---:|---:|---|");
    let mut counts = [0_usize; 3];
    for seed in from..to {
        let way = Way::of(seed, until);
        for (count, is) in counts
            .iter_mut()
            .zip([way.is_named(), way.is_found(), way.is_reached()])
        {
            *count += usize::from(is);
        }
        println!("{}", way.line(seed));
    }
    let all = to - from;
    let [named, found, reached] = counts;
    println!(
        "\nOf {all} axes: the wrong wiring named within {NAMED_WITHIN_MM} mm on {named}, the effect found on {found}, {MARKS_MM:?} mm reached on {reached}."
    );
}

/// What came of an axis.
struct Way {
    wires: Wires,
    effect: &'static str,
    /// What the check said of the wrong wires, and how far the load had gone by then, mm.
    wiring: (String, f64),
    progress: Progress,
    outcome: Result<(), String>,
    motions: usize,
    axis_min: f64,
}

impl Way {
    fn of(seed: u64, until: Option<Step>) -> Self {
        let effect = EFFECTS[(seed % 3) as usize];
        let wires = Wires::WRONG[(seed % 12) as usize];
        let request = Request::new(seed, Kind::Single)
            .with_nature(Nature::ShopFloor)
            .with_effect(effect)
            .unwrap()
            .with_strength(Strength::Strong);
        let folder = std::env::temp_dir().join(format!("commissioning-{seed}"));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let truth = request.truth();
        let rig = first_rig(&folder, &truth);
        let (serial, looked) = board(&request, &truth, &rig, wires);
        let mut arguments = CommissionArguments {
            board: OnBoard {
                port: BoardPort { serial, baud: 0 },
                rig,
                folder: folder.clone(),
                yes: true,
            },
            from: None,
            until: Some(Step::Wiring),
        };
        let mut said = Vec::new();
        let wrong = run(&arguments, &mut said).map_err(|error| error.to_string());
        let wrong_said = wrong.err().unwrap_or_else(|| "nothing".into());
        let went_mm = 1e3 * looked.lock().unwrap().went_m;
        let kept = folder.join("wrong");
        std::fs::create_dir_all(&kept).unwrap();
        for name in ["wiring-pulses.csv", "wiring-swing.csv"] {
            // There is none where the check ended before it.
            let _ = std::fs::rename(folder.join(name), kept.join(name));
        }
        looked.lock().unwrap().wires = Wires::RIGHT;
        // A sensor that is exchanged under power jumps: fault 4.
        let mut port = Port::open(&arguments.board.port.serial, 0).unwrap();
        orders::acknowledge(&mut port).unwrap();
        drop(port);
        arguments.until = until;
        let outcome = run(&arguments, &mut said).map_err(|error| error.to_string());
        let said = String::from_utf8(said).unwrap();
        std::fs::write(folder.join("said.txt"), &said).unwrap();
        let ticks = looked.lock().unwrap().ticks;
        Self {
            wires,
            effect,
            wiring: (wrong_said, went_mm),
            progress: Progress::read(&folder.join("commission.json")).unwrap(),
            outcome,
            motions: said.matches("pneuma board run").count(),
            axis_min: ticks as f64 * truth_plant::plant::TICK_S / 60.0,
        }
    }

    fn is_named(&self) -> bool {
        self.wiring.0.contains(self.wires.said) && self.wiring.1 < NAMED_WITHIN_MM
    }

    /// Verdicts say names in words.
    fn is_found(&self) -> bool {
        let verdict = self.progress.verdict.as_deref().unwrap_or_default();
        verdict.contains(&self.effect.replace('-', " "))
    }

    fn is_reached(&self) -> bool {
        self.progress
            .after
            .is_some_and(|after| after.at_rest_mm <= MARKS_MM[0] && after.in_sine_mm <= MARKS_MM[1])
    }

    fn line(&self, seed: u64) -> String {
        let figures = |of: fn(&Score) -> f64| {
            let said = |score: Option<Score>| {
                score.map_or("-".into(), |score| format!("{:.3}", of(&score)))
            };
            let progress = &self.progress;
            format!("{} | {}", said(progress.before), said(progress.after))
        };
        let yes = |is: bool| if is { "yes" } else { "no" };
        let end = match (&self.outcome, &self.progress.verdict) {
            (Err(error), _) => error.clone(),
            (Ok(()), verdict) => verdict.clone().unwrap_or_default(),
        };
        let wiring = match self.is_named() {
            true => "yes".into(),
            false => format!("no: {}", self.wiring.0),
        };
        format!(
            "| {seed} | {} | {wiring} | {:.2} | {} | {} | {} | {} | {} | {:.1} | {} |",
            self.wires.name,
            self.wiring.1,
            self.effect,
            yes(self.is_found()),
            figures(|score| score.at_rest_mm),
            figures(|score| score.in_sine_mm),
            self.motions,
            self.axis_min,
            end.replace(['|', '\n'], "/")
        )
    }
}

/// The rig file of somebody who has the data sheets, a scale and a pressure gauge.
fn first_rig(folder: &Path, truth: &Truth) -> PathBuf {
    let out = folder.join("rig.toml");
    let rounded = |value: f64, step: f64| (value / step).round() * step;
    let arguments = InitArguments {
        bore_mm: Some(25.0),
        rod_mm: Some(0.0),
        stroke_mm: Some(500.0),
        mass_kg: Some(rounded(truth.plant["M"], 0.1)),
        valve: Some("MPYE-5-1/8-HF-010B".into()),
        supply_bar_absolute: Some(rounded(1e-5 * truth.plant["ps"], 0.1)),
        null_v: 5.0,
        full_opening_v: 5.0,
        ambient_hpa: 1013.25,
        temperature_c: 20.0,
        board: true,
        out: out.clone(),
        ..InitArguments::default()
    };
    init::run(&arguments, &mut std::io::sink()).unwrap();
    out
}

/// A board on the host, at an address.
fn board(request: &Request, truth: &Truth, known: &Path, wires: Wires) -> (String, Shared) {
    let axis = DrawnAxis::new(request.plant());
    let (axis, looked) = Wired::new(axis, truth.plant["null"], wires);
    let known = Rig::read(known).unwrap();
    let tick_s = truth_plant::plant::TICK_S;
    let mut twin = Twin::before(axis, (&known, Wiring::Unchecked), tick_s).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        loop {
            let _ = twin.serve_next(&listener, SPEED);
        }
    });
    (address, looked)
}
