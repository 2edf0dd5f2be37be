//! A board at the other end of a TCP connection: the firmware's own transfer and
//! telemetry in a thread, behind a wire that loses and damages frames.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;

use firmware::codes::{AdcCodes, DacCode};
use firmware::frame::{Decoder, Received, encode};
use firmware::settings::Settings;
use firmware::settings::record::decode;
use firmware::settings::slots::{LEAST_SLOT_BYTES, Slots};
use firmware::settings::transfer::Transfer;
use firmware::telemetry::{Streaming, Tap, read_stream, streaming, tick as tick_payload};
use firmware::tick::NotAtRest;
use firmware::tick::{Command, Sample, State};
use host_sim::board::twin::MemorySlots;
use host_sim::cli::record::{RecordArguments, run as record};
use host_sim::cli::settings::{SettingsArguments, run as settings};
use host_sim::recording::Recording;
use host_sim::rig::Rig;
use model_core::controller::{Controller, Estimate};
use model_core::reference::Reference;

const DT_S: f32 = 1e-3;
const TICK_PERIOD_NS: u32 = 1_000_000;

/// What the wire does to the n-th frame from the board.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    Arrives,
    IsLost,
    IsDamaged,
}

struct Wire {
    stream: TcpStream,
    frames: usize,
    fate: fn(usize) -> Fate,
}

impl Wire {
    fn send(&mut self, payload: &[u8]) -> std::io::Result<()> {
        let mut frame = encode(payload).expect("it fits");
        let fate = (self.fate)(self.frames);
        self.frames += 1;
        match fate {
            Fate::Arrives => {}
            Fate::IsLost => return Ok(()),
            Fate::IsDamaged => frame[3] ^= 0x40,
        }
        self.stream.write_all(&frame)
    }
}

/// Waits for one host and serves it until it hangs up.
fn board<T: Send + 'static>(
    serve: impl FnOnce(TcpStream) -> T + Send + 'static,
) -> (String, JoinHandle<T>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener
        .local_addr()
        .expect("it has an address")
        .to_string();
    let thread = std::thread::spawn(move || {
        let (stream, _) = listener.accept().expect("a host connects");
        serve(stream)
    });
    (address, thread)
}

/// The frames from the host, as they come, until it hangs up.
fn from_host(mut stream: TcpStream, mut take: impl FnMut(&[u8])) {
    let mut decoder = Decoder::new();
    let mut bytes = [0; 512];
    while let Ok(count @ 1..) = stream.read(&mut bytes) {
        for byte in &bytes[..count] {
            if let Received::Payload(payload) = decoder.feed(*byte) {
                take(payload);
            }
        }
    }
}

fn rig_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("rigs")
        .join(name)
}

fn out_folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
    std::fs::create_dir_all(&folder).expect("it can be made");
    folder
}

// settings

struct Settled {
    in_use: Option<Controller<f32>>,
    slots: [[u8; LEAST_SLOT_BYTES]; 2],
}

/// A board that takes settings, at rest or not.
fn settings_board(at_rest: bool, fate: fn(usize) -> Fate) -> (String, JoinHandle<Settled>) {
    board(move |stream| {
        let mut wire = Wire {
            stream: stream.try_clone().expect("it can be cloned"),
            frames: 0,
            fate,
        };
        let memory = MemorySlots::blank();
        let (mut slots, _) = Slots::start(memory);
        let mut transfer = Transfer::new(DT_S);
        let mut in_use = None;
        from_host(stream, |payload| {
            let answer = transfer.serve(payload, &mut slots, |controller, _| {
                if at_rest {
                    in_use = Some(controller);
                    Ok(())
                } else {
                    Err(NotAtRest)
                }
            });
            wire.send(&answer.expect("it is about settings"))
                .expect("the host listens");
        });
        Settled {
            in_use,
            slots: slots.into_storage().0,
        }
    })
}

fn send_paper(address: &str) -> (Result<(), String>, String) {
    let arguments = SettingsArguments {
        rig: Some(rig_file("paper.toml")),
        show: None,
        out: None,
        into: None,
        serial: Some(address.into()),
        baud: 0,
        try_out: false,
        wiring_checked: false,
    };
    let mut out = Vec::new();
    let outcome = settings(&arguments, &mut out).map_err(|error| error.to_string());
    (outcome, String::from_utf8(out).expect("it is text"))
}

fn paper_settings() -> Settings {
    let rig = Rig::read(rig_file("paper.toml")).expect("it is a rig");
    host_sim::settings::settings(&rig).expect("it makes settings")
}

