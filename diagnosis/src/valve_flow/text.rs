//! A measured valve as terminal text.

use std::fmt;

use super::ValveFlow;
use crate::text::Columns;

impl fmt::Display for ValveFlow {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(out, "valve flow")?;
        let [dead_a_cm3, dead_b_cm3] = self.dead_volume_m3.map(|volume_m3| 1e6 * volume_m3);
        writeln!(
            out,
            "  null {:.3} V, opening {:.1} ms later than the command, critical pressure ratio {:.2}",
            self.null_v,
            1e3 * self.lag_s,
            self.critical_pressure_ratio
        )?;
        writeln!(
            out,
            "  dead volume of chamber A {dead_a_cm3:.1} cm3, of chamber B {dead_b_cm3:.1} cm3"
        )?;
        if self.piston_leak_m2 > 0.0 {
            writeln!(
                out,
                "  beside the valve {:.4} mm2 of leak past the piston: `pneuma diagnose` says whether it matters",
                1e6 * self.piston_leak_m2
            )?;
        }
        writeln!(out, "  areas, ± one standard deviation of each point:")?;
        let mut columns = Columns::new(4, &["opening, V", "supply, mm2", "±", "exhaust, mm2", "±"]);
        for point in self.table() {
            let [supply, exhaust] = point.area_m2.map(|area_m2| format!("{:.4}", 1e6 * area_m2));
            let [of_supply, of_exhaust] = point
                .deviation_m2
                .map(|area_m2| format!("{:.4}", 1e6 * area_m2));
            columns.row([
                format!("{:.3}", point.opening_v),
                supply,
                of_supply,
                exhaust,
                of_exhaust,
            ]);
        }
        write!(out, "{columns}")?;
        if let Some(last) = self.points.last() {
            writeln!(
                out,
                "  the recordings open the valve to {:.2} V; beyond, the curve of the rig file goes on from there",
                last.opening_v
            )?;
        }
        writeln!(
            out,
            "  beside this, both areas as a whole are known to {:.0} %",
            100.0 * super::points::AREA_DEVIATION
        )
    }
}
