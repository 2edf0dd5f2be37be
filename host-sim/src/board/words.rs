//! A status report in words: the state, the fault with its cause and what to do,
//! why the board started, what it has counted.

use crate::report::number;
use firmware::crash::Crash;
use firmware::fault::{DESCRIPTIONS, Description, Fault, Finding};
use firmware::settings::Wiring;
use firmware::start::ResetCause;
use firmware::status::Status;
use firmware::tick::State;

/// What people should know of a fault.
pub fn description(fault: Fault) -> Option<&'static Description> {
    DESCRIPTIONS
        .iter()
        .find(|description| description.fault == fault)
}

/// A fault in one line: its name, where it was seen and what to do.
pub fn fault_line(finding: Finding) -> String {
    let code = finding.fault.code();
    match description(finding.fault) {
        Some(known) => format!(
            "fault {code}, {}{}: {}{}",
            known.name,
            detail(known, finding.detail),
            known.remedy,
            way_out(finding.fault)
        ),
        None => format!("fault {code}, detail {}", finding.detail),
    }
}

/// In brackets the part of the list of details that this one stands for, or its
/// number and what it counts; nothing for faults without a detail.
fn detail(known: &Description, detail: u8) -> String {
    if known.detail == "0" {
        return String::new();
    }
    let list = known
        .detail
        .strip_prefix("channel: ")
        .unwrap_or(known.detail);
    let entries = list.split(", ");
    let named = entries.filter_map(|entry| entry.split_once(' '));
    for (number, name) in named {
        if number.parse() == Ok(detail) {
            return format!(" ({name})");
        }
    }
    format!(" ({detail}: {})", known.detail)
}

fn way_out(fault: Fault) -> &'static str {
    if fault.is_standing() && !fault.ends_with_settings() {
        "; a fault can be acknowledged only after a restart of the board"
    } else {
        "; then `pneuma board acknowledge`"
    }
}

/// The state in words.
pub fn state(state: State) -> &'static str {
    match state {
        State::Init => "starting: the observer settles, the valve is at its null",
        State::Idle => "idle: axis released, valve at its null",
        State::Track => "tracking: the load follows the reference",
        State::Fault => "in fault: the valve is at its null",
        State::Open => "experiment: valve or force as its program says",
    }
}

fn cause(cause: ResetCause) -> &'static str {
    match cause {
        ResetCause::Unknown => "cause unknown",
        ResetCause::PowerOn => "power came",
        ResetCause::BrownOut => "its supply had dipped",
        ResetCause::Pin => "somebody pressed reset",
        ResetCause::Software => "requested by the application",
        ResetCause::Watchdog => "the watchdog was not fed",
    }
}

/// Where the program crashed, in one line.
pub fn crash_line(crash: &Crash) -> String {
    if crash.line > 0 {
        return format!(
            "the program crashed since power came: panic at {}, line {}; report it",
            crash.file(),
            crash.line
        );
    }
    format!(
        "the program crashed since power came: exception of the processor, PC {:08x}, LR {:08x}, CFSR {:08x}; report it",
        crash.pc, crash.lr, crash.cfsr
    )
}

/// The whole report, a line each.
pub fn lines(status: &Status) -> Vec<String> {
    let mut lines = vec![state(status.state).to_owned()];
    if let Some(finding) = status.finding {
        lines.push(fault_line(finding));
        if let Some(known) = description(finding.fault) {
            lines.push(format!(
                "seen at tick {}: {}",
                status.fault_tick, known.seen
            ));
        }
    }
    lines.push(format!("started because {}", cause(status.reset_cause)));
    lines.push(if status.has_built_in_settings {
        "settings: built in, of no rig: send this rig's with `pneuma settings`".to_owned()
    } else {
        "settings: of this rig".to_owned()
    });
    lines.push(match status.wiring {
        Wiring::Checked => "wiring: checked".to_owned(),
        Wiring::Unchecked => {
            "wiring: unchecked, the axis follows no set-point: `pneuma board check-wiring`"
                .to_owned()
        }
    });
    lines.extend(program(status));
    let counted = &status.counters;
    lines.push(format!(
        "since then: {} faults, {} frames dropped, {} samples missed, {} repeated, {} overruns",
        counted.faults,
        counted.dropped_frames,
        counted.missed_ticks,
        counted.repeated_ticks,
        counted.overruns
    ));
    if status.calmed > 0 {
        lines.push(format!(
            "the loop swung and was calmed {} times: the axis answers later than the settings say; record it, `pneuma diagnose` names a lagging gauge or tubes",
            status.calmed
        ));
    }
    lines
}

/// Which program a board runs, and what a tick costs there; none of a status that does not say.
pub fn program(status: &Status) -> Option<String> {
    let (program, cost) = (&status.program, &status.tick_cost);
    let [major, minor, patch] = program.version;
    let us = |tenths: u16| number::fixed(f64::from(tenths) / 10.0, 1);
    let commit = match program.commit {
        0 => String::new(),
        commit => format!(", commit {commit:08x}"),
    };
    let ticks = match cost.worst_100ns {
        0 => String::new(),
        worst => format!(
            "; a tick takes {} us in the mean, {} us at the most",
            us(cost.mean_100ns),
            us(worst)
        ),
    };
    let is_known = program.version != [0; 3] || program.commit != 0;
    is_known.then(|| format!("firmware {major}.{minor}.{patch}{commit}{ticks}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::fault::Channel;

    #[test]
    fn val_a_board_says_its_program_and_what_a_tick_costs() {
        let mut status = firmware::control_task::ControlTask::new(
            crate::closed_loop::controller(
                &crate::rig::Rig::read("rigs/paper.toml").expect("a rig"),
            )
            .expect("an axis"),
        )
        .status(firmware::start::ResetCause::PowerOn, false);
        assert_eq!(program(&status), None);
        status.program = firmware::status::Program::of(["0", "1", "2"], Some("8a952d0f"));
        status.tick_cost.mean_100ns = 776;
        status.tick_cost.worst_100ns = 856;
        assert_eq!(
            program(&status).as_deref(),
            Some(
                "firmware 0.1.2, commit 8a952d0f; a tick takes 77.6 us in the mean, 85.6 us at the most"
            )
        );
    }

    #[test]
    fn prop_a_crash_has_one_line_that_says_where() {
        let line = crash_line(&Crash::at("firmware/src/main.rs", 12));
        assert!(line.contains("firmware/src/main.rs, line 12"), "{line}");
        let exception = Crash {
            pc: 0x0801_0abc,
            ..Crash::default()
        };
        assert!(crash_line(&exception).contains("PC 08010abc"));
    }

    #[test]
    fn prop_every_fault_has_one_line_with_its_remedy() {
        for known in &DESCRIPTIONS {
            for detail in 0..6 {
                let line = fault_line(known.fault.at(detail));
                assert!(
                    line.contains(known.name) && line.contains(known.remedy),
                    "{line}"
                );
                assert!(!line.contains('\n'), "{line}");
            }
        }
        let line = fault_line(Fault::FrozenSensor.of(Channel::SupplyPressure));
        assert!(line.contains("(p_s)"), "{line}");
        let line = fault_line(Fault::WatchdogReset.at(2));
        assert!(line.contains("(exception of the processor)"), "{line}");
    }
}