#[test]
fn prop_settings_reach_a_board_over_a_bad_wire() {
    let wires: [fn(usize) -> Fate; 3] = [
        |_| Fate::Arrives,
        |frame| {
            if frame % 2 == 0 {
                Fate::IsLost
            } else {
                Fate::Arrives
            }
        },
        |frame| {
            if frame % 3 == 1 {
                Fate::IsDamaged
            } else {
                Fate::Arrives
            }
        },
    ];
    for fate in wires {
        let (address, thread) = settings_board(true, fate);
        let (outcome, said) = send_paper(&address);
        assert_eq!(outcome, Ok(()));
        assert!(said.contains("in use and stored"), "{said}");
        let board = thread.join().expect("it ends well");
        let expected = paper_settings();
        assert_eq!(board.in_use, expected.try_build(DT_S).ok());
        let stored = decode(&board.slots[0]).expect("it is a record");
        assert_eq!(stored.settings, expected);
    }
}

#[test]
fn prop_a_moving_axis_keeps_its_settings() {
    let (address, thread) = settings_board(false, |_| Fate::Arrives);
    let (outcome, said) = send_paper(&address);
    let line = outcome.expect_err("it moves");
    assert!(line.contains("the axis is not at rest"), "{line}");
    assert!(!line.contains('\n') && said.is_empty());
    let board = thread.join().expect("it ends well");
    assert_eq!(board.in_use, None);
    assert!(board.slots.iter().flatten().all(|byte| *byte == 0xFF));
}

#[test]
fn prop_a_silent_board_is_said_to_be_silent() {
    let (address, thread) = settings_board(true, |_| Fate::IsLost);
    let (outcome, _) = send_paper(&address);
    let line = outcome.expect_err("nobody answers");
    assert!(line.contains("does not answer"), "{line}");
    thread.join().expect("it ends well");
}

#[test]
fn prop_a_settings_file_is_a_slot_and_shows_its_rig() {
    let path = out_folder("settings_file").join("settings.bin");
    let mut arguments = SettingsArguments {
        rig: Some(rig_file("paper.toml")),
        show: None,
        out: Some(path.clone()),
        into: None,
        serial: None,
        baud: 0,
        try_out: false,
        wiring_checked: false,
    };
    let mut out = Vec::new();
    settings(&arguments, &mut out).expect("it is written");
    let bytes = std::fs::read(&path).expect("it is there");
    let mut memory = MemorySlots::blank();
    memory.0[0][..bytes.len()].copy_from_slice(&bytes);
    let (_, start) = Slots::start(memory);
    assert!(start.origin.is_of_this_rig());
    assert_eq!(start.settings, paper_settings());

    arguments = SettingsArguments {
        rig: None,
        show: Some(path.clone()),
        out: None,
        ..arguments
    };
    let mut out = Vec::new();
    settings(&arguments, &mut out).expect("it can be shown");
    let shown = String::from_utf8(out).expect("it is text");
    assert!(shown.contains("carriage.mass_kg = 2\n"), "{shown}");
    assert!(shown.contains("a board accepts them"), "{shown}");

    let mut damaged = bytes;
    damaged[40] ^= 1;
    std::fs::write(&path, damaged).expect("it can be written");
    let line = settings(&arguments, &mut Vec::new()).expect_err("it is damaged");
    assert!(line.to_string().contains("the CRC does not hold"), "{line}");
}

// telemetry

/// What a board does wrong while it streams.
#[derive(Clone, Copy, Default)]
struct Trouble {
    /// The task that sends sleeps through these ticks.
    sleeps: Option<(u32, u32)>,
    /// These ticks are missed.
    misses: Option<(u32, u32)>,
    /// The conversion of p_a fails at this tick.
    fails_at: Option<u32>,
    /// It is started anew after this tick.
    restarts_after: Option<u32>,
}

fn is_in(range: Option<(u32, u32)>, tick: u32) -> bool {
    range.is_some_and(|(first, end)| (first..end).contains(&tick))
}

