//! Pressure gauges against what the rig states: which correction reconciles them.
//!
//! The supply's gauge is compared with the declared supply pressure. Where they
//! are further apart than the rig's own uncertainty allows, the mistakes that
//! people make are tried: gauge pressure called absolute, absolute called gauge,
//! a live zero (4 to 20 mA read as 0 to 20 mA) over the usual ranges. One that
//! brings the two together is named; where none does, the difference is left to
//! the diagnosis, as a pressure regulator may simply be set otherwise.
//!
//! Chambers that gas cannot leave or enter are compared with the motion: a
//! pressure that stays at that of the surroundings while the volume changes
//! belongs to a chamber that is open.

use super::fault::{Fault, FaultKind, at_odds_as};
use super::statistics::quantile;
use super::{BAR_PA, SignalReport};
use crate::recording::Recording;
use crate::rig::{PositionZero, Rig};

/// Deviations of the declared supply within which two numbers agree, and beyond which they
/// contradict each other: one in 16,000 and one in 1.7 million normal draws.
const AGREES: f64 = 4.0;
const CONTRADICTS: f64 = 5.0;
/// A supply without a stated uncertainty is known to so much of itself: a dial gauge of
/// class 2.5 on the regulator.
const UNSTATED: f64 = 0.025;
/// Full scales of common pressure transmitters.
const FULL_SCALES_BAR: [f64; 4] = [6.0, 10.0, 16.0, 25.0];
/// A loop of 4 to 20 mA that is read as 0 to 20 mA: a fifth of the range, and four fifths of
/// the pressure.
const LIVE_ZERO: f64 = 0.2;
/// A change of the volume that any closed gas answers.
const VOLUME_CHANGE: f64 = 0.1;
/// A pressure that moves by less than this part of what the change of volume asks for does not
/// answer it.
const ANSWERED: f64 = 0.05;
/// How near to the surroundings an open chamber stays.
const NEAR_AMBIENT: f64 = 0.05;

/// The supply's gauge against the rig, reconciled by a common mistake.
pub(super) fn supply(rig: &Rig, recording: &Recording) -> Option<Fault> {
    let declared_pa = rig.supply.as_ref()?.pressure_pa;
    let stated = rig.uncertainty_sd("supply.pressure_Pa");
    let deviation_pa = stated.unwrap_or(UNSTATED * declared_pa);
    let read_pa = quantile(&mut recording.signal("p_s")?.to_vec(), 0.5);
    let agrees =
        |corrected_pa: f64, within: f64| (corrected_pa - declared_pa).abs() < within * deviation_pa;
    if agrees(read_pa, CONTRADICTS) {
        return None;
    }
    let (what, corrected_pa) = corrections(read_pa, rig.ambient_pressure_pa())
        .into_iter()
        .find(|(_, corrected_pa)| agrees(*corrected_pa, AGREES))?;
    let said = format!(
        "reads {:.3} bar absolute where the rig declares {:.3} ± {:.3} bar: {what}, which would make it {:.3} bar; \
         the other gauges are probably read in the same way",
        read_pa / BAR_PA,
        declared_pa / BAR_PA,
        deviation_pa / BAR_PA,
        corrected_pa / BAR_PA,
    );
    Some(at_odds_as(FaultKind::Inconsistent, recording, "p_s", &said))
}

/// What a reading would be if it had been mistaken in one of the common ways.
fn corrections(read_pa: f64, ambient_pa: f64) -> Vec<(String, f64)> {
    let mut all = vec![
        (
            "it seems to be gauge pressure declared as absolute (declare it as (g))".to_owned(),
            read_pa + ambient_pa,
        ),
        (
            "it seems to be absolute pressure declared as gauge (declare it as (abs))".to_owned(),
            read_pa - ambient_pa,
        ),
    ];
    for full_scale_bar in FULL_SCALES_BAR {
        let full_scale_pa = full_scale_bar * BAR_PA;
        all.push((
            format!("4 to 20 mA over {full_scale_bar} bar seem to be read as 0 to 20 mA (give the signal its scale and offset)"),
            (read_pa - LIVE_ZERO * full_scale_pa) / (1.0 - LIVE_ZERO),
        ));
        all.push((
            format!("0 to 20 mA over {full_scale_bar} bar seem to be read as 4 to 20 mA (give the signal its scale and offset)"),
            read_pa * (1.0 - LIVE_ZERO) + LIVE_ZERO * full_scale_pa,
        ));
    }
    all
}

/// A closed chamber whose pressure stays at that of the surroundings while its volume changes.
pub(super) fn open_chamber(
    rig: &Rig,
    recording: &Recording,
    report: &SignalReport,
    values: &[f64],
) -> Option<Fault> {
    let is_closed = rig.valve.is_none() && rig.vessel.is_none();
    if !is_closed || !matches!(report.name.as_str(), "p_a" | "p_b") {
        return None;
    }
    let share = volume_change(rig, recording, report.name == "p_a")?;
    let ambient_pa = rig.ambient_pressure_pa();
    let median_pa = quantile(&mut values.to_vec(), 0.5);
    let span_pa = quantile(&mut values.to_vec(), 0.99) - quantile(&mut values.to_vec(), 0.01);
    let is_open = share > VOLUME_CHANGE
        && span_pa < ANSWERED * share * median_pa
        && (median_pa - ambient_pa).abs() < NEAR_AMBIENT * ambient_pa;
    is_open.then(|| {
        let said = format!(
            "stays at {:.3} bar absolute, the pressure of the surroundings, while the volume changes by {:.0} %: \
             the chamber does not hold gas (it is open to the surroundings)",
            median_pa / BAR_PA,
            100.0 * share
        );
        at_odds_as(FaultKind::Inconsistent, recording, &report.name, &said)
    })
}

/// Largest over smallest volume of a chamber, less one.
fn volume_change(rig: &Rig, recording: &Recording, is_a: bool) -> Option<f64> {
    let position = recording.signal("x")?;
    let cylinder = rig.cylinder.as_ref()?;
    let stroke_m = cylinder.stroke_m?;
    let (area_m2, dead_m3) = if is_a {
        (cylinder.area_a_m2?, cylinder.dead_volume_a_m3?)
    } else {
        (cylinder.area_b_m2?, cylinder.dead_volume_b_m3?)
    };
    let from_end_a_m = match cylinder.position_zero? {
        PositionZero::EndA => 0.0,
        PositionZero::MidStroke => 0.5 * stroke_m,
    };
    let volume_m3 = |share: f64| {
        let from_a_m = quantile(&mut position.to_vec(), share) + from_end_a_m;
        let length_m = if is_a { from_a_m } else { stroke_m - from_a_m };
        dead_m3 + area_m2 * length_m.max(0.0)
    };
    let (one, other) = (volume_m3(0.01), volume_m3(0.99));
    Some(one.max(other) / one.min(other) - 1.0)
}
