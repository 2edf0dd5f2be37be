//! The firmware in QEMU answers as the same control code does on the host: the
//! same bytes for the same samples, whatever comes.
//!
//! Without QEMU these tests say so and pass; in continuous integration they fail.

use firmware::codes::AdcCodes;
use firmware::control_task::ControlTask;
use firmware::cost::Report;
use firmware::experiment::{Envelope, Stage, Step, frames};
use firmware::settings::transfer::{self, Verdict};
use firmware::settings::{Settings, Wiring, record};
use firmware::status::Status;
use firmware::tick::{Sample, State};
use firmware::{frame, link, telemetry};
use model_core::reference::Reference;
use std::path::{Path, PathBuf};
use std::time::Duration;
use xtask::plant::{Link, Plant};
use xtask::qemu::Machine;
use xtask::{image, qemu};

/// The same control code with the same settings.
fn host_controller(settings: &Settings) -> ControlTask {
    let controller = settings.try_build(1e-3);
    ControlTask::new(controller.expect("the settings are possible"))
}

/// The samples of a motion that the host has controlled with these settings.
fn motion(settings: &Settings, ticks: u32) -> Vec<Sample> {
    let mut host = host_controller(settings);
    let mut plant = Plant::default();
    let mut samples = Vec::new();
    for _ in 0..ticks {
        let sample = plant.sample();
        samples.push(sample);
        let answer = link::command(&host.tick(&sample));
        plant.apply(&link::read_command(&answer).expect("an answer"));
    }
    samples
}

/// The image, or `None` where nothing can run it.
fn image() -> Option<PathBuf> {
    if let Err(failure) = qemu::need_qemu() {
        assert!(std::env::var_os("CI").is_none(), "{failure}");
        println!("SKIPPED: the firmware in QEMU: {failure}");
        return None;
    }
    Some(image::build(image::MPS2).expect("the image builds"))
}

/// With the built-in settings, for an axis whose wiring was checked.
fn start(image: &Path) -> Machine {
    let checked = qemu::checked_settings().expect("a file");
    Machine::start(image, &qemu::with_settings(&checked)).expect("QEMU starts")
}

/// Sends the samples, and one in so many first as a damaged copy, which must be
/// dropped; holds each answer against the host's.
fn compare(machine: Machine, settings: &Settings, samples: &[Sample], damage_every: u32) -> Report {
    let mut plant_end = Link::connect(&machine).expect("the firmware greets");
    let mut host = host_controller(settings);
    for sample in samples {
        if sample.tick % damage_every == damage_every - 1 {
            let mut damaged = frame::encode(&link::sample(sample)).expect("it fits");
            // Not to nought, which would end the frame and make two of it.
            damaged[5] ^= if damaged[5] == 0x10 { 0x20 } else { 0x10 };
            plant_end.send_bytes(&damaged).expect("it is sent");
        }
        let expected = link::command(&host.tick(sample));
        let answer = plant_end.exchange(sample).expect("it answers");
        assert_eq!(answer[..], expected[..], "tick {}", sample.tick);
    }
    let report = plant_end.end().expect("it tells of itself");
    let status = machine.wait(Duration::from_secs(10)).expect("it ends");
    assert!(status.success(), "{status}");
    report
}

#[test]
fn val_host_and_qemu_answer_alike_in_motion_and_twice() {
    let Some(image) = image() else { return };
    let settings = Settings::built_in();
    let samples = motion(&settings, 5000);
    let moved = |sample: &Sample| (sample.codes.position.0).abs_diff(32_768);
    let furthest = samples.iter().map(moved).max();
    assert!(furthest > Some(5000), "the axis moves: {furthest:?} codes");
    let report = compare(start(&image), &settings, &samples, 500);
    assert_eq!((report.cost.ticks, report.dropped_frames), (5000, 10));
    assert_eq!(report.lost_commands, 0);
    let again = compare(start(&image), &settings, &samples, 500);
    assert_eq!(
        again, report,
        "also the instructions are the same every time"
    );
}