/// What the axis does at a tick: codes that tell the tick.
fn at(tick: u32, trouble: Trouble) -> (Sample, Command) {
    let fails = trouble.fails_at == Some(tick);
    let code = (tick % 4096) as u16;
    let pressure_a = if fails { 0xFFFF } else { 32_768 + code };
    let sample = Sample {
        tick,
        codes: AdcCodes::from_array([code, pressure_a, 30_000, 45_875, 32_768]),
        reference: Reference {
            position_m: if tick < 100 { f32::NAN } else { 0.1 },
            velocity_m_per_s: 0.0,
            acceleration_m_per_s2: 0.0,
        },
    };
    let command = Command {
        tick,
        codes: sample.codes,
        valve: DacCode(code * 16),
        state: State::Track,
        fault: 0,
        reference_position_m: f32::NAN,
        estimate: Estimate {
            position_m: 0.0,
            velocity_m_per_s: 0.0,
            friction_n: 0.0,
            disturbance_n: 0.0,
        },
    };
    (sample, command)
}

/// A board that streams so many ticks, then hangs up.
fn streaming_board(ticks: u32, trouble: Trouble, fate: fn(usize) -> Fate) -> String {
    let (address, _) = board(move |stream| {
        let mut wire = Wire {
            stream: stream.try_clone().expect("it can be cloned"),
            frames: 0,
            fate,
        };
        let decimation = asked_for(&stream);
        let what = Streaming {
            decimation,
            tick_period_ns: TICK_PERIOD_NS,
        };
        wire.send(&streaming(what)).expect("the host listens");
        let mut tap = Tap::new(DacCode(0));
        tap.set_decimation(decimation);
        let restart = trouble.restarts_after.unwrap_or(ticks);
        let all = (0..ticks).map(|tick| if tick > restart { tick - restart } else { tick });
        for tick in all {
            if is_in(trouble.misses, tick) {
                continue;
            }
            let (sample, command) = at(tick, trouble);
            tap.offer(&sample, &command);
            if is_in(trouble.sleeps, tick) {
                continue;
            }
            while let Some(record) = tap.take() {
                if wire.send(&tick_payload(&record)).is_err() {
                    return;
                }
            }
        }
    });
    address
}

fn asked_for(stream: &TcpStream) -> u16 {
    let mut stream = stream.try_clone().expect("it can be cloned");
    let mut decoder = Decoder::new();
    let mut byte = [0];
    loop {
        stream.read_exact(&mut byte).expect("the host asks");
        if let Received::Payload(payload) = decoder.feed(byte[0]) {
            return read_stream(payload).expect("it asks for a stream");
        }
    }
}

struct Recorded {
    outcome: Result<(), String>,
    said: String,
    text: String,
    recording: Recording,
    rig: Rig,
}

fn recorded(test: &str, address: String, change: impl FnOnce(&mut RecordArguments)) -> Recorded {
    let path = out_folder(test).join("run.csv");
    let mut arguments = RecordArguments {
        serial: address,
        rig: rig_file("paper.toml"),
        out: path.clone(),
        seconds: None,
        decimate: 1,
        strict: false,
        baud: 0,
    };
    change(&mut arguments);
    let mut out = Vec::new();
    let outcome = record(&arguments, &mut out).map_err(|error| error.to_string());
    let rig = Rig::read(&arguments.rig).expect("it is a rig");
    Recorded {
        outcome,
        said: String::from_utf8(out).expect("it is text"),
        text: std::fs::read_to_string(&path).expect("it is there"),
        recording: Recording::read(&path, &rig.signals).expect("it is a recording"),
        rig,
    }
}

#[test]
fn prop_every_tick_becomes_a_row_with_the_command_in_force() {
    let address = streaming_board(3000, Trouble::default(), |_| Fate::Arrives);
    let run = recorded("whole", address, |arguments| arguments.strict = true);
    assert_eq!(run.outcome, Ok(()));
    assert!(run.said.contains("nothing was lost"), "{}", run.said);
    assert_eq!(run.recording.len(), 3000);
    assert!((run.recording.duration_s() - 2.999).abs() < 1e-9);
    let signal = |name| run.recording.signal(name).expect("it is recorded");
    for row in [1, 77, 2999] {
        let code = row as f64;
        assert!((signal("x")[row] - (-0.25 + 0.5 * code / 65_535.0)).abs() < 1e-7);
        let pascal = 1e6 * (32_768.0 + code) / 65_535.0;
        assert!((signal("p_a")[row] - pascal).abs() < 0.1);
        let volts = 10.0 * 16.0 * (code - 1.0) / 65_535.0;
        assert!((signal("u")[row] - volts).abs() < 1e-6, "row {row}");
    }
}

