//! Wiring and instruments, by trial: is there one mistake of the kind that people
//! make with gauges, wires and loggers that reconciles the recordings with the rig?
//!
//! Where the refitted chambers miss more than those of a sound axis do, each mistake in turn is undone
//! in the recordings, and the model is refitted to what they then are. Gauges that count
//! from the atmosphere, a live zero, exchanged wires and a command that is logged late
//! have known sizes or one number; no physics of the list can undo them. One that takes
//! nearly all of the misfit away is named, with the correction; where none does, the
//! misfit is the search's.
//!
//! A sensor or a valve that is late is physics of the list, and is left to the search. Where that
//! finds a valve that is late and a position that is early by the same time, the gauges are late:
//! one cause, and none of the axis.

use crate::effects::flow::valve_delay;
use crate::effects::sensing::position_time_skew;
use crate::estimate::{Bench, Fitted, STEPS_FROM_GIVEN};
use crate::finding::Finding;
use crate::inspect::{Fault, whole};
use crate::laws::{Law, Track};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::search;
use rayon::prelude::*;

/// A mistake is named where undoing it leaves at most this part of the misfit above the
/// noise ...
const LEFT: f64 = 0.1;
/// ... and any other leaves so many times as much.
const RIVAL: f64 = 3.0;
/// Full scales of common pressure transmitters, bar.
const FULL_SCALES_BAR: [f64; 3] = [6.0, 10.0, 16.0];
/// 4 to 20 mA read as 0 to 20 mA: a fifth of the range, and four fifths of the pressure.
const LIVE_ZERO: f64 = 0.2;
/// So many kinds of mistake that leave least after a few steps of a fit are fitted to the end.
const FINALISTS: usize = 3;
/// How late a command may be logged, in rows.
const LATE_ROWS: [usize; 9] = [1, 2, 3, 4, 5, 7, 10, 15, 20];
const BAR_PA: f64 = 1e5;

/// Two times are the same to within a row, or this part of them.
const SAME_TIME: f64 = 0.1;

/// Gauges that are late against command and position, as a fault of the first recording, with its
/// name.
pub(crate) fn late_gauges(laws: &[Finding], train: &[Recording]) -> Option<(String, Fault)> {
    let law = laws.iter().find(|law| law.law == Law::Chambers)?;
    let shift_s = |effect: &'static str| {
        law.named().find(|named| *named == effect)?;
        let place = law.improved.place(&format!("effects.{effect}.delay_s"))?;
        Some(law.improved.values[place])
    };
    let valve_late_s = shift_s(valve_delay::EFFECT.name)?;
    let position_early_s = -shift_s(position_time_skew::EFFECT.name)?;
    let recording = train.first()?;
    let row_s = crate::laws::median_step_s(&recording.time_s);
    let is_same = (valve_late_s - position_early_s).abs() < row_s.max(SAME_TIME * valve_late_s);
    (is_same && position_early_s > row_s).then(|| {
        let said = format!(
            "and p_b are recorded {:.1} ms late against command and position: a logger that reads in turns, a slow bus or a filter of the gauges",
            1e3 * valve_late_s
        );
        (recording.name.clone(), whole(recording, "p_a", &said))
    })
}

/// One mistake, and how it is undone.
struct Mistake {
    signals: &'static [&'static str],
    what: String,
    undo: Undo,
}

/// What undoes a mistake.
#[derive(Clone, Copy)]
enum Undo {
    /// Reading times gain plus offset.
    Affine { gain: f64, offset_pa: f64 },
    /// Chamber A's gauge is B's and the other way round.
    Exchange,
    /// The value of a row belongs to so many rows before.
    Earlier { rows: usize },
}

