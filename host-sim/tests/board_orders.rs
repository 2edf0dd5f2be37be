//! What a person tells a board, told to its twin on the host: the same firmware,
//! an axis in simulation, frames over TCP.

use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use firmware::fault::Fault;
use firmware::link::{self, Order};
use firmware::settings::Wiring;
use host_sim::board::port::Port;
use host_sim::board::twin::Twin;
use host_sim::cli::board::{BoardArguments, BoardOrder, MoveArguments, run as tell_board};
use host_sim::cli::board_port::BoardPort;
use host_sim::cli::controller::{ControllerArguments, run as controller};
use host_sim::cli::doctor::{DoctorArguments, run as see_a_doctor};
use host_sim::cli::record::{RecordArguments, run as record};
use host_sim::cli::settings::{SettingsArguments, run as settings};
use host_sim::plant::PlantSettings;
use host_sim::rig::Rig;

/// Faster than time, so that the tests do not wait for the axis.
const SPEED: f64 = 20.0;

fn rig_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/paper.toml")
}

/// A twin that serves so many hosts, one after the other.
fn twin(hosts: usize) -> (String, JoinHandle<()>) {
    twin_of(&Rig::read(rig_file()).expect("it is a rig"), hosts)
}

fn twin_of(rig: &Rig, hosts: usize) -> (String, JoinHandle<()>) {
    let plant = PlantSettings::at(0.0, 1);
    let mut twin = Twin::new(rig, (rig, Wiring::Checked), plant).expect("it is an axis");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener.local_addr().expect("it has one").to_string();
    let thread = std::thread::spawn(move || {
        for _ in 0..hosts {
            twin.serve_next(&listener, SPEED).expect("it serves");
        }
    });
    (address, thread)
}

fn tell(order: BoardOrder) -> Result<String, String> {
    let mut out = Vec::new();
    let outcome = tell_board(&BoardArguments { order }, &mut out);
    let said = String::from_utf8(out).expect("it is text");
    match outcome {
        Ok(()) => Ok(said),
        Err(error) => {
            let line = error.to_string();
            assert!(!line.contains('\n') && said.is_empty(), "{line} {said}");
            Err(line)
        }
    }
}

fn at(address: &str) -> BoardPort {
    BoardPort {
        serial: address.into(),
        baud: 0,
    }
}

fn to(address: &str, to_mm: f64) -> MoveArguments {
    MoveArguments {
        port: at(address),
        to_mm,
        within_mm: 0.1,
        seconds: 5.0,
    }
}

#[test]
fn prop_a_move_arrives_is_held_and_let_go() {
    let (address, thread) = twin(5);
    let said = tell(BoardOrder::Move(to(&address, -60.0))).expect("it arrives");
    let place = said
        .split("at ")
        .nth(1)
        .and_then(|rest| rest.split(' ').next());
    let place = place.expect("a place").replace('\u{2212}', "-");
    let place_mm: f64 = place.parse().expect("a number");
    assert!((place_mm + 60.0).abs() < 0.05, "{said}");
    let said = tell(BoardOrder::Status(at(&address))).expect("it answers");
    assert!(
        said.contains("tracking") && said.contains("settings: of this rig"),
        "{said}"
    );
    let said = tell(BoardOrder::Stop(at(&address))).expect("it answers");
    assert!(said.contains("idle"), "{said}");
    let said = tell(BoardOrder::Acknowledge(at(&address))).expect("it answers");
    assert!(said.contains("no fault to acknowledge"), "{said}");
    let mut hasty = to(&address, 60.0);
    hasty.seconds = 0.1;
    let line = tell(BoardOrder::Move(hasty)).expect_err("it needs longer");
    assert!(line.contains("not there after 0.1 s"), "{line}");
    thread.join().expect("it ends well");
}

