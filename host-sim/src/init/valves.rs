//! Proportional valves by type.
//!
//! Nominal flows are those of the manufacturer's catalogue as remembered; no data sheet was at hand
//! when they were written down. A rig file made from them says so and gives them 30 %.

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
/// Opening up to which the closed paths stay closed, V: 0.2 to 0.5 occurs.
pub(super) const TYPICAL_DEAD_ZONE_V: f64 = 0.3;
/// The laminar limit of the model; it hardly shows in motion.
pub(super) const TYPICAL_LAMINAR_RATIO: f64 = 0.98;

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
}
