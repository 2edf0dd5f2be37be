//! Experiments that a board runs by itself: the firmware's code before the simulated axis.

#![allow(
    clippy::unwrap_used,
    reason = "the helpers of a test fail by panicking, as the tests do"
)]

use std::net::TcpListener;
use std::path::{Path, PathBuf};

use diagnosis::inspect::inspect;
use firmware::codes::{COMMAND_V, POSITION_M, PRESSURE_PA};
use firmware::control_task::ControlTask;
use firmware::experiment::frames::{self, Report};
use firmware::experiment::{Envelope, Reason, Stage, Step};
use firmware::fault::Fault;
use firmware::link::Order;
use firmware::settings::{Connection, Wiring};
use firmware::tick::{Command, Sample, State};
use host_sim::board::twin::Twin;
use host_sim::cli::board::{BoardArguments, BoardOrder, run as tell_board};
use host_sim::cli::board_port::BoardPort;
use host_sim::cli::board_run::RunArguments;
use host_sim::closed_loop::control_task;
use host_sim::plant::{Plant, PlantSettings};
use host_sim::recording::Recording;
use host_sim::rig::Rig;

use model_core::reference::Reference;

const DT_S: f64 = 1e-3;
const WIDE: Envelope = Envelope {
    position_m: [-0.2, 0.2],
    speed_m_per_s: 1.9,
    pressure_pa: [2e4, 9.5e5],
    force_n: 400.0,
};

fn rig_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/paper.toml")
}

/// A board's control task before its axis.
struct Board {
    task: ControlTask,
    plant: Plant,
    tick: u32,
    reference: Reference<f32>,
}

impl Board {
    /// Idle, with the load at rest.
    fn idle() -> Self {
        let rig = Rig::read(rig_file()).unwrap();
        let mut board = Self {
            task: control_task(&rig).unwrap(),
            plant: Plant::new(&rig, PlantSettings::at(0.0, 1)).unwrap(),
            tick: 0,
            reference: Reference::at(f32::NAN),
        };
        for _ in 0..500 {
            board.step();
        }
        board
    }

    fn step(&mut self) -> (Sample, Command) {
        self.tick += 1;
        let sample = Sample {
            tick: self.tick,
            codes: self.plant.sample(),
            reference: self.reference,
        };
        let command = self.task.tick(&sample);
        self.plant.advance(command.valve);
        (sample, command)
    }

    /// What the host sends, as the frames say it.
    fn serve(&mut self, payload: &[u8]) -> Report {
        let request = frames::read_request(payload).unwrap();
        let answer = self.task.serve_experiment(&request).payload();
        Report::read(&answer).unwrap()
    }

    fn load(&mut self, envelope: &Envelope, steps: &[Step]) -> u32 {
        assert_eq!(self.serve(&frames::guard(envelope)).reason, Reason::None);
        let loaded = self.serve(&frames::load(0, steps).unwrap());
        assert_eq!(loaded.stage, Stage::Ready, "{loaded:?}");
        let bytes: Vec<u8> = steps.iter().flat_map(Step::bytes).collect();
        frames::crc(envelope, &bytes)
    }

    fn begin(&mut self, envelope: &Envelope, steps: &[Step]) {
        let crc = self.load(envelope, steps);
        let begun = self.serve(&frames::run(crc));
        assert_eq!(begun.stage, Stage::Running, "{begun:?}");
    }

    /// Runs with a host that is there until the experiment has ended; what was commanded.
    fn until_ended(&mut self) -> (Vec<(Sample, Command)>, Report) {
        let mut all = Vec::new();
        loop {
            let report = self.serve(&frames::alive());
            if report.stage != Stage::Running {
                return (all, report);
            }
            all.push(self.step());
            assert!(all.len() < 100_000, "{report:?}");
        }
    }
}

fn opening_v(command: &Command) -> f64 {
    f64::from(COMMAND_V.value(command.valve.0)) - 5.0
}

fn ramp(seconds: f32, from_v: f32, to_v: f32) -> Step {
    Step::Opening {
        seconds,
        from_v,
        to_v,
    }
}

