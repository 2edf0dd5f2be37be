//! The very image that is flashed, on an emulator with modelled registers (`tests/emulator`): its
//! own converters' code runs, keeps the rules of the chip, closes the loop to the byte of the host's
//! twin, and meets every fault of the board as the fault list says.
//!
//! Without the emulator these tests say so and pass; in continuous integration they fail.

use firmware::codes::{AdcCodes, DacCode};
use firmware::control_task::ControlTask;
use firmware::crash;
use firmware::experiment::{Envelope, Step, frames as experiment};
use firmware::link::Payload;
use firmware::settings::{Settings, Wiring, record, transfer};
use firmware::tick::Sample;
use host_sim::closed_loop::{
    Course, DriveError, Driven, RemoteController, Run, control_task, run, transcript,
};
use host_sim::motion::{Limits, Motion, Segment};
use host_sim::plant::{self, EndStop, Plant, PlantSettings};
use host_sim::rig::Rig;
use host_sim::settings::wired;
use model_core::reference::Reference;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use xtask::packages::EMULATOR;
use xtask::qemu::checked_settings;
use xtask::{emulate, image};

/// The image; none where there is no emulator.
fn flashed() -> Option<PathBuf> {
    if let Err(failure) = EMULATOR.need() {
        assert!(std::env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: the emulator of the board: {failure}");
        return None;
    }
    Some(image::build(image::STM32F405).expect("the image builds"))
}

/// What came of a run with these options.
fn outcome(image: &Path, options: &[&str]) -> Value {
    let folder = tempfile::tempdir().expect("a folder");
    let json = folder.path().join("outcome.json");
    let mut emulation = emulate::emulation(image, options);
    let output = emulation.arg("--json").arg(&json).output();
    let output = output.expect("it runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let text = std::fs::read_to_string(&json).unwrap_or_else(|_| panic!("{options:?}: {said}"));
    serde_json::from_str(&text).expect("JSON")
}

fn keeps_the_rules(outcome: &Value, what: &str) {
    let misuses = outcome["misuses"].as_object().expect("a table");
    assert!(misuses.is_empty(), "{what}: {misuses:?}");
    assert_eq!(outcome["damaged_frames"], 0, "{what}");
}

const GIVEN: &str = "valve given to the converter";
const AT_MIDDLE: &str = "valve at the middle of the hardware";

#[test]
fn val_the_image_boots_by_the_rules_and_gives_the_valve_away_last() {
    let Some(image) = flashed() else { return };
    // The position converter may have its supply 15 ms later than the chip.
    for late in ["0", "15e6"] {
        let outcome = outcome(&image, &["--ticks", "120", "--position-ready-ns", late]);
        keeps_the_rules(&outcome, late);
        assert_eq!(outcome["ended"], Value::Null, "{outcome}");
        assert_eq!(outcome["fault"], serde_json::json!([0, 0]), "{outcome}");
        assert_eq!(outcome["valve"], serde_json::json!([GIVEN]));
        let middle = outcome["commands"].as_array().expect("a list");
        assert!(middle.iter().all(|code| *code == 2048), "{middle:?}");
        let first_us = outcome["first_command_us"].as_f64().expect("a time");
        assert!(first_us < 35e3, "{first_us}");
        let longest = outcome["watchdog_longest"].as_f64().expect("a share");
        assert!(longest < 0.6, "{longest}");
    }
}

/// A fault at the registers: what is done, code and detail, and where the valve is in the end.
type Injected = (&'static [&'static str], [u8; 2], &'static str);

const INJECTED: [Injected; 9] = [
    (&["--no-crystal"], [17, 0], GIVEN),
    (&["--no-pll"], [17, 1], GIVEN),
    (&["--reset-flags", "0x24000000"], [16, 0], GIVEN),
    (&["--reset-flags", "0x06000000"], [18, 0], GIVEN),
    (&["--position-open-at", "50"], [1, 0], GIVEN),
    (&["--dma-error-at", "50"], [1, 1], GIVEN),
    (&["--valve-shorted-at", "50"], [15, 1], AT_MIDDLE),
    (&["--lost-trigger", "50"], [9, 1], AT_MIDDLE),
    (&["--lost-transfer", "50"], [9, 1], AT_MIDDLE),
];

#[test]
fn val_faults_at_the_registers_are_said_and_shut_the_valve() {
    let Some(image) = flashed() else { return };
    for (done, fault, valve) in INJECTED {
        let outcome = outcome(&image, &[&["--ticks", "130"], done].concat());
        keeps_the_rules(&outcome, done[0]);
        assert_eq!(
            outcome["fault"],
            serde_json::json!(fault),
            "{done:?}: {outcome}"
        );
        let last = outcome["valve"].as_array().and_then(|all| all.last());
        assert_eq!(last, Some(&Value::from(valve)), "{done:?}");
        let commands = outcome["commands"].as_array().expect("a list");
        assert!(commands.iter().all(|code| *code == 2048), "{done:?}");
    }
}

/// A converter that does not put out the middle never gets the valve; a crystal that stops while
/// the board runs resets it.
#[test]
fn val_a_dead_converter_gets_no_valve_and_a_dead_crystal_resets() {
    let Some(image) = flashed() else { return };
    let dead = outcome(&image, &["--ticks", "60", "--dac-stuck-at", "0"]);
    assert_eq!(dead["fault"], serde_json::json!([15, 0]), "{dead}");
    assert_eq!(dead["valve"], serde_json::json!([]), "{dead}");
    let stopped = outcome(&image, &["--ticks", "130", "--crystal-stops-at", "50"]);
    assert_eq!(stopped["ended"], "the program resets the chip", "{stopped}");
    let last = stopped["valve"].as_array().and_then(|all| all.last());
    assert_eq!(last, Some(&Value::from(AT_MIDDLE)), "{stopped}");
}

#[test]
fn val_the_flash_image_closes_the_loop_to_the_byte_of_its_twin() {
    let segments = [
        Segment::Hold { seconds: 0.2 },
        Segment::Move { to_m: 0.1 },
        Segment::Sine {
            amplitude_m: 0.03,
            frequency_hz: 2.0,
            periods: 2,
        },
    ];
    let motion = Motion::new(0.0, Limits::BRISK, &segments);
    closes_the_loop(&paper(""), &motion, 2_000);
}

/// Gauges of 4 to 20 mA, neither velocity nor supply gauge, and a position the other way round: the
/// converters are given what these put out, and the load arrives where it should be.
#[test]
fn val_the_flash_image_closes_the_loop_with_other_sensors() {
    let sensors = r#"
[board.p_a]
output_mA = [4, 20]
range_Pa = [0, 1.0e6]
sensor = "gauge"
[board.p_b]
output_mA = [4, 20]
range_Pa = [0, 1.0e6]
sensor = "gauge"
[board.p_s]
sensor = "none"
[board.x]
output_V = [10, -10]
range_m = [-0.25, 0.25]
[board.v]
sensor = "none"
"#;
    let segments = [
        Segment::Hold { seconds: 0.2 },
        Segment::Move { to_m: 0.1 },
        Segment::Hold { seconds: 0.2 },
    ];
    let motion = Motion::new(0.0, Limits::BRISK, &segments);
    let Some(run) = closes_the_loop(&paper(sensors), &motion, 800) else {
        return;
    };
    let last = run.rows.last().expect("it runs");
    assert!((last.truth.position_m - 0.1).abs() < 2e-4, "{last:?}");
    assert!(last.error_m().abs() < 1e-4, "{last:?}");
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_the_flash_image_closes_the_loop_for_a_minute() {
    let ticks = 60_000;
    let motion = Motion::mixed().repeated(f64::from(ticks) * PlantSettings::TICK_S);
    closes_the_loop(&paper(""), &motion, ticks);
}

/// The paper's rig with these sensors at the board's terminals.
fn paper(sensors: &str) -> Rig {
    let paper = include_str!("../../host-sim/rigs/paper.toml");
    Rig::parse(&format!("{paper}{sensors}"), "paper.toml").expect("the paper's rig")
}

/// What the converters are given: the voltages of the sensors.
struct AtTerminals(Plant);

impl Driven for AtTerminals {
    fn time_s(&self) -> f64 {
        self.0.time_s()
    }
    fn truth(&self) -> plant::Sample {
        self.0.truth()
    }
    fn sample(&mut self) -> AdcCodes {
        self.0.codes_of_sensors()
    }
    fn advance(&mut self, command: DacCode) -> Result<(), DriveError> {
        self.0.advance(command);
        Ok(())
    }
    fn end_stop(&self) -> Option<EndStop> {
        self.0.end_stop()
    }
}

/// The run; none where there is no emulator. The slots have the settings of the rig, its wiring
/// checked.
fn closes_the_loop(rig: &Rig, motion: &Motion, ticks: u32) -> Option<Run> {
    let image = flashed()?;
    let folder = tempfile::tempdir().expect("a folder");
    let seen = folder.path().join("seen.transcript");
    let settings = wired(rig, Wiring::Checked).expect("it makes settings");
    let slot = folder.path().join("slot.bin");
    std::fs::write(&slot, record::encode(1, &settings).expect("it fits")).expect("room");
    let slot = slot.display().to_string();
    let options = ["--ticks", "1000000", "--plant", "0", "--slots", &slot];
    let mut emulation = emulate::emulation(&image, &options);
    emulation.arg("--transcript").arg(&seen);
    let child = emulation.stdout(Stdio::piped()).spawn();
    let mut child = child.expect("it starts");
    let mut said = BufReader::new(child.stdout.take().expect("it is piped"));
    let mut line = String::new();
    said.read_line(&mut line).expect("it says where it waits");
    let address = line.trim().rsplit(' ').next().expect("an address");
    let stream = TcpStream::connect(address).unwrap_or_else(|error| panic!("{line}: {error}"));

    let course = Course {
        motion: motion.clone(),
        ticks,
    };
    let plant = Plant::new(rig, PlantSettings::at(0.0, 1)).expect("a plant");
    let mut plant = AtTerminals(plant);
    let mut board = RemoteController::greet(stream).expect("the image greets");
    let driven = run(&mut plant, &mut board, &course).expect("a run");
    let line = board.end().expect("the run ends");
    drop(line);
    let mut told = String::new();
    said.read_to_string(&mut told).expect("it says what it saw");
    let status = child.wait().expect("it ends");
    assert!(
        status.success(),
        "a rule of the chip was broken (cargo xtask emulate): {told}"
    );
    assert!(driven.first_fault().is_none());
    let furthest_m = driven.rows.iter().map(|row| row.truth.position_m.abs());
    assert!(furthest_m.fold(0.0, f64::max) > 0.09, "it moves");

    let seen = std::fs::File::open(&seen).expect("the transcript");
    // What the image tells is on the scales of the link, whatever the sensors are.
    let twin = control_task(rig).expect("a controller");
    let replay = transcript::replay(seen, twin).expect("a transcript");
    assert_eq!(replay.differences, 0, "{:?}", replay.first_difference);
    assert!(replay.ticks + 1 >= u64::from(ticks), "{}", replay.ticks);
    Some(driven)
}

/// A crash is kept over the reset that it ends in, says where it was, and leaves the valve shut.
#[test]
fn val_a_crash_is_told_after_the_reset() {
    let Some(image) = flashed() else { return };
    let outcome = outcome(&image, &["--ticks", "130", "--hard-fault-at", "50"]);
    keeps_the_rules(&outcome, "crash");
    assert_eq!(outcome["fault"], serde_json::json!([16, 2]), "{outcome}");
    let digits = outcome["crash"].as_str().expect("it was told");
    let bytes = (0..digits.len()).step_by(2);
    let byte = |at: usize| u8::from_str_radix(&digits[at..at + 2], 16).expect("digits");
    let told: Vec<u8> = bytes.map(byte).collect();
    let crash = crash::read(&told).expect("an answer").expect("a crash");
    assert!((0x0800_0000..0x0810_0000).contains(&crash.pc), "{crash:x?}");
}

/// An experiment on the image's own converter: the codes of the host's twin, from the tick on at
/// which it begins.
#[test]
fn val_an_experiment_drives_the_converter_as_its_twin_does() {
    let Some(image) = flashed() else { return };
    let envelope = Envelope::from_array([-0.2, 0.2, 1.9, 2e4, 9.5e5, 400.0]);
    let opening = |seconds: f32, from_v: f32, to_v: f32| Step::Opening {
        seconds,
        from_v,
        to_v,
    };
    let steps = [
        opening(0.1, 0.0, 0.5),
        opening(0.1, 0.5, -0.5),
        Step::Chirp {
            seconds: 0.1,
            amplitude_v: 0.4,
            from_hz: 10.0,
            to_hz: 30.0,
        },
    ];
    let bytes: Vec<u8> = steps.iter().flat_map(Step::bytes).collect();
    let sent = [
        experiment::guard(&envelope),
        experiment::load(0, &steps).expect("it fits"),
        experiment::run(experiment::crc(&envelope, &bytes)),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("frames").display().to_string();
    std::fs::write(&file, digits_of(&sent)).expect("written");
    let checked = checked_settings().expect("a file");
    let options = ["--ticks", "450", "--send", &file, "--slots", &checked];
    let outcome = outcome(&image, &options);
    keeps_the_rules(&outcome, "experiment");
    assert_eq!(outcome["fault"], serde_json::json!([0, 0]), "{outcome}");
    let commands = outcome["all_commands"].as_array().expect("a list").iter();
    let commands: Vec<u64> = commands
        .map(|code| code.as_u64().expect("a code"))
        .collect();
    let expected = of_twin(&sent, 301);
    assert!(expected.iter().max() > Some(&2200) && expected.iter().min() < Some(&1900));
    let is_there = commands
        .windows(expected.len())
        .any(|part| part == expected);
    assert!(is_there, "{commands:?} has not {expected:?}");
}

/// Codes of the converter that the host's twin writes at rest, once it is told this.
fn of_twin(sent: &[Payload], ticks: u32) -> Vec<u64> {
    let mut task = control_task(&paper("")).expect("a controller");
    let tick = |number: u32, task: &mut ControlTask| {
        let command = task.tick(&Sample {
            tick: number,
            codes: AdcCodes::from_array([32768, 26208, 26208, 39320, 32768]),
            reference: Reference::at(f32::NAN),
        });
        u64::from(command.valve.0 >> 4)
    };
    for number in 1..100 {
        tick(number, &mut task);
    }
    for payload in sent {
        task.serve_experiment(&experiment::read_request(payload).expect("a request"));
    }
    (100..100 + ticks)
        .map(|number| tick(number, &mut task))
        .collect()
}

/// Null of the settings that are in use, of those before them, and of those that are sent, V.
const NULLS_V: [f32; 3] = [5.0, 4.8, 5.2];

/// Settings whose valve has another null.
fn with_null(null_v: f32) -> Settings {
    let paper = include_str!("../../host-sim/rigs/paper.toml");
    let paper = Rig::parse(paper, "paper.toml").expect("the paper's rig");
    let mut settings = host_sim::settings::settings(&paper).expect("settings");
    settings.valve.null_v = null_v;
    settings
}

/// A slot that holds settings.
fn slot(sequence: u32, settings: &Settings) -> Vec<u8> {
    let mut slot = record::encode(sequence, settings)
        .expect("a record")
        .to_vec();
    slot.resize(16 * 1024, 0xFF);
    slot
}

/// The frames that bring settings, a line each.
fn frames(settings: &Settings) -> String {
    let content = record::encode_content(settings).expect("a content");
    let mut frames = vec![transfer::begin(&content)];
    let mut offset = 0;
    while let Some(chunk) = transfer::chunk(&content, offset) {
        frames.push(chunk);
        offset += transfer::LONGEST_CHUNK;
    }
    frames.push(transfer::commit());
    digits_of(&frames)
}

/// Payloads as the emulator reads them.
fn digits_of(payloads: &[Payload]) -> String {
    let digits = |frame: &Payload| frame.iter().map(|byte| format!("{byte:02x}")).collect();
    let lines: Vec<String> = payloads.iter().map(digits).collect();
    lines.join("\n")
}

/// The nearest step of the valve's converter.
fn steps(null_v: f32) -> f64 {
    (f64::from(null_v) / 10.0 * 4095.0).round()
}

/// Power fails at operations of the flash, half-way through each: the next start has the settings
/// of before or those that were sent, whole, and never the oldest ones.
fn power_fails(every: usize) {
    let Some(image) = flashed() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = |name: &str| folder.path().join(name).display().to_string();
    let [in_use, oldest, sent] = NULLS_V.map(with_null);
    let slots = [slot(7, &in_use), slot(6, &oldest)].concat();
    std::fs::write(file("slots"), slots).expect("written");
    std::fs::write(file("frames"), frames(&sent)).expect("written");
    let (slots, frames, after) = (file("slots"), file("frames"), file("after"));
    let base = ["--slots", &slots, "--send", &frames, "--slots-out", &after];
    let started = |what: &str| {
        let outcome = outcome(&image, &["--ticks", "60", "--slots", &after]);
        keeps_the_rules(&outcome, what);
        assert_eq!(
            outcome["fault"],
            serde_json::json!([0, 0]),
            "{what}: {outcome}"
        );
        assert_eq!(outcome["has_built_in_settings"], false, "{what}");
        outcome["commands"][10].as_f64().expect("a code")
    };
    let whole = outcome(&image, &[&base[..], &["--ticks", "200"]].concat());
    keeps_the_rules(&whole, "whole");
    assert!(
        (started("whole") - steps(NULLS_V[2])).abs() <= 1.0,
        "{whole}"
    );
    let operations = whole["flash_operations"].as_u64().expect("a number") as usize;
    assert!(operations > 100, "{operations}");
    for cut in (1..=operations).step_by(every) {
        let cut = cut.to_string();
        let ended = outcome(
            &image,
            &[&base[..], &["--ticks", "200", "--cut-at", &cut]].concat(),
        );
        assert_eq!(ended["ended"], "power is cut", "{cut}");
        let code = started(&cut);
        let is_of = |null_v: f32| (code - steps(null_v)).abs() <= 1.0;
        assert!(
            is_of(NULLS_V[0]) || is_of(NULLS_V[2]),
            "cut at {cut}: {code}"
        );
    }
}

#[test]
fn val_power_that_fails_while_settings_are_stored_leaves_the_old_or_the_new() {
    power_fails(97);
}

#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_power_may_fail_at_every_operation_of_the_flash() {
    power_fails(1);
}