#[test]
fn prop_host_and_qemu_answer_alike_whatever_comes() {
    let Some(image) = image() else { return };
    let mut random = Random(1);
    let samples: Vec<Sample> = (0..3000).map(|tick| random.sample(tick)).collect();
    let report = compare(start(&image), &Settings::built_in(), &samples, 7);
    assert_eq!(report.dropped_frames, 3000 / 7);
}

#[test]
fn val_host_and_qemu_answer_alike_with_the_settings_of_a_rig() {
    let Some(image) = image() else { return };
    let mut settings = Settings::built_in();
    settings.carriage.mass_kg *= 1.5;
    settings.valve.null_v += 0.05;
    settings.controller.position_per_s *= 0.8;
    settings.wiring = Wiring::Checked;
    let samples = motion(&settings, 1500);
    assert_ne!(samples, motion(&Settings::built_in(), 1500));
    let record = record::encode(1, &settings).expect("it fits");
    let file = std::env::temp_dir().join(format!("settings-{}.bin", std::process::id()));
    std::fs::write(&file, &record).expect("it is written");
    let machine = Machine::start(&image, &qemu::with_settings(&file.to_string_lossy()));
    let machine = machine.expect("QEMU starts");
    compare(machine, &settings, &samples, u32::MAX);
    std::fs::remove_file(&file).expect("it was there");
}

/// One answer to one frame.
fn ask(plant_end: &mut Link, payload: &[u8]) -> Vec<u8> {
    plant_end.send(payload).expect("it is sent");
    plant_end.receive().expect("it answers")
}

#[test]
fn val_settings_and_telemetry_travel_beside_the_samples() {
    let Some(image) = image() else { return };
    let machine = start(&image);
    let mut plant_end = Link::connect(&machine).expect("the firmware greets");
    let mut host = host_controller(&Settings::built_in());
    let mut plant = Plant::default();
    let mut step = |plant_end: &mut Link, host: &mut ControlTask| {
        let mut sample = plant.sample();
        sample.reference.position_m = f32::NAN;
        let expected = host.tick(&sample);
        let answer = plant_end.exchange(&sample).expect("it answers");
        assert_eq!(answer[..], link::command(&expected)[..]);
        let command = link::read_command(&answer).expect("a command");
        plant.apply(&command);
        (sample, expected)
    };
    for _ in 0..20 {
        step(&mut plant_end, &mut host);
    }

    let mut settings = Settings::built_in();
    settings.valve.null_v += 0.05;
    let content = record::encode_content(&settings).expect("it fits");
    let chunks = (0..content.len()).step_by(transfer::LONGEST_CHUNK);
    let chunks = chunks.filter_map(|offset| transfer::chunk(&content, offset));
    let frames = [transfer::begin(&content)].into_iter().chain(chunks);
    for frame in frames.chain([transfer::commit()]) {
        let answer = ask(&mut plant_end, &frame);
        let answer = transfer::read_answer(&answer).expect("an answer");
        assert_eq!((answer.kind, answer.verdict), (frame[0], Verdict::Taken));
    }
    let swapped = settings.try_build(1e-3).expect("the settings are possible");
    assert_eq!(
        host.replace_controller(swapped, &settings.connection()),
        Ok(())
    );
    let (_, command) = step(&mut plant_end, &mut host);

    let answer = ask(&mut plant_end, &telemetry::stream(1));
    let streaming = telemetry::read_streaming(&answer).expect("an answer");
    assert_eq!(
        (streaming.decimation, streaming.tick_period_ns),
        (1, 1_000_000)
    );
    let mut in_force = command.valve;
    for sequence in 0..20 {
        let (sample, command) = step(&mut plant_end, &mut host);
        let payload = plant_end.receive().expect("it streams");
        let record = telemetry::read_tick(&payload).expect("a tick");
        assert_eq!((record.sequence, record.overflows), (sequence, 0));
        assert_eq!((record.tick, record.codes), (sample.tick, sample.codes));
        assert_eq!(record.valve_in_force, in_force);
        in_force = command.valve;
    }
    let answer = ask(&mut plant_end, &link::ask_status());
    let status = Status::read(&answer).expect("a status report");
    assert_eq!((status.state, status.finding), (State::Idle, None));
    assert!(!status.has_built_in_settings, "they were replaced");
    assert_eq!(
        status.wiring,
        Wiring::Unchecked,
        "as those that were sent say"
    );
    plant_end.send(&[0x77, 1, 2]).expect("it is sent");
    let report = plant_end.end().expect("it tells of itself");
    assert_eq!(report.dropped_frames, 1, "what nobody wants is counted");
    let status = machine.wait(Duration::from_secs(10)).expect("it ends");
    assert!(status.success(), "{status}");
}