/// The converter has steps of 2.4 mV; their mean is the command.
#[test]
fn val_the_valve_opens_as_the_program_says() {
    let mut board = Board::idle();
    let null_v = 0.0;
    board.begin(&WIDE, &[ramp(0.2, 0.0, 0.3), ramp(0.2, 0.3, -0.3)]);
    let (rows, report) = board.until_ended();
    assert_eq!((report.stage, report.reason), (Stage::Done, Reason::None));
    // One tick more sees that the last step is over.
    assert_eq!(rows.len(), 401);
    for (number, (_, command)) in rows[..400].iter().enumerate() {
        let time_s = number as f64 * DT_S;
        let expected_v = if number < 200 {
            0.3 * time_s / 0.2
        } else {
            0.3 - 0.6 * (time_s - 0.2) / 0.2
        };
        assert_eq!(command.state, State::Open);
        assert!(
            (opening_v(command) - expected_v - null_v).abs() < 2.5e-3,
            "{number}"
        );
    }
    assert_eq!(rows[400].1.state, State::Idle);
    assert!(opening_v(&rows[400].1).abs() < 2.5e-3);
}

/// The tick whose sample is beyond the envelope commands the null.
#[test]
fn val_the_board_keeps_the_envelope_within_a_tick() {
    let narrow = |envelope: Envelope| envelope;
    for (envelope, reason) in [
        (
            narrow(Envelope {
                position_m: [-0.02, 0.02],
                ..WIDE
            }),
            Reason::Position,
        ),
        (
            narrow(Envelope {
                speed_m_per_s: 0.1,
                ..WIDE
            }),
            Reason::Speed,
        ),
        (
            narrow(Envelope {
                force_n: 30.0,
                ..WIDE
            }),
            Reason::Force,
        ),
        (
            narrow(Envelope {
                pressure_pa: [2e4, 4.2e5],
                ..WIDE
            }),
            Reason::Pressure,
        ),
    ] {
        let mut board = Board::idle();
        board.begin(&envelope, &[ramp(3.0, 1.5, 1.5)]);
        let (rows, report) = board.until_ended();
        assert_eq!((report.stage, report.reason), (Stage::Ended, reason));
        let (last, before) = rows.split_last().unwrap();
        assert!(opening_v(&last.1).abs() < 2.5e-3 && last.1.state == State::Idle);
        assert_eq!(report.tick, last.0.tick);
        assert!(
            before
                .iter()
                .all(|(_, command)| command.state == State::Open)
        );
        // None of the samples before was beyond it.
        let is_within = |(sample, _): &(Sample, Command)| {
            let codes = sample.codes;
            let position_m = POSITION_M.value(codes.position.0);
            let [a_pa, b_pa] =
                [codes.pressure_a, codes.pressure_b].map(|code| PRESSURE_PA.value(code.0));
            let [low_m, high_m] = envelope.position_m;
            let most_pa = envelope.pressure_pa[1];
            position_m >= low_m && position_m <= high_m && a_pa <= most_pa && b_pa <= most_pa
        };
        assert!(before.iter().all(is_within));
    }
}

/// How far the load still goes behind the shut valve: docs/experiments.md states it.
#[test]
fn val_a_load_of_1_m_s_is_stopped_within_the_room_that_the_documents_state() {
    let mut board = Board::idle();
    let envelope = Envelope {
        speed_m_per_s: 1.0,
        ..WIDE
    };
    // Back first: there is room ahead then.
    board.begin(
        &envelope,
        &[
            Step::Move {
                seconds: 2.0,
                to_m: -0.15,
            },
            ramp(2.0, 4.0, 4.0),
        ],
    );
    let (_, report) = board.until_ended();
    assert_eq!(report.reason, Reason::Speed, "{report:?}");
    let left_m = board.plant.truth().position_m;
    let places = (0..1000).map(|_| {
        board.step();
        board.plant.truth().position_m - left_m
    });
    let furthest_m = places.fold(0.0, f64::max);
    assert!((0.06..0.08).contains(&furthest_m), "{furthest_m}");
}

#[test]
fn val_a_host_that_falls_silent_ends_it_after_half_a_second() {
    let mut board = Board::idle();
    board.begin(&WIDE, &[Step::Hold { seconds: 10.0 }]);
    let states: Vec<State> = (0..1000).map(|_| board.step().1.state).collect();
    let held = states.iter().filter(|state| **state == State::Track);
    assert!((499..=501).contains(&held.count()));
    let report = board.serve(&frames::alive());
    assert_eq!(
        (report.stage, report.reason),
        (Stage::Ended, Reason::HostSilent)
    );
}