#[test]
fn prop_a_fault_is_told_with_its_remedy_until_it_is_acknowledged() {
    let (address, thread) = twin(5);
    let mut port = Port::open(&address, 0).expect("it listens");
    let order = Order::Inject(Fault::DacMismatch.at(1));
    port.send(&link::order(order)).expect("it listens");
    let soon = Instant::now() + Duration::from_millis(100);
    while port.receive(soon).expect("it is there").is_some() {}
    drop(port);
    let said = tell(BoardOrder::Status(at(&address))).expect("it answers");
    for words in [
        "in fault",
        "DAC",
        "(voltage)",
        "pneuma board acknowledge",
        "1 faults",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let line = tell(BoardOrder::Move(to(&address, 10.0))).expect_err("it is in fault");
    assert!(
        line.contains("(voltage)") && line.contains("pneuma board acknowledge"),
        "{line}"
    );
    let said = tell(BoardOrder::Acknowledge(at(&address))).expect("it obeys");
    assert!(said.contains("acknowledged; idle"), "{said}");
    tell(BoardOrder::Move(to(&address, 10.0))).expect("it moves again");
    thread.join().expect("it ends well");
}

#[test]
fn prop_a_place_out_of_reach_is_refused_before_anything_moves() {
    let paper = std::fs::read_to_string(rig_file()).expect("it is there");
    let short = paper.replace("stroke_m = 0.5 ", "stroke_m = 0.4 ");
    let rig = Rig::parse(&short, "short.toml").expect("it is a rig");
    let (address, thread) = twin_of(&rig, 3);
    let line = tell(BoardOrder::Move(to(&address, 300.0))).expect_err("no such place");
    assert!(
        line.contains("300 mm") && line.contains("-250 to 250"),
        "{line}"
    );
    // Within the converter's scale, beyond the stroke: the board's judgement.
    let wish = BoardOrder::Move(to(&address, 230.0));
    let line = tell(wish).expect_err("beyond the stroke");
    assert!(line.contains("stroke"), "{line}");
    let said = tell(BoardOrder::Status(at(&address))).expect("it answers");
    assert!(said.contains("in fault"), "{said}");
    thread.join().expect("it ends well");
}

#[test]
fn prop_the_twin_takes_settings_and_is_recorded() {
    let (address, thread) = twin(2);
    let arguments = SettingsArguments {
        rig: Some(rig_file()),
        show: None,
        out: None,
        into: None,
        serial: Some(address.clone()),
        baud: 0,
        try_out: false,
        wiring_checked: true,
    };
    settings(&arguments, &mut Vec::new()).expect("it is at rest");
    let arguments = RecordArguments {
        serial: address,
        rig: rig_file(),
        out: Path::new(env!("CARGO_TARGET_TMPDIR")).join("twin.csv"),
        seconds: Some(1.0),
        decimate: 5,
        strict: true,
        baud: 0,
    };
    let mut out = Vec::new();
    record(&arguments, &mut out).expect("nothing is lost");
    let said = String::from_utf8(out).expect("it is text");
    assert!(said.contains("nothing was lost"), "{said}");
    thread.join().expect("it ends well");
}

#[test]
fn prop_the_controller_at_a_link_tells_its_status() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener.local_addr().expect("it has one").to_string();
    drop(listener);
    let arguments = ControllerArguments {
        rig: rig_file(),
        listen: address.clone(),
        unchecked: false,
    };
    let thread = std::thread::spawn(move || {
        controller(&arguments, &mut Vec::new()).map_err(|error| error.to_string())
    });
    let said = tell(BoardOrder::Status(at(&address))).expect("it answers");
    assert!(said.contains("starting"), "{said}");
    let gone = thread.join().expect("it ends well");
    assert!(gone.is_err_and(|line| line.contains("went away after 0 ticks")));
}

fn doctor(serial: &str, rig: Option<PathBuf>, folder: &str) -> (String, bool) {
    let arguments = DoctorArguments {
        rig,
        serial: Some(serial.into()),
        baud: 0,
        folder: folder.into(),
    };
    let mut out = Vec::new();
    let outcome = see_a_doctor(&arguments, &mut out);
    let said = String::from_utf8(out).expect("it is text");
    println!("{said}{outcome:?}");
    (said, outcome.is_ok())
}

/// A port without a board, a folder that is none and a rig with a fault each stand in the way and are
/// said with what to do; a board that is well is said to be.
#[test]
fn val_a_doctor_tells_what_stands_in_the_way() {
    let (address, thread) = twin(1);
    let here = std::env::temp_dir().display().to_string();
    let (said, is_well) = doctor(&address, Some(rig_file()), &here);
    assert!(is_well && !said.contains("WRONG"));
    for what in ["folder", "rig ", "board", "state", "line"] {
        assert!(
            said.lines()
                .any(|line| line.starts_with("ok") && line.contains(what)),
            "{what}"
        );
    }
    thread.join().expect("it ends");

    let (said, is_well) = doctor(&address, None, "/no/such/folder");
    assert!(!is_well);
    let wrong: Vec<&str> = said
        .lines()
        .filter(|line| line.starts_with("WRONG"))
        .collect();
    assert_eq!(wrong.len(), 2, "{said}");
    assert!(wrong[0].contains("expected a folder") && wrong[1].contains("dialout"));

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rig.toml");
    let text = std::fs::read_to_string(rig_file()).expect("a rig");
    std::fs::write(&path, text.replacen("stroke_m", "strok_m", 1)).expect("it is written");
    let (said, is_well) = doctor(&address, Some(path), &here);
    assert!(!is_well && said.contains("strok_m"), "{said}");
}