/// Marsaglia's xorshift, 32 bits, shifts 13, 17, 5.
struct Random(u32);

impl Random {
    fn next(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        self.0
    }

    /// Any codes at all; a reference that may be any bits at all.
    fn sample(&mut self, tick: u32) -> Sample {
        let codes = [0; 5].map(|_: u16| (self.next() >> 16) as u16);
        let is_sane = !self.next().is_multiple_of(4);
        let mut value = || {
            let bits = self.next();
            if is_sane {
                (bits as i32 as f32) * 1e-10
            } else {
                f32::from_bits(bits)
            }
        };
        Sample {
            tick,
            codes: AdcCodes::from_array(codes),
            reference: Reference {
                position_m: value(),
                velocity_m_per_s: value(),
                acceleration_m_per_s2: value(),
            },
        }
    }
}

/// The most instructions of a tick, see `cargo xtask size`.
const MOST_INSTRUCTIONS: u64 = 6000;

/// A program of every kind of step: loop, valve, force. The same bytes on host and chip, and no tick
/// dearer than it may be.
#[test]
fn val_an_experiment_runs_in_qemu_as_on_the_host() {
    let Some(image) = image() else { return };
    let envelope = Envelope {
        position_m: [-0.2, 0.2],
        speed_m_per_s: 1.9,
        pressure_pa: [2e4, 9.5e5],
        force_n: 400.0,
    };
    let steps = every_kind_of_step();
    let bytes: Vec<u8> = steps.iter().flat_map(Step::bytes).collect();
    let machine = start(&image);
    let mut end = Experimented {
        link: Link::connect(&machine).expect("the firmware greets"),
        host: host_controller(&Settings::built_in()),
        plant: Plant::default(),
        codes: Vec::new(),
    };
    end.goes_on(100);
    end.asks(&frames::guard(&envelope));
    end.asks(&frames::load(0, &steps).expect("it fits"));
    let begun = end.asks(&frames::run(frames::crc(&envelope, &bytes)));
    assert_eq!(begun.stage, Stage::Running, "{begun:?}");
    let mut report = begun;
    while report.stage == Stage::Running {
        end.goes_on(100);
        report = end.asks(&frames::alive());
    }
    assert_eq!(report.stage, Stage::Done, "{report:?}");
    let travelled = end.codes.iter().max().zip(end.codes.iter().min());
    let (most, least) = travelled.expect("ticks");
    assert!(
        most - least > 5000,
        "the valve was opened: {least} to {most}"
    );
    let cost = end.link.end().expect("it tells of itself");
    let per_count = 1_000_000_000 / u64::from(cost.counts_per_s);
    let worst = u64::from(cost.cost.worst_counts) * per_count;
    println!("{worst} instructions at the most");
    assert!(worst <= MOST_INSTRUCTIONS, "{worst} instructions");
    let status = machine.wait(Duration::from_secs(10)).expect("it ends");
    assert!(status.success(), "{status}");
}

