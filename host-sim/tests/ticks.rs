//! The control task at the ticks that the board can be built for.

use std::path::Path;

use firmware::control_task::ControlTask;
use host_sim::closed_loop::{Course, HostController, judge, run};
use host_sim::motion::{Limits, Motion, Segment};
use host_sim::plant::{Plant, PlantSettings};
use host_sim::rig::Rig;
use host_sim::settings::controller;

/// The controller's marks, docs/control.md: from 0.3 s after a move, m.
const AT_REST_M: f64 = 3e-5;
/// And the largest error of a sine of 60 mm at 1 Hz, m.
const FAST_SINE_M: f64 = 7e-4;

fn paper(lead_s: f64) -> Rig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("rigs/paper.toml");
    let mut rig = Rig::read(path).expect("it is a rig");
    rig.controller.insert("lead_s".into(), lead_s);
    rig
}

fn motion() -> Motion {
    let hold = Segment::Hold { seconds: 1.0 };
    let sine = Segment::Sine {
        amplitude_m: 0.06,
        frequency_hz: 1.0,
        periods: 3,
    };
    let go = |to_m| Segment::Move { to_m };
    let segments = [hold, go(0.06), hold, go(0.0), hold, sine, hold];
    Motion::new(0.0, Limits::BRISK, &segments)
}

#[test]
fn val_the_marks_are_met_at_every_tick_that_a_board_can_have() {
    for ticks_per_s in [1e3, 2e3, 4e3, 8e3] {
        let tick_s = 1.0 / ticks_per_s;
        // Tick, half a tick of hold, and the spool's 2 ms.
        let rig = paper(1.5 * tick_s + 2e-3);
        let task = ControlTask::new(controller(&rig, tick_s).expect("it is a controller"));
        let settings = PlantSettings {
            tick_s,
            steps_per_tick: (5e3 / ticks_per_s).ceil() as u32,
            ..PlantSettings::at(0.0, 1)
        };
        let mut plant = Plant::new(&rig, settings).expect("it is an axis");
        let motion = motion();
        let course = Course::whole(motion.clone(), tick_s);
        let mut drive = HostController::new(task);
        let run = run(&mut plant, &mut drive, &course).expect("it answers");
        let fault = run
            .first_fault()
            .map(|row| (row.truth.time_s, row.command.fault));
        assert_eq!(fault, None, "{ticks_per_s}");
        for judged in judge(&run, &motion) {
            match judged.part.segment {
                Segment::Hold { .. } => {
                    assert!(
                        judged.at_rest_m <= Some(AT_REST_M),
                        "{ticks_per_s} {judged:?}"
                    );
                }
                Segment::Sine { .. } => {
                    assert!(judged.worst_m <= FAST_SINE_M, "{ticks_per_s} {judged:?}");
                }
                Segment::Move { .. } => {}
            }
        }
    }
}