/// The mistake that reconciles the recordings with the rig, as a fault of the one that it was
/// tried on, with its name.
pub(crate) fn mistake(rig: &Rig, train: &[Recording]) -> Option<(String, Fault)> {
    let tried = train.iter().min_by_key(|recording| recording.len())?;
    let row_s = crate::laws::median_step_s(&tried.time_s);
    let before = missed(rig, tried).filter(|missed| missed.is_unsound)?;
    let mistakes: Vec<Mistake> = mistakes(rig, row_s)
        .into_iter()
        .filter(|mistake| {
            mistake
                .signals
                .iter()
                .all(|name| tried.signal(name).is_some())
        })
        .collect();
    let begun = |mistake: &Mistake| left_in_brief(rig, &mistake.undone(tried), &before.fitted);
    let begun: Vec<f64> = mistakes.par_iter().map(begun).collect();
    let finished: Vec<(f64, &Mistake)> = best_of_kinds(&mistakes, &begun, before.excess)
        .into_par_iter()
        .map(|mistake| {
            let after = missed(rig, &mistake.undone(tried));
            let left = after.map_or(f64::INFINITY, |after| after.excess / before.excess);
            (left, mistake)
        })
        .collect();
    let least = |one: &&(f64, &Mistake), other: &&(f64, &Mistake)| one.0.total_cmp(&other.0);
    let &(left, best) = finished.iter().min_by(least)?;
    // Neighbouring shifts of one signal, and a live zero over another range, are no rivals.
    let rivals = finished
        .iter()
        .filter(|(_, other)| other.kind() != best.kind());
    let rival = rivals
        .min_by(least)
        .map_or(f64::INFINITY, |(left, _)| *left);
    (left < LEFT && rival > RIVAL * left).then(|| {
        let said = format!(
            "{}; with that corrected the refitted model misses {:.1} % less of the chamber pressures",
            best.what,
            100.0 * (1.0 - left)
        );
        let fault = whole(tried, best.signals[0], &said);
        (tried.name.clone(), fault)
    })
}

/// Of mistakes and what a fit that was begun leaves with each, the best of each kind, the best
/// kinds only; none that leaves more than the refit without any, of which it is to leave a tenth.
fn best_of_kinds<'m>(mistakes: &'m [Mistake], left: &[f64], refit: f64) -> Vec<&'m Mistake> {
    let mut order: Vec<(f64, &Mistake)> = left.iter().copied().zip(mistakes).collect();
    order.retain(|(left, _)| *left < refit);
    order.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut best: Vec<&Mistake> = Vec::new();
    for (_, mistake) in order {
        if best.len() < FINALISTS && best.iter().all(|one| one.kind() != mistake.kind()) {
            best.push(mistake);
        }
    }
    best
}

impl Mistake {
    fn kind(&self) -> (u8, &'static [&'static str]) {
        let kind = match self.undo {
            Undo::Affine { gain, .. } if gain > 1.0 => 0,
            Undo::Affine { gain, .. } if gain < 1.0 => 1,
            Undo::Affine { offset_pa, .. } if offset_pa > 0.0 => 2,
            Undo::Affine { .. } => 3,
            Undo::Exchange => 4,
            Undo::Earlier { .. } => 5,
        };
        (kind, self.signals)
    }

    fn undone(&self, recording: &Recording) -> Recording {
        let mut mended = recording.clone();
        match self.undo {
            Undo::Affine { gain, offset_pa } => {
                for name in self.signals {
                    let column = mended.signals.get_mut(*name).into_iter().flatten();
                    column.for_each(|value| *value = gain * *value + offset_pa);
                }
            }
            Undo::Exchange => {
                let (a, b) = (mended.signals.remove("p_a"), mended.signals.remove("p_b"));
                mended.signals.extend(b.map(|b| ("p_a".to_owned(), b)));
                mended.signals.extend(a.map(|a| ("p_b".to_owned(), a)));
            }
            Undo::Earlier { rows } => {
                for name in self.signals {
                    if let Some(column) = mended.signals.get_mut(*name) {
                        column.rotate_left(rows);
                    }
                }
                mended = mended.part(0..mended.len() - rows);
            }
        }
        mended
    }
}

/// The mistakes that are tried, each a clause behind the first signal's name.
fn mistakes(rig: &Rig, row_s: f64) -> Vec<Mistake> {
    const GAUGES: [&[&str]; 5] = [
        &["p_a", "p_b", "p_s"],
        &["p_a", "p_b"],
        &["p_a"],
        &["p_b"],
        &["p_s"],
    ];
    let is_gauge = |name: &str| rig.signals.get(name).is_some_and(|one| one.unit.is_gauge());
    let of = |signals: &'static [&'static str]| {
        // A transmitter counts from where its unit does.
        let counts_from_ambient = signals.iter().all(|name| is_gauge(name));
        of_gauges(signals, rig.ambient_pressure_pa(), counts_from_ambient)
    };
    let mut all: Vec<Mistake> = GAUGES.into_iter().flat_map(of).collect();
    all.push(Mistake {
        signals: &["p_a", "p_b"],
        what: "and p_b seem to be exchanged".into(),
        undo: Undo::Exchange,
    });
    all.extend(LATE_ROWS.map(|rows| Mistake {
        signals: &["u"],
        what: format!(
            "seems to be logged about {:.2} ms late: the axis answers before it",
            1e3 * row_s * rows as f64
        ),
        undo: Undo::Earlier { rows },
    }));
    all
}