/// What a wave costs: instructions beyond those of a valve held open, in the mean of the ticks of 2 s.
#[test]
#[ignore = "long: cargo xtask test --all"]
fn val_waves_of_the_excitation_cost_little() {
    let Some(image) = image() else { return };
    let seconds = 2.0;
    let held = Step::Opening {
        seconds,
        from_v: 0.0,
        to_v: 0.0,
    };
    let chirp = Step::Chirp {
        seconds,
        amplitude_v: 0.4,
        from_hz: 10.0,
        to_hz: 30.0,
    };
    let multisine = Step::Multisine {
        seconds,
        rms_v: 0.3,
        base_hz: 2.0,
    };
    let [held, chirp, multisine] = [held, chirp, multisine].map(|step| mean_of(&image, step));
    let [chirp, multisine] = [chirp, multisine].map(|mean| mean.saturating_sub(held));
    println!("instructions a tick: chirp {chirp}, multisine {multisine}");
    assert!(chirp < 200 && multisine < 600, "{chirp} {multisine}");
}

/// Mean instructions a tick while a board runs this step alone, and at rest before it.
fn mean_of(image: &Path, step: Step) -> u64 {
    let machine = start(image);
    let mut end = Experimented {
        link: Link::connect(&machine).expect("the firmware greets"),
        host: host_controller(&Settings::built_in()),
        plant: Plant::default(),
        codes: Vec::new(),
    };
    let envelope = Envelope::from_array([-0.2, 0.2, 1.9, 2e4, 9.5e5, 400.0]);
    end.goes_on(20);
    end.asks(&frames::guard(&envelope));
    end.asks(&frames::load(0, &[step]).expect("it fits"));
    end.asks(&frames::run(frames::crc(&envelope, &step.bytes())));
    for _ in 0..20 {
        end.goes_on(100);
        end.asks(&frames::alive());
    }
    let report = end.link.end().expect("it tells of itself");
    let counted_ticks = u64::from(report.counts_per_s) * u64::from(report.cost.ticks);
    report.cost.total_counts * 1_000_000_000 / counted_ticks
}

fn every_kind_of_step() -> [Step; 8] {
    let seconds = 0.5;
    [
        Step::Move {
            seconds,
            to_m: 0.02,
        },
        Step::Hold { seconds },
        Step::Sine {
            seconds: 2.0,
            amplitude_m: 0.02,
            frequency_hz: 1.0,
        },
        Step::Opening {
            seconds,
            from_v: -0.4,
            to_v: 0.4,
        },
        Step::Chirp {
            seconds,
            amplitude_v: 0.5,
            from_hz: 4.0,
            to_hz: 12.0,
        },
        Step::Multisine {
            seconds,
            rms_v: 0.3,
            base_hz: 2.0,
        },
        Step::Bursts {
            seconds,
            amplitude_v: 0.6,
            shortest_s: 0.02,
            longest_s: 0.05,
        },
        Step::Force {
            seconds,
            force_n: 20.0,
        },
    ]
}

/// Firmware and host before the same plant, both asked the same.
struct Experimented {
    link: Link,
    host: ControlTask,
    plant: Plant,
    codes: Vec<u16>,
}

impl Experimented {
    /// Ticks without a reference of the plant's.
    fn goes_on(&mut self, ticks: u32) {
        for _ in 0..ticks {
            let sample = Sample {
                reference: Reference::at(f32::NAN),
                ..self.plant.sample()
            };
            let expected = link::command(&self.host.tick(&sample));
            let answer = self.link.exchange(&sample).expect("it answers");
            assert_eq!(answer[..], expected[..], "tick {}", sample.tick);
            let command = link::read_command(&answer).expect("a command");
            self.codes.push(command.valve.0);
            self.plant.apply(&command);
        }
    }

    /// What both report, the same.
    fn asks(&mut self, payload: &[u8]) -> frames::Report {
        self.link.send(payload).expect("it is sent");
        let answer = self.link.receive().expect("it answers");
        let request = frames::read_request(payload).expect("a request");
        let expected = self.host.serve_experiment(&request).payload();
        assert_eq!(answer[..], expected[..]);
        frames::Report::read(&answer).expect("a report")
    }
}
