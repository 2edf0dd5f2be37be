//! Pressure gauges against what the rig states: which correction reconciles them.
//!
//! The supply's gauge is compared with the declared supply pressure. Where they
//! are further apart than the rig's own uncertainty allows, the mistakes that
//! people make are tried: gauge pressure called absolute, absolute called gauge,
//! a live zero (4 to 20 mA read as 0 to 20 mA) over the usual ranges. Of eleven such
//! mistakes one reconciles a supply that is merely set otherwise in a quarter of the cases:
//! it is a fault only where the chambers contradict the gauge too, and a note otherwise. The
//! diagnosis tries the same mistakes against the motion.
//!
//! Chambers that gas cannot leave or enter are compared with the motion: a
//! pressure that stays at that of the surroundings while the volume changes
//! belongs to a chamber that is open.

use super::fault::{Fault, FaultKind, at_odds_as};
use super::statistics::{correlation, quantile};
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
/// A chamber that is compressed in motion goes above its supply by this factor at the most.
const COMPRESSED: f64 = 1.1;
/// Below this part of the surroundings' pressure no exhaust takes a chamber.
const SUCKED: f64 = 0.8;
/// A change of the volume that any closed gas answers.
const VOLUME_CHANGE: f64 = 0.1;
/// A pressure that moves by less than this part of what the change of volume asks for does not
/// answer it.
const ANSWERED: f64 = 0.05;
/// Correlation of volume and pressure from which on a closed gas is read the wrong way round.
const INVERTED: f64 = 0.5;
/// How near to the surroundings an open chamber stays.
const NEAR_AMBIENT: f64 = 0.05;

/// What the supply's gauge says against the rig.
pub(super) enum Supply {
    /// Nothing else than the rig.
    Agrees,
    /// The chambers contradict the gauge as well: it is the gauge.
    Mistaken(Fault),
    /// The chambers follow the gauge: the regulator is set otherwise, or all gauges are read alike.
    SetOtherwise(String),
}

/// The supply's gauge against the rig and against the chambers that it feeds.
pub(super) fn supply(rig: &Rig, recording: &Recording) -> Supply {
    let Some((declared_pa, read_pa)) = supply_pa(rig, recording) else {
        return Supply::Agrees;
    };
    let stated = rig.uncertainty_sd("supply.pressure_Pa");
    let deviation_pa = stated.unwrap_or(UNSTATED * declared_pa);
    let agrees =
        |corrected_pa: f64, within: f64| (corrected_pa - declared_pa).abs() < within * deviation_pa;
    if agrees(read_pa, CONTRADICTS) {
        return Supply::Agrees;
    }
    let corrections = corrections(rig, read_pa);
    let off_pa = |(_, corrected_pa): &&(String, f64)| (corrected_pa - declared_pa).abs();
    let nearest = corrections
        .iter()
        .filter(|(_, corrected_pa)| agrees(*corrected_pa, AGREES))
        .min_by(|one, other| off_pa(one).total_cmp(&off_pa(other)));
    let stands = format!(
        "reads {:.3} bar absolute where the rig declares {:.3} ± {:.3} bar",
        read_pa / BAR_PA,
        declared_pa / BAR_PA,
        deviation_pa / BAR_PA,
    );
    match (nearest, fed_to_pa(recording)) {
        (Some((what, corrected_pa)), Some(highest_pa)) if contradicts(highest_pa, read_pa) => {
            let said = format!(
                "{stands}, and a chamber reaches {:.3} bar: {what}, which would make it {:.3} bar",
                highest_pa / BAR_PA,
                corrected_pa / BAR_PA,
            );
            let fault = at_odds_as(FaultKind::Inconsistent, recording, "p_s", &said);
            Supply::Mistaken(fault)
        }
        (Some((what, _)), _) if is_below_ambient(rig, recording) => {
            let said = format!("{stands}, and a chamber falls below the surroundings: {what}");
            let fault = at_odds_as(FaultKind::Inconsistent, recording, "p_s", &said);
            Supply::Mistaken(fault)
        }
        (Some((what, _)), _) => Supply::SetOtherwise(format!(
            "p_s {stands}: the regulator is set otherwise, or {what}, and the other gauges likewise"
        )),
        (None, _) => Supply::SetOtherwise(format!(
            "p_s {stands}: the regulator is set otherwise, or the gauge's range is not the one that was entered"
        )),
    }
}

/// What the rig declares of the supply, and the median of its gauge.
fn supply_pa(rig: &Rig, recording: &Recording) -> Option<(f64, f64)> {
    let declared_pa = rig.supply.as_ref()?.pressure_pa;
    let read_pa = quantile(&mut recording.signal("p_s")?.to_vec(), 0.5);
    Some((declared_pa, read_pa))
}

/// The highest pressure of a chamber: no chamber is fed above the supply.
fn fed_to_pa(recording: &Recording) -> Option<f64> {
    let chambers = ["p_a", "p_b"].into_iter();
    let highest =
        chambers.filter_map(|name| Some(quantile(&mut recording.signal(name)?.to_vec(), 0.99)));
    highest.reduce(f64::max)
}

