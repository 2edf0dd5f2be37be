//! Flow numbers of ISO 6358 and those of a data sheet, from measured flows.
//!
//! ```text
//! m' = C rho0 p1 sqrt(T0/T1) phi(r)         rho0 = 1.185 kg/m3, T0 = 293.15 K (ANR)
//! phi = 1 up to b, (1 - ((r - b)/(1 - b))^2)^m beyond
//! ```
//!
//! C, b and m of a path are fitted to its flows at one opening where these span the ratios;
//! without such flows C follows from the area by the b of the law, and b and m are not known.

use grey_box::fit::Parameter;
use grey_box::units::{ANR_DENSITY_KG_M3, ANR_TEMPERATURE_K};
use model_core::valve::FlowLaw;

use crate::flow_point::FlowPoint;
use crate::least_squares::fitted;
use crate::outcome::Number;

/// Points from which three numbers are fitted.
pub(crate) const LEAST_POINTS: usize = 5;
/// Litres per minute in a cubic metre per second.
const L_MIN_PER_M3_S: f64 = 60_000.0;

/// A mass flow as a volume flow at the ANR reference, l/min.
pub fn flow_l_min(flow_kg_per_s: f64) -> f64 {
    flow_kg_per_s / ANR_DENSITY_KG_M3 * L_MIN_PER_M3_S
}

/// The flow of a path of these numbers, kg/s.
fn flow_kg_per_s(
    [conductance, b, m]: [f64; 3],
    upstream_pa: f64,
    upstream_k: f64,
    ratio: f64,
) -> f64 {
    let beyond = ((ratio - b) / (1.0 - b)).max(0.0);
    let phi = (1.0 - beyond * beyond).max(0.0).powf(m);
    conductance * ANR_DENSITY_KG_M3 * upstream_pa * (ANR_TEMPERATURE_K / upstream_k).sqrt() * phi
}

/// C, b and m of the flows of one path, and its nominal flow from 6 to 5 bar gauge.
pub(crate) fn numbers(path: &[(FlowPoint, f64)], law: &FlowLaw<f64>) -> Vec<Number> {
    let Some((first, area_m2)) = path.first() else {
        return Vec::new();
    };
    let at = format!("at {:.2} V", first.command_v);
    let [conductance, b, m] = ["C", "b", "m"].map(|name| format!("ISO 6358 {name} {at}"));
    let rows: Vec<(f64, f64, f64, f64, f64)> = path
        .iter()
        .map(|(one, _)| {
            let upstream = if one.is_fed() {
                (one.supply_pa, one.supply_k)
            } else {
                (one.port_pa, one.port_k)
            };
            (
                upstream.0,
                upstream.1,
                one.ratio(),
                one.flow_kg_per_s.abs(),
                one.deviation_kg_per_s,
            )
        })
        .collect();
    let discharge = law.choked_discharge();
    let from_area =
        area_m2 * discharge * law.flow_coefficient / (ANR_DENSITY_KG_M3 * ANR_TEMPERATURE_K.sqrt());
    let residuals = |numbers: &[f64]| -> Vec<f64> {
        let numbers = [numbers[0] * from_area, numbers[1], numbers[2]];
        rows.iter()
            .map(|row| (row.3 - flow_kg_per_s(numbers, row.0, row.1, row.2)) / row.4)
            .collect()
    };
    let parameters = [
        Parameter::new(1.0).bounded(0.5, 2.0),
        Parameter::new(law.critical_pressure_ratio).bounded(0.02, 0.8),
        Parameter::new(0.5).bounded(0.2, 1.5),
    ];
    let c_number = |value: (f64, f64)| {
        Number::named("iso_C_m3_s_Pa", &conductance, "m3/(s Pa)", value).shown_in("l/(s bar)", 1e8)
    };
    let fit = fitted(&parameters, &residuals).ok();
    match fit.filter(|_| path.len() >= LEAST_POINTS) {
        Some(fit) if fit.deviations.iter().all(|one| one.is_finite()) => vec![
            c_number((fit.values[0] * from_area, fit.deviations[0] * from_area)),
            Number::named("iso_b", &b, "1", fit.at(1)),
            Number::named("iso_m", &m, "1", fit.at(2)),
        ],
        _ => {
            let share = rows
                .iter()
                .map(|row| row.4 / row.3)
                .fold(f64::INFINITY, f64::min);
            let of_stated = format!("{conductance}, with b = {:.2}", law.critical_pressure_ratio);
            let value = (from_area, from_area * share);
            let number = Number::named("iso_C_m3_s_Pa", &of_stated, "m3/(s Pa)", value);
            vec![number.shown_in("l/(s bar)", 1e8)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A path of C = 1 l/(s bar) passes 7.013 l/s choked from 6 bar gauge, 420.8 l/min.
    #[test]
    fn val_a_conductance_is_the_choked_flow_per_pressure() {
        let flow = flow_kg_per_s([1e-8, 0.3, 0.5], 7.013e5, 293.15, 0.2);
        assert!((flow_l_min(flow) - 420.78).abs() < 0.01);
    }
}
