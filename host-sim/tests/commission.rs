//! `pneuma commission` against a board on the host: the firmware's code before an axis of which the
//! rig file does not know all.

#![allow(
    clippy::unwrap_used,
    reason = "the helpers of a test fail by panicking, as the tests do"
)]

use std::net::TcpListener;
use std::path::{Path, PathBuf};

use firmware::settings::Wiring;
use host_sim::board::twin::Twin;
use host_sim::cli::board_port::BoardPort;
use host_sim::cli::commission::{CommissionArguments, run};
use host_sim::cli::on_board::OnBoard;
use host_sim::commission::steps::{Progress, Step};
use host_sim::plant::PlantSettings;
use host_sim::recording::Recording;
use host_sim::rig::Rig;

/// Faster than time; the host still says four times before the board takes it for gone that it is there.
const SPEED: f64 = 2.5;
const PAPER: &str = include_str!("../rigs/paper.toml");
/// As `pneuma init` states it of a data sheet.
const UNCERTAINTY: &str = include_str!("../fixtures/paper-uncertainty.toml");

/// A board at an axis, whose settings are the paper's.
fn board(axis: &str) -> String {
    let known = Rig::parse(PAPER, "paper.toml").unwrap();
    let truth = Rig::parse(axis, "truth.toml").unwrap();
    let mut twin = Twin::new(
        &truth,
        (&known, Wiring::Unchecked),
        PlantSettings::at(0.0, 1),
    )
    .unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        loop {
            twin.serve_next(&listener, SPEED).unwrap();
        }
    });
    address
}

struct Way {
    arguments: CommissionArguments,
}

impl Way {
    fn new(name: &str, axis: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("commission-{name}"));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        let rig = folder.join("rig.toml");
        std::fs::write(&rig, format!("{PAPER}{UNCERTAINTY}")).unwrap();
        Self {
            arguments: CommissionArguments {
                board: OnBoard {
                    port: BoardPort {
                        serial: board(axis),
                        baud: 0,
                    },
                    rig,
                    folder,
                    yes: true,
                },
                from: None,
                until: None,
            },
        }
    }

    fn until(&mut self, step: Option<Step>) -> (Result<(), String>, String) {
        self.arguments.until = step;
        let mut out = Vec::new();
        let outcome = run(&self.arguments, &mut out).map_err(|error| error.to_string());
        (outcome, String::from_utf8(out).unwrap())
    }

    fn file(&self, name: &str) -> PathBuf {
        self.arguments.board.folder.join(name)
    }
}

#[test]
fn val_a_reversed_valve_is_named_before_the_load_has_moved_2_mm() {
    let reversed = PAPER.replace(
        "feeds_a_when = \"above-null\"",
        "feeds_a_when = \"below-null\"",
    );
    assert_ne!(reversed, PAPER);
    let mut way = Way::new("reversed", &reversed);
    let (outcome, said) = way.until(Some(Step::Wiring));
    let line = outcome.unwrap_err();
    assert!(line.contains("the valve is reversed"), "{line}\n{said}");
    let rig = Rig::read(&way.arguments.board.rig).unwrap();
    for name in ["wiring-pulses.csv", "wiring-swing.csv"] {
        let recording = Recording::read(way.file(name), &rig.signals).unwrap();
        let position_m = recording.signal("x").unwrap();
        let furthest_m = position_m.iter().map(|one| (one - position_m[0]).abs());
        assert!(furthest_m.fold(0.0, f64::max) < 2e-3, "{name}");
    }
    // The step is not done: the next run begins with it again.
    let progress = Progress::read(&way.file("commission.json")).unwrap();
    assert_eq!(progress.next(), Some(Step::Wiring));
}

#[test]
fn val_a_way_that_was_left_is_gone_on_with() {
    let mut way = Way::new("left", PAPER);
    let (outcome, said) = way.until(Some(Step::Settings));
    outcome.unwrap();
    assert!(
        said.contains("1 of 11, board") && said.contains("2 of 11, settings"),
        "{said}"
    );
    let (outcome, said) = way.until(Some(Step::Wiring));
    outcome.unwrap();
    assert!(
        said.contains("3 of 11, wiring") && !said.contains("2 of 11"),
        "{said}"
    );
    assert!(said.contains("load swings 1.0 mm"), "{said}");
    way.arguments.from = Some(Step::Board);
    let (outcome, said) = way.until(Some(Step::Board));
    outcome.unwrap();
    assert!(said.contains("1 of 11, board"), "{said}");
}

/// A tube of 1.5 m, another null and another friction than the rig file's: found on the way, and the
/// score after it within the marks.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_an_axis_with_an_unknown_tube_is_brought_into_service() {
    let axis = PAPER
        .replace("coulomb_N = 20.2", "coulomb_N = 24.0")
        .replace("null_V = 5.0\n", "null_V = 5.03\n")
        + "\n[effects.tube-line]\nlength_m = 1.5\ndiameter_m = 0.004\n";
    let mut way = Way::new("tube", &axis);
    let (outcome, said) = way.until(None);
    outcome.unwrap_or_else(|error| panic!("{error}\n{said}"));
    let progress = Progress::read(&way.file("commission.json")).unwrap();
    let verdict = progress.verdict.clone().unwrap();
    assert!(verdict.contains("tube line"), "{verdict}");
    let after = progress.after.unwrap();
    assert!(
        after.at_rest_mm <= 0.03 && after.in_sine_mm <= 0.5,
        "{after:?}"
    );
    if let Some(before) = progress.before {
        assert!(after.in_sine_mm < before.in_sine_mm, "{before:?} {after:?}");
    }
    let sheet = std::fs::read_to_string(way.file("sheet.html")).unwrap();
    assert!(sheet.contains("tube line") && sheet.contains("before"));
}