/// Whether a chamber stands above what feeds it, by more than a compression in motion does.
fn contradicts(highest_pa: f64, supply_pa: f64) -> bool {
    highest_pa > COMPRESSED * supply_pa
}

/// Whether a chamber falls where no exhaust takes it.
fn is_below_ambient(rig: &Rig, recording: &Recording) -> bool {
    let ambient_pa = rig.ambient_pressure_pa();
    let mut chambers = ["p_a", "p_b"].into_iter();
    chambers.any(|name| {
        let pressure = recording.signal(name).map(<[f64]>::to_vec);
        pressure.is_some_and(|mut pressure| quantile(&mut pressure, 0.01) < SUCKED * ambient_pa)
    })
}

/// What a reading would be if it had been mistaken in one of the common ways.
fn corrections(rig: &Rig, read_pa: f64) -> Vec<(String, f64)> {
    let ambient_pa = rig.ambient_pressure_pa();
    let is_gauge = rig
        .signals
        .get("p_s")
        .is_some_and(|signal| signal.unit.is_gauge());
    let mut all = vec![if is_gauge {
        (
            "it seems to be absolute pressure declared as gauge (declare it as (abs))".to_owned(),
            read_pa - ambient_pa,
        )
    } else {
        (
            "it seems to be gauge pressure declared as absolute (declare it as (g))".to_owned(),
            read_pa + ambient_pa,
        )
    }];
    // In the rig file the same slip is made in the other direction.
    all.push((
        "`supply.pressure_Pa` seems to be a gauge pressure (add that of the surroundings)"
            .to_owned(),
        read_pa - ambient_pa,
    ));
    // A transmitter counts from where its unit does.
    let zero_pa = if is_gauge { ambient_pa } else { 0.0 };
    let shown_pa = read_pa - zero_pa;
    for full_scale_bar in FULL_SCALES_BAR {
        let full_scale_pa = full_scale_bar * BAR_PA;
        // None shows more than its range.
        if shown_pa > full_scale_pa {
            continue;
        }
        all.push((
            format!("4 to 20 mA over {full_scale_bar} bar seem to be read as 0 to 20 mA (give the signal its scale and offset)"),
            zero_pa + (shown_pa - LIVE_ZERO * full_scale_pa) / (1.0 - LIVE_ZERO),
        ));
        all.push((
            format!("0 to 20 mA over {full_scale_bar} bar seem to be read as 4 to 20 mA (give the signal its scale and offset)"),
            zero_pa + shown_pa * (1.0 - LIVE_ZERO) + LIVE_ZERO * full_scale_pa,
        ));
    }
    all
}

/// A closed chamber whose pressure stays at that of the surroundings while its volume changes.
pub(super) enum OpenChamber {
    /// The laws of closed chambers are not to be had from it.
    Fault(Fault),
    /// A force bench is run with open ports: the force is what is measured.
    Bench(String),
}

/// None if the chamber holds gas, or the recording does not say.
pub(super) fn open_chamber(
    rig: &Rig,
    recording: &Recording,
    report: &SignalReport,
    values: &[f64],
) -> Option<OpenChamber> {
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
    if !is_open {
        return None;
    }
    let said = format!(
        "stays at {:.3} bar absolute, the pressure of the surroundings, while the volume changes by {:.0} %",
        median_pa / BAR_PA,
        100.0 * share
    );
    Some(if recording.signal("force").is_some() {
        let name = &report.name;
        OpenChamber::Bench(format!(
            "{name} {said}: the port is open, as on a bench for friction; nothing is learnt of this chamber's gas"
        ))
    } else {
        let said =
            format!("{said}: the chamber does not hold gas (it is open to the surroundings)");
        OpenChamber::Fault(at_odds_as(
            FaultKind::Inconsistent,
            recording,
            &report.name,
            &said,
        ))
    })
}

/// A closed chamber whose pressure rises where its volume grows.
pub(super) fn inverted(rig: &Rig, recording: &Recording) -> Option<Fault> {
    if rig.valve.is_some() || rig.vessel.is_some() {
        return None;
    }
    let position = recording.signal("x")?;
    let along = |is_a: bool| {
        let (name, sign) = if is_a { ("p_a", 1.0) } else { ("p_b", -1.0) };
        let pressure = recording.signal(name)?;
        volume_change(rig, recording, is_a).filter(|share| *share > VOLUME_CHANGE)?;
        Some(sign * correlation(position, pressure))
    };
    let recorded: Vec<f64> = [true, false].into_iter().filter_map(along).collect();
    let is_inverted = !recorded.is_empty() && recorded.iter().all(|along| *along > INVERTED);
    is_inverted.then(|| {
        let said = "has the wrong sign, or p_a and p_b are exchanged: the gas of closed chambers is at a higher \
                    pressure where its volume is larger (+x enlarges chamber A)";
        at_odds_as(FaultKind::Inconsistent, recording, "x", said)
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
