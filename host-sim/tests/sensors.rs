//! Sensors of other ranges, kinds and signs at a board's terminals, and sensors that are not there.

use std::path::Path;

use firmware::codes::{AdcCode, ValveConverter};
use firmware::control_task::ControlTask;
use firmware::fault::{Channel, Fault};
use firmware::settings::Wiring;
use firmware::tick::{Sample, State};
use host_sim::closed_loop::{Course, HostController, Run, control_task, judge, run};
use host_sim::motion::{Limits, Motion, Segment};
use host_sim::plant::{Plant, PlantSettings};
use host_sim::rig::Rig;
use host_sim::settings::{connection, controller};
use model_core::reference::Reference;

const GAUGE: &str = "sensor = \"gauge\"\noutput_mA = [4, 20]\nrange_Pa = [0, 1.0e6]\n";
const NONE: &str = "sensor = \"none\"\n";

/// The paper's axis with these sensors at the terminals.
fn paper(sensors: &[(&str, &str)]) -> Rig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/paper.toml");
    let mut text = std::fs::read_to_string(path).expect("it is there");
    for (signal, keys) in sensors {
        text += &format!("\n[board.{signal}]\n{keys}");
    }
    Rig::parse(&text, "paper.toml").expect("it is a rig")
}

fn motion() -> Motion {
    let hold = Segment::Hold { seconds: 1.0 };
    let sine = Segment::Sine {
        amplitude_m: 0.06,
        frequency_hz: 0.5,
        periods: 2,
    };
    let go = |to_m| Segment::Move { to_m };
    let segments = [hold, go(0.06), hold, go(0.0), hold, sine, hold];
    Motion::new(0.0, Limits::BRISK, &segments)
}

fn driven(rig: &Rig) -> Run {
    let mut plant = Plant::new(rig, PlantSettings::at(0.0, 1)).expect("it is an axis");
    let mut drive = HostController::new(control_task(rig).expect("it is a controller"));
    let course = Course::whole(motion(), PlantSettings::TICK_S);
    run(&mut plant, &mut drive, &course).expect("it answers")
}

/// Largest error at rest, from 0.3 s after a move, and rms error of the sine, m.
fn errors_m(run: &Run) -> [f64; 2] {
    let (mut at_rest_m, mut tracking_m) = (0.0_f64, 0.0_f64);
    for judged in judge(run, &motion()) {
        match judged.part.segment {
            Segment::Hold { .. } => at_rest_m = at_rest_m.max(judged.at_rest_m.unwrap_or(0.0)),
            Segment::Sine { .. } => tracking_m = judged.rms_m,
            _ => {}
        }
    }
    [at_rest_m, tracking_m]
}

#[test]
fn val_an_axis_is_positioned_with_the_sensors_that_it_has() {
    let reversed = "output_V = [0, 10]\nrange_m = [0.25, -0.25]\n";
    let live_zero = "output_V = [1, 5]\nrange_Pa = [0, 1.0e6]\n";
    let gauges = [("p_a", GAUGE), ("p_b", GAUGE), ("p_s", GAUGE)];
    let [_, standard_m] = errors_m(&driven(&paper(&[])));
    for (name, sensors, most) in [
        ("4 to 20 mA, gauge", &gauges[..], 1.2),
        ("1 to 5 V", &[("p_a", live_zero), ("p_b", live_zero)], 1.2),
        ("position the other way round", &[("x", reversed)], 1.2),
        ("no supply gauge", &[("p_s", NONE)], 1.2),
        // The velocity of 2 ms ago.
        ("no velocity", &[("v", NONE)], 2.5),
        (
            "neither",
            &[("v", NONE), ("p_s", NONE), ("p_a", GAUGE)],
            2.5,
        ),
    ] {
        let run = driven(&paper(sensors));
        let fault = run.first_fault().map(|row| row.command.fault);
        assert_eq!(fault, None, "{name}");
        let [at_rest_m, sine_m] = errors_m(&run);
        let (at_rest_mm, sine_mm, standard_mm) = (1e3 * at_rest_m, 1e3 * sine_m, 1e3 * standard_m);
        println!("{name}: {at_rest_mm:.3} mm at rest, sine {sine_mm:.3} of {standard_mm:.3} mm");
        assert!(at_rest_m < 3e-5, "{name}: {at_rest_m}");
        assert!(sine_m < most * standard_m, "{name}: {sine_m}");
    }
}