#[test]
fn prop_a_fault_and_any_wish_end_it() {
    let hold = [Step::Hold { seconds: 10.0 }];
    let mut board = Board::idle();
    board.begin(&WIDE, &hold);
    board.step();
    board.task.obey(Order::Inject(Fault::SupplyLost.at(0)));
    assert_eq!(board.step().1.state, State::Fault);
    assert_eq!(board.serve(&frames::alive()).reason, Reason::Fault);
    for stop in [
        (|board: &mut Board| board.task.let_go()) as fn(&mut Board),
        |board| {
            board.serve(&frames::halt());
        },
    ] {
        let mut board = Board::idle();
        board.begin(&WIDE, &hold);
        assert_eq!(board.step().1.state, State::Track);
        stop(&mut board);
        assert_eq!(board.step().1.state, State::Idle);
        assert_eq!(board.serve(&frames::alive()).reason, Reason::Stopped);
    }
}

#[test]
fn prop_nothing_begins_that_is_another_program_or_not_ready() {
    let hold = [Step::Hold { seconds: 1.0 }];
    let mut board = Board::idle();
    let crc = board.load(&WIDE, &hold);
    assert_eq!(
        board.serve(&frames::run(crc ^ 1)).reason,
        Reason::NotThisProgram
    );
    // Another envelope is another program.
    board.serve(&frames::guard(&Envelope {
        force_n: 399.0,
        ..WIDE
    }));
    board.serve(&frames::load(0, &hold).unwrap());
    assert_eq!(
        board.serve(&frames::run(crc)).reason,
        Reason::NotThisProgram
    );
    // What follows the loop does not begin.
    let crc = board.load(&WIDE, &hold);
    board.reference = Reference::at(0.05);
    for _ in 0..100 {
        board.step();
    }
    assert_eq!(board.serve(&frames::run(crc)).reason, Reason::NotIdle);
    // A load that moves does not begin either.
    board.reference = Reference::at(f32::NAN);
    board.step();
    let moves = board.serve(&frames::run(crc));
    assert_eq!(moves.reason, Reason::NotAtRest);
    // Impossible steps are not taken.
    let wild = [ramp(1.0, 0.0, f32::NAN)];
    board.serve(&frames::guard(&WIDE));
    let refused = board.serve(&frames::load(0, &wild).unwrap());
    assert_eq!(
        (refused.stage, refused.reason),
        (Stage::Empty, Reason::Impossible)
    );
    // A gap in the steps is none of a program.
    board.serve(&frames::guard(&WIDE));
    let gap = board.serve(&frames::load(2, &hold).unwrap());
    assert_eq!(gap.stage, Stage::Empty);
}

/// As delivered: no set-point, no experiment that reaches far; checked, then a fault of the wiring.
#[test]
fn prop_an_unchecked_axis_goes_nowhere() {
    let mut board = Board::idle();
    let rig = Rig::read(rig_file()).unwrap();
    let controller = || host_sim::closed_loop::controller(&rig).unwrap();
    let replaced = board
        .task
        .replace_controller(controller(), &Connection::standard(Wiring::Unchecked));
    assert_eq!(replaced, Ok(()));
    board.reference = Reference::at(0.05);
    for _ in 0..300 {
        assert_ne!(board.step().1.state, State::Track);
    }
    let hold = [Step::Hold { seconds: 0.1 }];
    let narrow = |low_m: f32, high_m: f32| Envelope {
        position_m: [low_m, high_m],
        ..WIDE
    };
    for (envelope, reason) in [
        (WIDE, Reason::Unchecked),
        (narrow(-2.1e-3, 1.9e-3), Reason::Unchecked),
        (narrow(-1.9e-3, 2.1e-3), Reason::Unchecked),
        (narrow(-1.9e-3, 1.9e-3), Reason::None),
    ] {
        let crc = board.load(&envelope, &hold);
        let begun = board.serve(&frames::run(crc));
        assert_eq!(begun.reason, reason, "{envelope:?}");
    }
    for _ in 0..200 {
        board.step();
    }
    assert_eq!(board.serve(&frames::alive()).stage, Stage::Done);
    board.reference = Reference::at(f32::NAN);
    let replaced = board
        .task
        .replace_controller(controller(), &Connection::standard(Wiring::Checked));
    assert_eq!(replaced, Ok(()));
    board.reference = Reference::at(0.01);
    for _ in 0..50 {
        board.step();
    }
    assert_eq!(board.step().1.state, State::Track);
    // What was checked is in doubt again.
    board.task.obey(Order::Inject(Fault::WrongPolarity.at(0)));
    assert_eq!(board.step().1.state, State::Fault);
    assert!(board.task.acknowledge());
    for _ in 0..300 {
        assert_ne!(board.step().1.state, State::Track);
    }
}

