//! Proportional valves by type, and the typical shape of their area over the command.
//!
//! Nominal flows are those of the manufacturer's catalogue as remembered; no data sheet was at hand
//! when they were written down. A rig file made from them says so and gives them 30 %.

use model_core::gas::Gas;
use model_core::valve::FlowLaw;

use crate::rig::area_of_nominal_flow;

/// A valve of the catalogue.
pub(super) struct ValveType {
    /// The type code.
    pub name: &'static str,
    /// Standard nominal flow, 6 to 5 bar, l/min.
    pub nominal_flow_l_min: f64,
}

const fn valve(name: &'static str, nominal_flow_l_min: f64) -> ValveType {
    ValveType {
        name,
        nominal_flow_l_min,
    }
}

/// All of them take 0 to 10 V with the null at 5 V.
pub(super) const CATALOGUE: &[ValveType] = &[
    valve("MPYE-5-M5-010B", 100.0),
    valve("MPYE-5-1/8-LF-010B", 350.0),
    valve("MPYE-5-1/8-HF-010B", 700.0),
    valve("MPYE-5-1/4-010B", 1400.0),
    valve("MPYE-5-3/8-010B", 2000.0),
];

/// b where a data sheet states none: 0.2 to 0.5 occurs.
pub(super) const TYPICAL_B: f64 = 0.3;
/// The laminar limit of the model; it hardly shows in motion.
pub(super) const TYPICAL_LAMINAR_RATIO: f64 = 0.98;

/// Share of the nominal flow over the opening in V of 5 V, 6 to 5 bar: measured on an MPYE-5-M5
/// (Zhu, thesis, Vanderbilt University 2006, table 2-2, column "Exp."), every second to fourth
/// point; the first two are its leakage, which is typical for the larger valves too (0.1 mm2 of 16.7 mm2).
const MEASURED_SHAPE: &[(f64, f64)] = &[
    (0.0, 0.006),
    (0.375, 0.006),
    (0.5, 0.0175),
    (0.625, 0.0351),
    (0.75, 0.0789),
    (1.0, 0.1404),
    (1.5, 0.2763),
    (2.0, 0.4298),
    (2.5, 0.5482),
    (3.0, 0.6579),
    (3.5, 0.7588),
    (4.0, 0.8509),
    (4.5, 0.9474),
    (5.0, 1.01),
];
/// The opening to which the shape was measured, V.
const MEASURED_OPENING_V: f64 = 5.0;

/// The valve of that type, however it is spelled.
pub(super) fn by_name(name: &str) -> Option<&'static ValveType> {
    let bare = |text: &str| -> String {
        let text = text.to_uppercase().replace("010-B", "010B");
        text.trim_start_matches("FESTO")
            .chars()
            .filter(char::is_ascii_alphanumeric)
            .collect()
    };
    let wanted = bare(name);
    let exact = CATALOGUE.iter().find(|one| bare(one.name) == wanted);
    // The end of the code, and HF for the 1/8 of high flow, may be left out.
    let short = |one: &&ValveType| {
        bare(one.name)
            .trim_end_matches("010B")
            .trim_end_matches("HF")
            == wanted.trim_end_matches("HF")
    };
    exact.or_else(|| CATALOGUE.iter().find(short))
}

/// Openings in V and areas in m2 of a valve of typical shape.
pub(super) fn typical_areas(
    nominal_flow_l_min: f64,
    b: f64,
    full_opening_v: f64,
) -> (Vec<f64>, Vec<f64>) {
    let law = FlowLaw {
        critical_pressure_ratio: b,
        laminar_pressure_ratio: TYPICAL_LAMINAR_RATIO,
        flow_coefficient: Gas::new(1.4, 287.0).flow_coefficient,
    };
    let area_m2 = area_of_nominal_flow(&law, nominal_flow_l_min);
    let stretch = full_opening_v / MEASURED_OPENING_V;
    MEASURED_SHAPE
        .iter()
        .map(|(opening_v, share)| (opening_v * stretch, share * area_m2))
        .unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_types_are_found_however_they_are_spelled() {
        for (name, flow) in [
            ("MPYE-5-1/8-HF-010B", 700.0),
            ("mpye-5-1/8-hf-010-b", 700.0),
            ("Festo MPYE-5-1/8", 700.0),
            ("MPYE-5-1/8-LF", 350.0),
            ("MPYE-5-M5", 100.0),
            ("MPYE-5-3/8", 2000.0),
        ] {
            let found = by_name(name).map(|one| one.nominal_flow_l_min);
            assert_eq!(found, Some(flow), "{name}");
        }
        assert!(by_name("VPPM-6L").is_none());
    }

    #[test]
    fn prop_areas_rise_to_the_nominal_flow() {
        let (opening_v, areas) = typical_areas(700.0, 0.29, 10.0);
        assert!(areas.windows(2).all(|pair| pair[1] >= pair[0]));
        assert!((opening_v[opening_v.len() - 1] - 10.0).abs() < 1e-12);
        assert!(
            (areas[areas.len() - 1] * 1e6 - 16.8).abs() < 0.2,
            "{areas:?}"
        );
    }
}
