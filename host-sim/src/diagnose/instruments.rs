//! Wiring and instruments, by trial: is there one mistake of the kind that people
//! make with gauges, wires and loggers that reconciles the recordings with the rig?
//!
//! Where the refitted chambers miss something plainly, each mistake in turn is undone
//! in the recordings, and the model is refitted to what they then are. Gauges that count
//! from the atmosphere, a live zero, exchanged wires and a command that is logged late
//! have known sizes or one number; no physics of the list can undo them. One that takes
//! nearly all of the misfit away is named, with the correction; where none does, the
//! misfit is the search's.
//!
//! A sensor or a valve that is late is physics of the list, and is left to the search.

use super::fitted::{Bench, Fitted};
use super::search;
use crate::inspect::{Fault, whole};
use crate::laws::{Law, Track};
use crate::recording::Recording;
use crate::rig::{Rig, STANDARD_PRESSURE_PA};
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
/// How late a command may be logged, in rows.
const LATE_ROWS: [usize; 9] = [1, 2, 3, 4, 5, 7, 10, 15, 20];
const BAR_PA: f64 = 1e5;

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

/// The mistake that reconciles the recordings with the rig, as a fault of the first of them.
pub(super) fn mistake(rig: &Rig, train: &[Recording]) -> Option<Fault> {
    let tried = train.iter().min_by_key(|recording| recording.len())?;
    let before = missed(rig, tried).filter(|missed| missed.is_plain)?;
    let mistakes: Vec<Mistake> = mistakes(rig)
        .into_iter()
        .filter(|mistake| {
            mistake
                .signals
                .iter()
                .all(|name| tried.signal(name).is_some())
        })
        .collect();
    let left = |mistake: &Mistake| {
        let after = missed(rig, &mistake.undone(tried));
        after.map_or(f64::INFINITY, |after| after.excess / before.excess)
    };
    let left: Vec<f64> = mistakes.par_iter().map(left).collect();
    let mut order: Vec<usize> = (0..mistakes.len()).collect();
    order.sort_by(|one, other| left[*one].total_cmp(&left[*other]));
    let best = *order.first()?;
    // Neighbouring shifts of one signal, and a live zero over another range, are no rivals.
    let is_rival = |other: &&usize| mistakes[**other].what_kind() != mistakes[best].what_kind();
    let rival = order
        .iter()
        .find(is_rival)
        .map_or(f64::INFINITY, |other| left[*other]);
    if std::env::var_os("PNEUMA_TRIALS").is_some() {
        eprintln!("excess {:.3e}", before.excess);
        for &place in order.iter().take(6) {
            eprintln!("  {:.4} {}", left[place], mistakes[place].what);
        }
    }
    (left[best] < LEFT && rival > RIVAL * left[best]).then(|| {
        let said = format!(
            "{}: with that undone the refitted model misses {:.0} % less of the chamber pressures",
            mistakes[best].what,
            100.0 * (1.0 - left[best])
        );
        whole(tried, mistakes[best].signals[0], &said)
    })
}

impl Mistake {
    fn what_kind(&self) -> (u8, &'static [&'static str]) {
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

/// The mistakes that are tried.
fn mistakes(rig: &Rig) -> Vec<Mistake> {
    const GAUGES: [&[&str]; 5] = [
        &["p_a", "p_b", "p_s"],
        &["p_a", "p_b"],
        &["p_a"],
        &["p_b"],
        &["p_s"],
    ];
    let ambient = rig.value("environment.pressure_Pa");
    let ambient_pa = ambient.unwrap_or(STANDARD_PRESSURE_PA);
    let mut all = Vec::new();
    for signals in GAUGES {
        let names = names(signals);
        let mut add = |what: String, gain: f64, offset_pa: f64| {
            all.push(Mistake {
                signals,
                what,
                undo: Undo::Affine { gain, offset_pa },
            });
        };
        add(
            format!(
                "{names}: gauge pressure seems to be declared as absolute, off by -{:.2} bar",
                ambient_pa / BAR_PA
            ),
            1.0,
            ambient_pa,
        );
        add(
            format!(
                "{names}: absolute pressure seems to be declared as gauge, off by +{:.2} bar",
                ambient_pa / BAR_PA
            ),
            1.0,
            -ambient_pa,
        );
        for full_scale_bar in FULL_SCALES_BAR {
            let zero_pa = LIVE_ZERO * full_scale_bar * BAR_PA;
            add(
                format!(
                    "{names}: 4 to 20 mA over {full_scale_bar} bar seem to be read as 0 to 20 mA (offset and gain)"
                ),
                1.0 / (1.0 - LIVE_ZERO),
                -zero_pa / (1.0 - LIVE_ZERO),
            );
        }
    }
    all.push(Mistake {
        signals: &["p_a", "p_b"],
        what: "the gauges of chamber A and chamber B seem to be exchanged".into(),
        undo: Undo::Exchange,
    });
    for rows in LATE_ROWS {
        all.push(Mistake {
            signals: &["u"],
            what: format!(
                "the command seems to be logged about {rows} rows late: the axis answers before it"
            ),
            undo: Undo::Earlier { rows },
        });
    }
    all
}

fn names(signals: &[&str]) -> String {
    let name = |signal: &&str| match *signal {
        "p_a" => "chamber A pressure",
        "p_b" => "chamber B pressure",
        _ => "supply pressure",
    };
    signals.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// What the refitted chambers miss of a recording.
struct Missed {
    /// Mean squares in units of the noise, above it, summed over the pressures.
    excess: f64,
    is_plain: bool,
}

fn missed(rig: &Rig, recording: &Recording) -> Option<Missed> {
    let tracks = [Track::new(recording)];
    let bench = Bench::new(Law::Chambers, rig, &tracks).for_search();
    let fitted: Fitted = search::baseline(&bench)?;
    let squares = fitted.mean_square.iter().zip(&bench.noise);
    let excess = squares
        .map(|(square, noise)| (square / noise.powi(2) - 1.0).max(0.0))
        .sum();
    Some(Missed {
        excess,
        is_plain: bench.misses_plainly(&fitted),
    })
}