#[test]
fn prop_a_board_makes_of_its_own_codes_what_the_link_carries() {
    let rig = paper(&[("p_a", GAUGE), ("p_b", GAUGE), ("p_s", NONE), ("v", NONE)]);
    let dt_s = PlantSettings::TICK_S;
    let plant = || Plant::new(&rig, PlantSettings::at(0.0, 3)).expect("it is an axis");
    let (mut behind_link, mut at_terminals) = (plant(), plant());
    let mut linked = control_task(&rig).expect("it is a controller");
    let mut board = ControlTask::of(
        controller(&rig, dt_s).expect("it is a controller"),
        &connection(&rig, Wiring::Checked).expect("it has sensors"),
        ValveConverter::TwelveBits,
    );
    let motion = motion();
    for tick in 0..3000 {
        let reference = motion.at(f64::from(tick) * dt_s);
        let reference = Reference {
            position_m: reference.position_m as f32,
            velocity_m_per_s: reference.velocity_m_per_s as f32,
            acceleration_m_per_s2: reference.acceleration_m_per_s2 as f32,
        };
        let sample = |codes| Sample {
            tick,
            codes,
            reference,
        };
        let told = linked.tick(&sample(behind_link.sample()));
        let own = board.tick(&sample(at_terminals.codes_of_sensors()));
        assert_eq!(own, told, "tick {tick}");
        behind_link.advance(told.valve);
        at_terminals.advance(own.valve);
    }
}

#[test]
fn prop_a_wire_that_breaks_is_a_fault_of_its_sensor() {
    let velocity = "output_V = [1, 9]\nrange_m_s = [-2, 2]\n";
    let rig = paper(&[
        ("p_a", GAUGE),
        ("p_b", GAUGE),
        ("p_s", GAUGE),
        ("v", velocity),
    ]);
    for channel in [
        Channel::PressureA,
        Channel::PressureB,
        Channel::SupplyPressure,
        Channel::Velocity,
    ] {
        let mut plant = Plant::new(&rig, PlantSettings::at(0.0, 3)).expect("it is an axis");
        let mut board = ControlTask::of(
            controller(&rig, PlantSettings::TICK_S).expect("it is a controller"),
            &connection(&rig, Wiring::Checked).expect("it has sensors"),
            ValveConverter::TwelveBits,
        );
        for tick in 0..400 {
            let mut codes = plant.codes_of_sensors();
            // No voltage: the bottom of the pressures' inputs, the middle of the velocity's.
            if tick >= 300 {
                match channel {
                    Channel::PressureA => codes.pressure_a = AdcCode(0),
                    Channel::PressureB => codes.pressure_b = AdcCode(0),
                    Channel::SupplyPressure => codes.supply_pressure = AdcCode(0),
                    Channel::Velocity => codes.velocity = AdcCode(32_768),
                    Channel::Position => {}
                }
            }
            let reference = Reference {
                position_m: 0.0,
                velocity_m_per_s: 0.0,
                acceleration_m_per_s2: 0.0,
            };
            let command = board.tick(&Sample {
                tick,
                codes,
                reference,
            });
            plant.advance(command.valve);
            let expected = if tick < 300 {
                0
            } else {
                Fault::OutOfRange.code()
            };
            assert_eq!(command.fault, expected, "{channel:?} at {tick}");
            assert_eq!(command.state == State::Fault, tick >= 300);
        }
    }
}
