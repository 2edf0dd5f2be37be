//! A supply that sags.

use crate::effects::candidate::Candidate;
use crate::effects::declaration::{Effect, Numbers, PLAIN, parameter};
use crate::effects::mark::Mark;
use crate::effects::scene::Scene;
use model_core::left_out::SupplyDroop;
use model_core::real::Real;

/// Twice the largest regulator.
const REGULATOR_M2: f64 = 4e-5;

/// The declaration.
#[rustfmt::skip]
pub const EFFECT: Effect = Effect {
    name: "supply-droop",
    what: "A supply tank that is emptied faster than it is refilled.",
    parameters: &[
        parameter("tank_volume_m3", "m3", 0.0, 0.0, "volume of the tank; 0 is a constant supply", "0.0005 to 0.02").said("tank volume", "L"),
        parameter("feed_area_m2", "m2", 1e-5, 0.0, "orifice area of regulator and line that refill it", "5e-6 to 2e-5").said("feed area", "mm²"),
        parameter("gauge_before_feed", "1", 0.0, 0.0, "1 where the recorded supply pressure is that of the regulator, 0 where it is that of the tank", "0 or 1").said("gauge before the feed", ""),
    ],
    meaning: "the supply pressure drops: the regulator refills its tank more slowly than the valve empties it",
    meaning_of_form: &[(GAUGE_BEFORE_FEED, "the supply pressure drops at the valve, downstream of its gauge: the feed line is too narrow")],
    shown_by: "several full strokes without a pause, then rest, with the supply pressure recorded",
    told_from: &[
        (&["exhaust-back-pressure", "chamber-leakage", "piston-leakage"], "Separate long fill bursts and long exhaust bursts, each followed by a dwell of 10 s, with the supply pressure recorded: a supply droop acts during filling and outlasts it, a silencer acts during exhausting, a leak continues during the dwell."),
        (&["tube-line"], "Long fill bursts with the supply pressure recorded at the valve: a supply droop outlasts the flow by seconds, the pressure drop of a tube ends with it."),
    ],
    off_board: Some((&["gauge_before_feed"], "describes the position of a gauge in a recording; no law of the axis uses it")),
    candidates,
    ..PLAIN
};

const GAUGE_BEFORE_FEED: &str = "gauge before the feed";

/// The tank between regulator and valve.
pub fn law<R: Real>(numbers: &impl Numbers<R>) -> SupplyDroop<R> {
    SupplyDroop {
        tank_volume_m3: EFFECT.number(numbers, "tank_volume_m3"),
        feed_area_m2: EFFECT.number(numbers, "feed_area_m2"),
    }
}

/// Whether the gauge of the supply shows the regulator's pressure and not the tank's.
pub fn gauge_before_feed<R: Real>(numbers: &impl Numbers<R>) -> bool {
    EFFECT.number(numbers, "gauge_before_feed").value() > 0.5
}

fn candidates(scene: &Scene<'_>) -> Vec<Candidate> {
    if !scene.is_behind_valve() {
        return Vec::new();
    }
    let mut all = vec![droop(scene)];
    if scene.rig.signals.contains("p_s") {
        let before_feed = droop(scene).form(GAUGE_BEFORE_FEED);
        all.push(before_feed.switch("gauge_before_feed", 1.0));
    }
    all
}

/// The tank drawn empty in a tenth and in half a second by an open valve; and a large one
/// behind a regulator as wide as the valve.
fn droop(scene: &Scene<'_>) -> Candidate {
    let open_m2 = scene.open_valve_m2();
    let feeds_m2 = [0.3 * open_m2, 0.3 * open_m2, open_m2];
    Candidate::new(EFFECT.name, &["supply"])
        .free("tank_volume_m3", (1e-5, 0.1), &[1e-3, 5e-3, 1e-2])
        .free("feed_area_m2", (1e-8, 1e-3), &feeds_m2)
        .matters(scene.mark(Mark::UpTo(REGULATOR_M2)))
}