/// What gauges are taken for.
fn of_gauges(
    signals: &'static [&'static str],
    ambient_pa: f64,
    counts_from_ambient: bool,
) -> Vec<Mistake> {
    let from_pa = if counts_from_ambient { ambient_pa } else { 0.0 };
    let others = match signals {
        [_, others @ ..] if !others.is_empty() => format!(", and so do {}", others.join(" and ")),
        _ => String::new(),
    };
    let mistake = |what: String, gain: f64, offset_pa: f64| Mistake {
        signals,
        what: what + &others,
        undo: Undo::Affine { gain, offset_pa },
    };
    let off_by_bar = ambient_pa / BAR_PA;
    let mut all = vec![
        mistake(
            format!("seems to be gauge pressure declared as absolute, off by -{off_by_bar:.2} bar"),
            1.0,
            ambient_pa,
        ),
        mistake(
            format!("seems to be absolute pressure declared as gauge, off by +{off_by_bar:.2} bar"),
            1.0,
            -ambient_pa,
        ),
    ];
    all.extend(FULL_SCALES_BAR.map(|full_scale_bar| {
        let zero_pa = LIVE_ZERO * full_scale_bar * BAR_PA;
        let gain = 1.0 / (1.0 - LIVE_ZERO);
        let what = format!(
            "seems to be 4 to 20 mA over {full_scale_bar} bar read as 0 to 20 mA: offset and gain are off"
        );
        mistake(what, gain, from_pa - gain * (from_pa + zero_pa))
    }));
    all
}

/// What the refitted chambers miss of a recording.
struct Missed {
    fitted: Fitted,
    /// Mean squares in units of the noise, above it, summed over the pressures.
    excess: f64,
    is_unsound: bool,
}

fn missed(rig: &Rig, recording: &Recording) -> Option<Missed> {
    let tracks = [Track::new(recording)];
    let bench = Bench::new(Law::Chambers, rig, &tracks).for_search();
    let fitted = search::baseline(&bench)?;
    Some(Missed {
        excess: fitted.energy_above(&bench.noise),
        is_unsound: bench.is_unsound(&fitted),
        fitted,
    })
}

/// The energy that a few steps from the rig as given leave of a recording; `like` has its names.
fn left_in_brief(rig: &Rig, recording: &Recording, like: &Fitted) -> f64 {
    let tracks = [Track::new(recording)];
    let bench = Bench::new(Law::Chambers, rig, &tracks).for_search();
    let begun = bench.ranked_by(&[], &bench.as_given(like), STEPS_FROM_GIVEN);
    begun.map_or(f64::INFINITY, |begun| begun.energy_above(&bench.noise))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawn;
    use truth_plant::{Kind, Request, Strength};

    const SEED: u64 = 7;

    fn said(rig: &Rig, recordings: &[Recording]) -> Option<String> {
        mistake(rig, recordings).map(|(_, fault)| fault.sentence)
    }

    /// A mistake of each kind, made in the recordings of a healthy axis, is named with its size.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_the_mistake_that_was_made_is_named() {
        let (rig, recordings) = drawn::read(&Request::new(SEED, Kind::Nothing).with_noise(1.0));
        let with = |change: &dyn Fn(&mut Recording)| {
            let mut changed = recordings[..1].to_vec();
            change(&mut changed[0]);
            said(&rig, &changed).unwrap_or_default()
        };
        let shifted = |recording: &mut Recording, name: &str, gain: f64, offset_pa: f64| {
            let column = recording.signals.get_mut(name).expect("recorded");
            column
                .iter_mut()
                .for_each(|value| *value = gain * *value + offset_pa);
        };
        assert_eq!(said(&rig, &recordings), None);
        let one_gauge = with(&|recording| shifted(recording, "p_b", 1.0, -101_325.0));
        assert!(
            one_gauge.contains("p_b seems to be gauge pressure declared as absolute"),
            "{one_gauge}"
        );
        let live_zero = with(&|recording| shifted(recording, "p_a", 0.8, 2e5));
        assert!(
            live_zero.contains("p_a seems to be 4 to 20 mA over 10 bar"),
            "{live_zero}"
        );
        let late = with(&|recording| {
            let column = recording.signals.get_mut("u").expect("recorded");
            column.rotate_right(4);
        });
        assert!(
            late.contains("u seems to be logged about 4.00 ms late"),
            "{late}"
        );
    }

    /// What is physics is left to the search.
    #[test]
    #[ignore = "long: cargo xtask test --all"]
    fn val_no_effect_is_taken_for_a_mistake() {
        for effect in ["tube-line", "pressure-sensor-lag"] {
            let (rig, recordings) = drawn::of_kind(Kind::Single, SEED, Strength::Strong, effect);
            assert_eq!(said(&rig, &recordings), None, "{effect}");
        }
    }
}