#[test]
fn prop_no_lost_frame_is_unnoticed() {
    fn fate(frame: usize) -> Fate {
        match frame {
            1000..1100 => Fate::IsLost,
            1500 => Fate::IsDamaged,
            _ => Fate::Arrives,
        }
    }
    let trouble = Trouble {
        // 80 ticks and the one after it offer to 16 places.
        sleeps: Some((400, 480)),
        misses: Some((2000, 2010)),
        fails_at: Some(2500),
        ..Trouble::default()
    };
    let address = streaming_board(3000, trouble, fate);
    let run = recorded("lossy", address, |_| {});
    assert_eq!(run.outcome, Ok(()), "a loss is no error unless asked");
    for part in [
        "65 lost on the board",
        "101 lost on the wire",
        "10 ticks missed by the board",
        "1 failed conversions",
        "1 damaged frames",
        "177 rows missing in 5 gaps",
    ] {
        assert!(run.said.contains(part), "{part}: {}", run.said);
    }
    assert_eq!(run.recording.len(), 3000 - 177);
    let comments = run.text.lines().filter(|line| line.starts_with('#'));
    assert_eq!(comments.count(), 5);
    let inspection = diagnosis::inspect::inspect(&run.rig, &run.recording);
    let shown = inspection.to_string();
    assert!(shown.contains("3 gaps:"), "{shown}");
}

#[test]
fn prop_a_loss_is_an_error_where_asked() {
    let lossy = streaming_board(500, Trouble::default(), |frame| {
        if frame == 100 {
            Fate::IsLost
        } else {
            Fate::Arrives
        }
    });
    let run = recorded("strict", lossy, |arguments| arguments.strict = true);
    let line = run.outcome.expect_err("a frame was lost");
    assert!(line.contains("1 rows missing"), "{line}");
    assert_eq!(run.recording.len(), 499);
}

#[test]
fn prop_a_board_started_anew_ends_the_recording() {
    let trouble = Trouble {
        restarts_after: Some(600),
        ..Trouble::default()
    };
    let run = recorded(
        "restart",
        streaming_board(900, trouble, |_| Fate::Arrives),
        |_| {},
    );
    assert!(
        run.said.contains("ENDED EARLY: the board restarted"),
        "{}",
        run.said
    );
    assert_eq!(run.recording.len(), 601);
}

#[test]
fn prop_a_decimated_recording_has_every_nth_tick_and_ends_in_time() {
    let address = streaming_board(60_000, Trouble::default(), |_| Fate::Arrives);
    let run = recorded("decimated", address, |arguments| {
        arguments.decimate = 7;
        arguments.seconds = Some(2.0);
    });
    assert!(run.said.contains("nothing was lost"), "{}", run.said);
    assert!((run.recording.duration_s() - 2.002).abs() < 1e-9);
    assert_eq!(run.recording.len(), 287);
}

#[test]
fn prop_a_rig_with_a_signal_that_no_board_measures_is_refused() {
    let text = std::fs::read_to_string(rig_file("paper.toml")).expect("it is there");
    let text = text.replace(
        "[signals]",
        "[signals]\nforce = { column = \"F\", unit = \"N\" }",
    );
    let rig = out_folder("unmeasured").join("rig.toml");
    std::fs::write(&rig, text).expect("it can be written");
    let arguments = RecordArguments {
        serial: "127.0.0.1:1".into(),
        out: out_folder("unmeasured").join("run.csv"),
        rig,
        seconds: None,
        decimate: 1,
        strict: false,
        baud: 0,
    };
    let line = record(&arguments, &mut Vec::new()).expect_err("it is refused");
    assert!(
        line.to_string()
            .contains("signals.force: the board does not measure it"),
        "{line}"
    );
}

#[test]
fn prop_damage_at_random_never_goes_unnoticed() {
    // One frame in 13 lost, one in 17 damaged: whatever is missing is counted.
    fn fate(frame: usize) -> Fate {
        match frame {
            0 => Fate::Arrives,
            frame if frame % 13 == 5 => Fate::IsLost,
            frame if frame % 17 == 3 => Fate::IsDamaged,
            _ => Fate::Arrives,
        }
    }
    // The last frames arrive: what is lost behind them nobody can know.
    let arrived = (1..=4000).filter(|frame| fate(*frame) == Fate::Arrives);
    let last = arrived.clone().max().expect("some arrive");
    let rows = arrived.count();
    let run = recorded(
        "random",
        streaming_board(4000, Trouble::default(), fate),
        |_| {},
    );
    assert_eq!(run.recording.len(), rows);
    let missing = format!("{} rows missing", last - rows);
    assert!(run.said.contains(&missing), "{missing}: {}", run.said);
}
