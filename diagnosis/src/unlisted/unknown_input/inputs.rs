//! The inputs of the chambers that may be off.

use crate::locate;
use crate::rig::Rig;

/// Sizes at which an input is tried, over the most that it may be off that way: a valve that is
/// shut within its dead zone and open beyond it is no straight line.
pub(super) const SIZES: [f64; 9] = [-1.0, -0.3, -0.1, -0.03, 0.0, 0.03, 0.1, 0.3, 1.0];

/// An input and the small shift with which its direction is found.
pub(super) struct Input {
    pub(super) what: locate::Input,
    /// Numbers of the rig that shift together, each by this much per unit.
    pub(super) shifts: Vec<(&'static str, f64)>,
    /// No such input is ever further off, one way or the other; chosen.
    pub(super) range: (f64, f64),
    /// Its number is known so well that what is missing of it varies.
    pub(super) varies: bool,
}

impl Input {
    /// The sizes at which it is tried.
    pub(super) fn sizes(&self) -> Vec<f64> {
        let (lower, upper) = self.range;
        let of_part = |part: f64| {
            if part < 0.0 {
                -part * lower
            } else {
                part * upper
            }
        };
        SIZES.map(of_part).to_vec()
    }
}

/// What there is, with shifts that matter little.
pub(super) fn inputs() -> Vec<Input> {
    let input = |place, quantity, unit, shifts: &[(&'static str, f64)], range| Input {
        what: locate::Input {
            place,
            quantity,
            unit,
        },
        shifts: shifts.to_vec(),
        range,
        varies: place == "exhaust",
    };
    let both_ways = |most: f64| (-most, most);
    let mut all = vec![
        input(
            "valve-command",
            "command",
            "V",
            &[("valve.null_V", -1.0)],
            both_ways(0.5),
        ),
        input(
            "supply",
            "supply pressure",
            "Pa",
            &[("supply.pressure_Pa", 1.0)],
            both_ways(1.5e5),
        ),
        input(
            "exhaust",
            "ambient pressure",
            "Pa",
            &[("environment.pressure_Pa", 1.0)],
            // A silencer that chokes, or a neighbour on the same one; nothing sucks, but the
            // file's number may be of another day's weather.
            (-1e4, 2e5),
        ),
    ];
    let (supply, exhaust) = (
        ("valve.supply_area_m2", 1.0),
        ("valve.exhaust_area_m2", 1.0),
    );
    for shifts in [&[supply, exhaust][..], &[supply], &[exhaust]] {
        all.push(input(
            "valve-flow",
            "valve flow factor",
            "1",
            shifts,
            both_ways(0.7),
        ));
    }
    for (place, key) in [
        ("chamber-a", "effects.chamber-leakage.laminar_a_kg_s_Pa2"),
        ("chamber-b", "effects.chamber-leakage.laminar_b_kg_s_Pa2"),
    ] {
        // At 6 bar 5e-15 is some 130 l/min: a fifth of what the valve passes.
        let shifts = &[(key, 1.0)];
        all.push(input(place, "leak", "kg/(s Pa2)", shifts, both_ways(5e-15)));
    }
    all
}

/// The rig with an input that is off by so much.
pub(super) fn shifted(rig: &Rig, input: &Input, size: f64) -> Rig {
    let shifts = input.shifts.iter().map(|&(key, per_unit)| {
        let value = rig.value(key).unwrap_or(0.0);
        (key.to_owned(), value + per_unit * size)
    });
    rig.with_values(&shifts.collect())
}