/// The force loop alone: the mean over the last half of a step, by the gauges.
#[test]
fn val_the_gas_pushes_with_the_force_asked_for() {
    for force_n in [-25.0, 20.0] {
        let mut board = Board::idle();
        // Below break-away: the load stays.
        board.begin(
            &WIDE,
            &[Step::Force {
                seconds: 1.0,
                force_n,
            }],
        );
        let (rows, report) = board.until_ended();
        assert_eq!(report.stage, Stage::Done, "{report:?}");
        let late = &rows[500..1000];
        let force = |(sample, _): &(Sample, Command)| {
            let pa = |code: u16| f64::from(PRESSURE_PA.value(code));
            let codes = sample.codes;
            4.909e-4 * (pa(codes.pressure_a.0) - pa(codes.pressure_b.0))
        };
        let mean = late.iter().map(force).sum::<f64>() / late.len() as f64;
        assert!(
            (mean - f64::from(force_n)).abs() < 1.5,
            "{mean} for {force_n}"
        );
    }
}

const PROGRAM: &str = r#"format = "experiment/1"

[envelope]
position_m = [-0.15, 0.15]
speed_m_s = 1.5
pressure_Pa = [5e4, 8e5]
force_N = 300.0

[[step]]
kind = "move"
to_m = 0.03
seconds = 1.0

[[step]]
kind = "bursts"
amplitude_V = 1.0
shortest_s = 0.02
longest_s = 0.08
seconds = 2.0

[[step]]
kind = "sine"
amplitude_m = 0.02
frequency_Hz = 1.0
periods = 2
"#;

/// A twin that serves one host after the other, faster than time.
fn twin(hosts: usize) -> String {
    let rig = Rig::read(rig_file()).unwrap();
    let mut twin = Twin::new(&rig, (&rig, Wiring::Checked), PlantSettings::at(0.0, 1)).unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        for _ in 0..hosts {
            // A host that says twenty times a second that it is there must be heard in time.
            twin.serve_next(&listener, 2.0).unwrap();
        }
    });
    address
}

fn run(address: &str, folder: &Path, program: &str) -> (Result<(), String>, String) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("e.toml"), program).unwrap();
    let arguments = BoardArguments {
        order: BoardOrder::Run(RunArguments {
            experiment: folder.join("e.toml"),
            port: BoardPort {
                serial: address.into(),
                baud: 0,
            },
            rig: rig_file(),
            out: folder.join("run.csv"),
        }),
    };
    let mut out = Vec::new();
    let outcome = tell_board(&arguments, &mut out).map_err(|error| error.to_string());
    (outcome, String::from_utf8(out).unwrap())
}

#[test]
fn val_an_experiment_becomes_a_recording_that_is_read_without_an_edit() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("experiment-whole");
    let (outcome, said) = run(&twin(1), &folder, PROGRAM);
    outcome.unwrap();
    assert!(
        said.contains("ran to its end") && said.contains("nothing was lost"),
        "{said}"
    );
    assert!(
        said.contains("step 2 (bursts): opening 1.00 V there and back"),
        "{said}"
    );
    let rig = Rig::read(rig_file()).unwrap();
    let recording = Recording::read(folder.join("run.csv"), &rig.signals).unwrap();
    assert!(
        (5.0..7.5).contains(&recording.duration_s()),
        "{}",
        recording.duration_s()
    );
    let inspection = inspect(&rig, &recording);
    assert!(inspection.faults.is_empty(), "{:?}", inspection.faults);
    let text = std::fs::read_to_string(folder.join("run.csv")).unwrap();
    assert!(
        text.starts_with("# experiment e.toml, rig paper.toml")
            && text.contains("# kind = \"bursts\"")
    );
}

#[test]
fn val_an_experiment_that_leaves_its_envelope_is_said_and_kept() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("experiment-left");
    let program = PROGRAM.replace("[-0.15, 0.15]", "[-0.15, 0.02]");
    let (outcome, said) = run(&twin(1), &folder, &program);
    let line = outcome.unwrap_err();
    assert!(
        line.contains("ended early in step 1 (move): the load left the envelope's places (20."),
        "{line}"
    );
    assert!(said.contains("run.csv:"), "{said}");
    let rig = Rig::read(rig_file()).unwrap();
    assert!(
        Recording::read(folder.join("run.csv"), &rig.signals)
            .unwrap()
            .len()
            > 300
    );
}
