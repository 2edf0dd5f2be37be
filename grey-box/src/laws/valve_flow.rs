//! Flow into the valve's ports, from command and pressures: a flow bench, or a meter in a line.
//!
//! ```text
//! m' = A_s(opening) q(p_s, p) - A_e(opening) q(p, p_e)
//! ```
//!
//! with the model's flow law q, (1) and (2) of the paper. Gas that leaves a port is taken at
//! ambient temperature, unless its temperature is recorded.

use super::command::spool_at_rows;
use super::{Output, Sink, Track};
use crate::gauge::Gauge;
use crate::model::{Side, Values};
use crate::rig::Rig;
use model_core::real::Real;
use model_core::valve::GasState;
use std::ops::Range;

/// The supply's pressure where none is declared or recorded, Pa: the law then lacks it.
const NO_SUPPLY_PA: f64 = 0.0;

fn flow_signal(side: Side) -> &'static str {
    match side {
        Side::A => "flow_a",
        Side::B => "flow_b",
    }
}

/// Ports whose flow and pressure are recorded.
fn ports(has: &dyn Fn(&str) -> bool) -> impl Iterator<Item = Side> {
    let recorded = |side: &Side| has(flow_signal(*side)) && has(side.pressure_signal());
    Side::BOTH
        .into_iter()
        .filter(recorded)
        .collect::<Vec<_>>()
        .into_iter()
}

/// Whether these signals hold a port's flow.
pub(super) fn is_recorded(has: &dyn Fn(&str) -> bool) -> bool {
    has("u") && ports(has).next().is_some()
}

pub(super) fn outputs(rig: &Rig) -> Vec<Output> {
    let output = |side| Output {
        signal: flow_signal(side),
        place: "valve-flow",
        unit: "kg/s",
    };
    ports(&|signal| rig.signals.contains(signal))
        .map(output)
        .collect()
}

pub(super) fn predict<R: Real>(
    values: &Values<'_, R>,
    track: &Track<'_>,
    rows: Range<usize>,
    sink: &mut dyn Sink<R>,
) {
    let (Some(command), Some(Ok(valve))) = (track.signal("u"), values.valve()) else {
        return;
    };
    let ambient = values.ambient();
    let sides: Vec<Side> = ports(&|signal| values.rig.signals.contains(signal)).collect();
    let gauges: Vec<Gauge<R>> = sides.iter().map(|side| Gauge::of(values, *side)).collect();
    let declared_pa = values.get_or("supply.pressure_Pa", NO_SUPPLY_PA);
    let at = |signal: &str, row: usize| track.signal(signal).map(|all| R::from_f64(all[row]));
    let recorded = (track.recording.time_s.as_slice(), command);
    let mut flows = [R::ZERO; 2];
    for (row, spool_v) in rows.clone().zip(spool_at_rows(values, recorded, &rows)) {
        let areas = valve.areas(spool_v);
        let supply = GasState {
            pressure_pa: at("p_s", row).unwrap_or(declared_pa),
            temperature_k: at("temperature_s", row).unwrap_or(ambient.temperature_k),
        };
        let exhaust = GasState {
            pressure_pa: at("p_e", row).unwrap_or(ambient.pressure_pa),
            ..ambient
        };
        for ((slot, &side), gauge) in flows.iter_mut().zip(&sides).zip(&gauges) {
            let (fed_m2, vented_m2, temperature) = match side {
                Side::A => (areas.supply_a_m2, areas.exhaust_a_m2, "temperature_a"),
                Side::B => (areas.supply_b_m2, areas.exhaust_b_m2, "temperature_b"),
            };
            let shown_pa = at(side.pressure_signal(), row).unwrap_or(ambient.pressure_pa);
            let port = GasState {
                pressure_pa: gauge.reads_pa(shown_pa),
                temperature_k: at(temperature, row).unwrap_or(ambient.temperature_k),
            };
            let fed = valve.law.flow(fed_m2, supply, port).mass_flow_kg_per_s;
            *slot = fed - valve.law.flow(vented_m2, port, exhaust).mass_flow_kg_per_s;
        }
        sink.row(row, &flows[..sides.len()], &[]);
    }
}

#[cfg(test)]
mod tests {
    use crate::laws::{Law, Track};
    use crate::model::Values;
    use crate::recording::Recording;
    use crate::rig::Rig;

    const PAPER: &str = include_str!("../../../host-sim/rigs/paper.toml");

    /// A choked path passes A Cd(r) C1 p / sqrt(T) and the closed one leaks 0.1 mm2.
    #[test]
    fn val_a_choked_path_passes_what_the_textbook_says() {
        let flow = "flow_a = { column = \"q\", unit = \"kg/s\" }\n[gas]";
        let rig = Rig::parse(&PAPER.replacen("[gas]", flow, 1), "rig.toml").expect("a rig");
        let rows = 50;
        let signals = [("u", 10.0), ("p_s", 7e5), ("p_a", 1.5e5), ("flow_a", 0.0)];
        let columns = signals.map(|(name, value)| (name.to_owned(), vec![value; rows]));
        let time_s = (0..rows).map(|row| row as f64 * 1e-3).collect();
        let recording = Recording::from_signals("flow.csv", time_s, columns.into());
        let laws = Law::of(&rig, &|signal| recording.signal(signal).is_some());
        assert!(laws.contains(&Law::ValveFlow), "{laws:?}");
        let (values, track) = (Values::of(&rig), Track::still(&recording));
        let mut last = f64::NAN;
        let mut sink = |_: usize, outputs: &[f64], _: &[f64]| last = outputs[0];
        Law::ValveFlow.predict(&values, &track, 0..rows, &[], &mut sink);
        let per_area = |up_pa: f64, ratio: f64| {
            let discharge = 0.8153 + 0.0933 * ratio - 0.1038 * ratio * ratio;
            discharge * 0.040_418_4 * up_pa / 293.15_f64.sqrt()
        };
        let fed = 16.7e-6 * per_area(7e5, 1.5 / 7.0);
        // The other path is not choked: psi of 1.01325/1.5.
        let ratio = 101_325.0 / 1.5e5;
        let psi = (1.0_f64 - ((ratio - 0.29) / 0.71_f64).powi(2)).sqrt();
        let vented = 1e-7 * per_area(1.5e5, ratio) * psi;
        assert!(
            (last / (fed - vented) - 1.0).abs() < 1e-5,
            "{last} {}",
            fed - vented
        );
    }
}
