//! `tube-line`: a tube between a valve port and a chamber.
//!
//! Cells in a row, each a volume of gas; between them, and from the last into
//! the chamber, the gas is a mass that the pressure difference accelerates
//! against wall friction.
//!
//! ```text
//! (V_t/N) p_i' = R T (m_(i-1) - m_i),            m_0 from the valve, V_t = A_t L
//! (L/(N A_t)) m_i' = p_i - p_(i+1) - k(m_i) m_i,  p_(N+1) the chamber's
//! k = (32 mu L / (N D^2 A_t rho)) max(1, 0.0049375 Re^(3/4)),  Re = 4 |m| / (pi D mu)
//!     + 1.5 |m| / (2 rho A_t^2)  in the last flow: mouths in and out
//! ```
//!
//! Isothermal: the wall of a narrow tube is near (a chamber's is not).
//! Laminar friction by Hagen and Poiseuille, turbulent by Blasius in the form
//! of Richer and Hurmuzlu; they meet at Re = 1190. A sharp mouth takes half a dynamic
//! head where gas enters and a whole one where it leaves: in 0.5 m of 4 mm that is half
//! of the friction, and without it a fit makes the tube 0.3 mm too narrow. rho is that
//! midway between two cells, upstream at the mouths: with the density of the cell
//! behind it the error of N cells falls with 1/N, with this four are as good as eight. Four cells: with the whole
//! volume at the valve a tube of 1.6 m is told apart from a distributed one by
//! several times the noise of a pressure sensor, and the dead volumes take half
//! of the tube's. Range 0.1-3 m of 3-8 mm. Confused with valve area, dead zone
//! and dead volume (84-92 % of it is absorbed by them), with delay and spool
//! lag; bursts at two piston positions separate them.
//!
//! Implicit in all pressures and flows at once, in quarters of a step: stable at
//! every length and step, and at 1 kHz its waves lose little by the scheme. Seen
//! from the valve the line is then a straight relation of the pressure at the port
//! to the flow into it, which the valve's law is met with by a tangent and a
//! secant: an open valve fills or empties the first cell within a quarter, so that
//! a law held at the pressure of the step's beginning would pass several times
//! what the valve can.

use crate::gas::Gas;
use crate::real::Real;

/// Dynamic viscosity of air at 293 K, Pa s (changes by 0.2 %/K, not by pressure).
const VISCOSITY_PA_S: f64 = 1.82e-5;
/// (32 / 0.158)^(4/3): Re from which friction is turbulent, and then over the laminar by
/// the 3/4th power of Re over this.
const TURBULENT_RE: f64 = 1_189.388_828_891_321;

/// Gas under less pressure than this has the density of this, Pa.
const LEAST_PRESSURE_PA: f64 = 1e3;

/// Dynamic heads lost at the mouths: 0.5 where the gas enters, 1 where it leaves.
const MOUTH_LOSS: f64 = 1.5;

/// Cells of a tube.
const CELLS: usize = 4;
/// Their length in all, in cells: the first is half of one, with its middle at
/// the valve, so that every other flow has half a cell on either side.
const LENGTH_CELLS: f64 = CELLS as f64 - 0.5;
/// Parts of a step.
const PARTS: usize = 4;
/// Below this share of the port's pressure a tangent is as good as a secant, and
/// the secant is rounding.
const SECANT_SHARE: f64 = 1e-4;

/// One tube; a length of 0 is neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeLine<R> {
    /// Length, m.
    pub length_m: R,
    /// Inner diameter, m.
    pub diameter_m: R,
}

/// Pressures of the cells and flows out of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeState<R> {
    /// Pressures from the valve's end on, Pa.
    pressures_pa: [R; CELLS],
    /// Flows towards the chamber, kg/s.
    mass_flows_kg_per_s: [R; CELLS],
}

/// What the line opens into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TubeEnd<R> {
    /// The chamber's pressure, Pa.
    pub pressure_pa: R,
    /// Its rise per mass let in, Pa/kg.
    pub pa_per_kg: R,
    /// What stands between tube and chamber, Pa s/kg; usually nothing.
    pub resistance_pa_s_per_kg: R,
}

impl<R: Real> TubeState<R> {
    /// Gas at rest.
    pub fn at_rest(pressure_pa: R) -> Self {
        Self {
            pressures_pa: [pressure_pa; CELLS],
            mass_flows_kg_per_s: [R::ZERO; CELLS],
        }
    }

    /// One flow all along, kg/s, and a pressure that falls evenly from the valve's end,
    /// so far over the chamber's, Pa.
    pub fn flowing(chamber_pa: R, over_pa: R, flow_kg_per_s: R) -> Self {
        let share = |cell: usize| R::from_f64(1.0 - cell as f64 / LENGTH_CELLS);
        Self {
            pressures_pa: core::array::from_fn(|cell| chamber_pa + over_pa * share(cell)),
            mass_flows_kg_per_s: [flow_kg_per_s; CELLS],
        }
    }

    /// Flow into the chamber, kg/s.
    pub fn flow_kg_per_s(&self) -> R {
        self.mass_flows_kg_per_s[CELLS - 1]
    }

    /// Pressure at the valve's end, Pa.
    #[inline]
    pub fn port_pa(&self) -> R {
        self.pressures_pa[0]
    }

    /// Mean pressure over the tube's volume, Pa.
    pub fn mean_pa(&self) -> R {
        let mut sum = -self.pressures_pa[0] * R::from_f64(0.5);
        for &pressure_pa in &self.pressures_pa {
            sum += pressure_pa;
        }
        sum / R::from_f64(LENGTH_CELLS)
    }

    /// Pressure at the chamber's end, Pa.
    #[inline]
    pub fn far_pa(&self) -> R {
        self.pressures_pa[CELLS - 1]
    }
}

impl<R: Real> TubeLine<R> {
    /// No tube; the diameter is that of the usual hose, ready for a fit.
    pub fn neutral() -> Self {
        Self {
            length_m: R::ZERO,
            diameter_m: R::from_f64(0.004),
        }
    }

    /// Whether there is a tube at all.
    #[inline]
    pub fn is_present(&self) -> bool {
        self.length_m > R::ZERO
    }

    /// Volume, m3.
    pub fn volume_m3(&self) -> R {
        self.area_m2() * self.length_m
    }

    /// How long a change takes from end to end, s; `specific` is R T of the gas.
    pub fn transit_s(&self, specific: R) -> R {
        self.length_m / specific.sqrt()
    }

    /// By how much the gas in the tube stands over the chamber's pressure, in the mean over its
    /// length, with one flow all along, Pa; `specific` is R T of the gas.
    pub fn steady_over_pa(&self, specific: R, chamber_pa: R, flow_kg_per_s: R) -> R {
        // A steady flow knows no step.
        let whole = self.line(specific, self.length_m, R::ONE);
        let half = R::from_f64(0.5) * whole.friction(flow_kg_per_s, chamber_pa);
        flow_kg_per_s * (half + whole.mouth_loss(flow_kg_per_s, chamber_pa))
    }

    /// Ready for steps of one length with cells of one length.
    fn line(&self, specific: R, cell_m: R, step_s: R) -> Line<R> {
        let area_m2 = self.area_m2();
        let viscosity_pa_s = R::from_f64(VISCOSITY_PA_S);
        let laminar = R::from_f64(32.0) * viscosity_pa_s * cell_m * specific;
        let turbulent_re = R::from_f64(TURBULENT_RE);
        Line {
            pa_per_flow: step_s * specific / (area_m2 * cell_m),
            inertia: cell_m / (area_m2 * step_s),
            laminar: laminar / (self.diameter_m * self.diameter_m * area_m2),
            turbulence_s_per_kg: self.diameter_m / (area_m2 * viscosity_pa_s * turbulent_re),
            mouths: R::from_f64(0.5 * MOUTH_LOSS) * specific / (area_m2 * area_m2),
        }
    }

    fn area_m2(&self) -> R {
        R::from_f64(core::f64::consts::FRAC_PI_4) * self.diameter_m * self.diameter_m
    }

    /// One step; returns what passed. `valve` is the flow through the valve at a
    /// pressure of the port.
    pub fn step(
        &self,
        state: &mut TubeState<R>,
        gas: &Gas<R>,
        temperature_k: R,
        valve: impl Fn(R) -> PortFlow<R>,
        chamber: &TubeEnd<R>,
        dt_s: R,
    ) -> Passed<R> {
        let specific = gas.gas_constant_j_per_kg_k * temperature_k;
        let cell_m = self.length_m * R::from_f64(1.0 / LENGTH_CELLS);
        let part = R::from_f64(1.0 / PARTS as f64);
        let part_s = dt_s * part;
        let line = self.line(specific, cell_m, part_s);
        let mut end = *chamber;
        let mut passed = Passed {
            into_chamber_kg_per_s: R::ZERO,
            supplied_kg_per_s: R::ZERO,
            exhausted_kg_per_s: R::ZERO,
        };
        for _ in 0..PARTS {
            let (supplied, exhausted) = line.step(state, &valve, &end, part_s);
            let out = state.mass_flows_kg_per_s[CELLS - 1];
            end.pressure_pa += part_s * end.pa_per_kg * out;
            passed.into_chamber_kg_per_s += part * out;
            passed.supplied_kg_per_s += part * supplied;
            passed.exhausted_kg_per_s += part * exhausted;
        }
        passed
    }
}

/// Flow through the valve at one pressure of its port.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PortFlow<R> {
    /// In from the supply, kg/s.
    pub supplied_kg_per_s: R,
    /// Out to the exhaust, kg/s.
    pub exhausted_kg_per_s: R,
    /// Slope of the first by the port's pressure, kg/(s Pa); never positive.
    pub supply_slope: R,
    /// Slope of the second; never negative.
    pub exhaust_slope: R,
}

impl<R: Real> PortFlow<R> {
    fn net(&self) -> R {
        self.supplied_kg_per_s - self.exhausted_kg_per_s
    }

    fn net_slope(&self) -> R {
        self.supply_slope - self.exhaust_slope
    }

    /// The same flow with the slopes to that at a pressure `apart_pa` from it; near
    /// by they are the slopes there.
    fn toward(self, other: &Self, apart_pa: R, pressure_pa: R) -> Self {
        if apart_pa.abs() <= pressure_pa.abs() * R::from_f64(SECANT_SHARE) {
            return self;
        }
        let slope = |from: R, to: R| (to - from) / apart_pa;
        Self {
            supply_slope: slope(self.supplied_kg_per_s, other.supplied_kg_per_s),
            exhaust_slope: slope(self.exhausted_kg_per_s, other.exhausted_kg_per_s),
            ..self
        }
    }
}

/// What a step of a tube comes to, each in the mean over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed<R> {
    /// Flow into the chamber, kg/s.
    pub into_chamber_kg_per_s: R,
    /// Flow from the supply into the tube, kg/s.
    pub supplied_kg_per_s: R,
    /// Flow from the tube to the exhaust, kg/s.
    pub exhausted_kg_per_s: R,
}

/// A tube made ready for steps of one length.
struct Line<R> {
    /// Rise of a cell's pressure over a step per flow into it, Pa s/kg.
    pa_per_flow: R,
    /// Pressure that a change of flow takes over a step, Pa s/kg.
    inertia: R,
    /// k of a cell where the flow is laminar, times the pressure, Pa2 s/kg.
    laminar: R,
    /// One over the flow at which it becomes turbulent, s/kg.
    turbulence_s_per_kg: R,
    /// What both mouths add to k, times the pressure and per flow, Pa2 s2/kg2.
    mouths: R,
}

/// A quantity as `at_rest + per * other`.
#[derive(Clone, Copy)]
struct Straight<R> {
    at_rest: R,
    per: R,
}

impl<R: Real> Straight<R> {
    const NONE: Self = Self {
        at_rest: R::ZERO,
        per: R::ZERO,
    };

    fn at(&self, other: R) -> R {
        self.at_rest + self.per * other
    }
}

impl<R: Real> Line<R> {
    /// One step; returns what came from the supply and went to the exhaust, kg/s.
    /// From the chamber towards the valve every flow is expressed by the rise of
    /// the pressure behind it, that rise by the flow before it; the valve closes
    /// the chain, and on the way back everything is known.
    fn step(
        &self,
        state: &mut TubeState<R>,
        valve: impl Fn(R) -> PortFlow<R>,
        end: &TubeEnd<R>,
        dt_s: R,
    ) -> (R, R) {
        // Rise of the pressure ahead over the step, by the flow towards it.
        let mut rise_ahead = Straight {
            at_rest: R::ZERO,
            per: dt_s * end.pa_per_kg + end.resistance_pa_s_per_kg,
        };
        let mut ahead_pa = end.pressure_pa;
        // Of every cell the flow out of it by its rise, and that by the flow into it.
        let mut cells = [(Straight::NONE, Straight::NONE); CELLS];
        for cell in (0..CELLS).rev() {
            let flow = state.mass_flows_kg_per_s[cell];
            let pressure_pa = state.pressures_pa[cell];
            let midway_pa = R::from_f64(0.5) * (pressure_pa + ahead_pa);
            let mut momentum_pa = self.inertia * flow;
            let mut resistance = self.inertia + self.friction(flow, midway_pa);
            if cell + 1 == CELLS {
                let half = R::from_f64(0.5);
                let upstream_pa = if flow < R::ZERO {
                    ahead_pa
                } else {
                    pressure_pa
                };
                momentum_pa = half * momentum_pa;
                resistance = half * resistance + self.mouth_loss(flow, upstream_pa);
            }
            let per = R::ONE / (resistance + rise_ahead.per);
            let driving_pa = pressure_pa - ahead_pa - rise_ahead.at_rest;
            let onward = Straight {
                at_rest: (momentum_pa + driving_pa) * per,
                per,
            };
            let rise = self.rise(cell);
            let per = rise / (R::ONE + rise * onward.per);
            rise_ahead = Straight {
                at_rest: -per * onward.at_rest,
                per,
            };
            ahead_pa = pressure_pa;
            cells[cell] = (onward, rise_ahead);
        }
        let (supplied, exhausted) = meet(valve, ahead_pa, &rise_ahead);
        let mut into = supplied - exhausted;
        for (cell, (onward, rise)) in cells.iter().enumerate() {
            let risen_pa = rise.at(into);
            into = onward.at(risen_pa);
            state.pressures_pa[cell] += risen_pa;
            state.mass_flows_kg_per_s[cell] = into;
        }
        (supplied, exhausted)
    }

    /// Rise of a cell's pressure over the step per flow into it, Pa s/kg.
    fn rise(&self, cell: usize) -> R {
        if cell == 0 {
            self.pa_per_flow + self.pa_per_flow
        } else {
            self.pa_per_flow
        }
    }

    /// What both mouths add to k of the last flow, Pa s/kg.
    fn mouth_loss(&self, flow_kg_per_s: R, upstream_pa: R) -> R {
        self.mouths * flow_kg_per_s.abs() / dense(upstream_pa)
    }

    /// k of a cell at its flow, Pa s/kg.
    fn friction(&self, flow_kg_per_s: R, pressure_pa: R) -> R {
        let laminar = self.laminar / dense(pressure_pa);
        let turbulence = flow_kg_per_s.abs() * self.turbulence_s_per_kg;
        if turbulence <= R::ONE {
            return laminar;
        }
        // To the 3/4th power.
        laminar * (turbulence * turbulence.sqrt()).sqrt()
    }
}

/// The pressure, where there is enough of it for gas to be dense.
fn dense<R: Real>(pressure_pa: R) -> R {
    pressure_pa.max(R::from_f64(LEAST_PRESSURE_PA))
}

/// Where the valve's law meets the line's `rise` of the port's pressure by the
/// flow into it: flow from the supply and to the exhaust. The law falls with that
/// pressure, so there is one such place; a tangent of it finds a place near by, a
/// secant to there keeps within what the valve passes between the two.
fn meet<R: Real>(valve: impl Fn(R) -> PortFlow<R>, port_pa: R, rise: &Straight<R>) -> (R, R) {
    let solve = |law: &PortFlow<R>| rise.at(law.net()) / (R::ONE - rise.per * law.net_slope());
    let first = valve(port_pa);
    let tangent_pa = solve(&first);
    let secant = first.toward(&valve(port_pa + tangent_pa), tangent_pa, port_pa);
    let risen_pa = solve(&secant);
    (
        secant.supplied_kg_per_s + secant.supply_slope * risen_pa,
        secant.exhausted_kg_per_s + secant.exhaust_slope * risen_pa,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const AMBIENT_K: f64 = 293.15;

    fn end<R: Real>(pressure_pa: R, pa_per_kg: R) -> TubeEnd<R> {
        TubeEnd {
            pressure_pa,
            pa_per_kg,
            resistance_pa_s_per_kg: R::ZERO,
        }
    }

    /// A flow that no pressure changes.
    fn given<R: Real>(flow_kg_per_s: R) -> impl Fn(R) -> PortFlow<R> {
        move |_| PortFlow {
            supplied_kg_per_s: flow_kg_per_s,
            exhausted_kg_per_s: R::ZERO,
            supply_slope: R::ZERO,
            exhaust_slope: R::ZERO,
        }
    }

    /// A valve that follows the pressure before it by a square root, with a straight
    /// piece of 1 kPa about nought.
    fn open_to(supply_pa: f64, size: f64) -> impl Fn(f64) -> PortFlow<f64> {
        const STRAIGHT_PA: f64 = 1e3;
        move |port_pa| {
            let apart = supply_pa - port_pa;
            let (supplied, slope) = if apart.abs() < STRAIGHT_PA {
                (apart / STRAIGHT_PA.sqrt(), 1.0 / STRAIGHT_PA.sqrt())
            } else {
                let root = apart.abs().sqrt();
                (root * apart.signum(), 0.5 / root)
            };
            PortFlow {
                supplied_kg_per_s: size * supplied,
                exhausted_kg_per_s: 0.0,
                supply_slope: -size * slope,
                exhaust_slope: 0.0,
            }
        }
    }

    fn tube(length_m: f64) -> TubeLine<f64> {
        TubeLine {
            length_m,
            diameter_m: 0.004,
        }
    }

    fn gas() -> Gas<f64> {
        Gas::new(1.4, 287.0)
    }

    #[test]
    fn val_steady_pressure_drop_of_one_metre_of_4_mm_tube() {
        // Typical: 61 kPa/m at 5 g/s, 3.7 kPa/m at 1 g/s (4 mm, about 6 bar).
        for (flow, expected) in [(1e-3, 3.7e3), (5e-3, 61e3)] {
            let mut state = TubeState::at_rest(6e5);
            for _ in 0..5000 {
                let end = end(5.25e5, 0.0);
                tube(1.0).step(&mut state, &gas(), AMBIENT_K, given(flow), &end, 1e-3);
            }
            let drop = state.port_pa() - 5.25e5;
            assert!((state.mass_flows_kg_per_s[CELLS - 1] - flow).abs() < 1e-8);
            assert!(
                (0.75..1.25).contains(&(drop / expected)),
                "{drop} at {flow}"
            );
        }
    }

    /// Poiseuille and Blasius, isothermal: p1^2 - p2^2 = 64 mu L R T m f / (D^2 A), with
    /// f = 1 or 0.158/32 Re^(3/4); before the chamber p2 (p2 - p) = 1.5 R T m^2 / (2 A^2)
    /// by the mouths.
    #[test]
    fn val_steady_flow_has_the_difference_of_the_squares() {
        for (flow, length_m, diameter_m, far_pa) in
            [(5e-5, 3.0, 0.003, 1e5), (5e-3, 1.0, 0.004, 3e5)]
        {
            let narrow = TubeLine {
                length_m,
                diameter_m,
            };
            let mut state = TubeState::at_rest(far_pa);
            let mut passed = None;
            for _ in 0..20_000 {
                let end = end(far_pa, 0.0);
                passed = Some(narrow.step(&mut state, &gas(), AMBIENT_K, given(flow), &end, 1e-3));
            }
            let passed = passed.expect("it has stepped");
            assert!((passed.into_chamber_kg_per_s / flow - 1.0).abs() < 1e-9);
            let area_m2 = core::f64::consts::FRAC_PI_4 * diameter_m * diameter_m;
            let specific = 287.0 * AMBIENT_K;
            let reynolds = flow * diameter_m / (area_m2 * VISCOSITY_PA_S);
            let turbulent = (0.158 / 32.0 * reynolds.powf(0.75)).max(1.0);
            let squares = 64.0 * VISCOSITY_PA_S * length_m * specific * flow * turbulent
                / (diameter_m * diameter_m * area_m2);
            let mouths = 0.75 * specific * (flow / area_m2).powi(2);
            let mouth_pa = 0.5 * (far_pa + (far_pa * far_pa + 4.0 * mouths).sqrt());
            let expected = (mouth_pa * mouth_pa + squares).sqrt() - far_pa;
            let drop = state.port_pa() - far_pa;
            // The mouth sees the density of the last half cell.
            assert!((drop / expected - 1.0).abs() < 5e-3, "{drop} {expected}");
        }
    }

    #[test]
    fn val_a_steady_flow_stands_over_the_chamber_by_the_known_mean() {
        for (flow, length_m) in [(1e-4, 0.5), (4e-4, 1.5), (2e-3, 3.0), (-4e-4, 1.5)] {
            let mut state = TubeState::at_rest(5e5);
            for _ in 0..5000 {
                let end = end(5e5, 0.0);
                tube(length_m).step(&mut state, &gas(), AMBIENT_K, given(flow), &end, 1e-3);
            }
            let over_pa = state.mean_pa() - 5e5;
            let expected_pa = tube(length_m).steady_over_pa(287.0 * AMBIENT_K, 5e5, flow);
            // With the density of the chamber all along.
            let ratio = over_pa / expected_pa;
            assert!((0.9..1.1).contains(&ratio), "{over_pa} {expected_pa}");
        }
    }

    /// Seconds between the rises of a closed end's pressure through its final value.
    fn period_s(dt_s: f64) -> f64 {
        // 2 m of a tube so wide that friction hardly damps, its port held at a
        // pressure, its far end shut: the pressure there swings at c_T / (4 L).
        let wide = TubeLine {
            length_m: 2.0,
            diameter_m: 0.02,
        };
        let held = |port_pa: f64| PortFlow {
            supplied_kg_per_s: 1.0 * (5.01e5 - port_pa),
            exhausted_kg_per_s: 0.0,
            supply_slope: -1.0,
            exhaust_slope: 0.0,
        };
        let shut = TubeEnd {
            resistance_pa_s_per_kg: 1e15,
            ..end(5e5, 0.0)
        };
        let mut state = TubeState::at_rest(5e5);
        let (mut rises_s, mut before) = ([0.0; 3], -1.0);
        let (mut count, mut time_s) = (0, 0.0);
        while count < 3 {
            wide.step(&mut state, &gas(), AMBIENT_K, held, &shut, dt_s);
            time_s += dt_s;
            let now = state.far_pa() - 5.01e5;
            if before < 0.0 && now >= 0.0 {
                rises_s[count] = time_s - dt_s * now / (now - before);
                count += 1;
            }
            before = now;
        }
        0.5 * (rises_s[2] - rises_s[0])
    }

    #[test]
    fn val_a_shut_line_swings_as_a_quarter_wave() {
        let sound_m_per_s = (287.0 * AMBIENT_K).sqrt();
        let expected_s = 4.0 * 2.0 / sound_m_per_s;
        for dt_s in [1e-3, 1e-4] {
            let ratio = period_s(dt_s) / expected_s;
            assert!((ratio - 1.0).abs() < 0.02, "{ratio} at {dt_s}");
        }
    }

    #[test]
    fn prop_what_enters_is_in_the_tube_or_the_chamber() {
        for length_m in [0.05, 0.5, 3.0] {
            let tube = tube(length_m);
            let mut state = TubeState::at_rest(3e5);
            let inventory = |state: &TubeState<f64>| {
                let area_m2 = core::f64::consts::FRAC_PI_4 * 1.6e-5;
                state.mean_pa() * area_m2 * length_m / (287.0 * AMBIENT_K)
            };
            let begin_kg = inventory(&state);
            let (mut in_kg, mut out_kg) = (0.0, 0.0);
            for step in 0..400 {
                let supply_pa = if (step / 40) % 2 == 0 { 7e5 } else { 1e5 };
                let valve = open_to(supply_pa, 3e-5);
                let end = end(4e5, 1e9);
                let passed = tube.step(&mut state, &gas(), AMBIENT_K, valve, &end, 1e-3);
                in_kg += 1e-3 * (passed.supplied_kg_per_s - passed.exhausted_kg_per_s);
                out_kg += 1e-3 * passed.into_chamber_kg_per_s;
            }
            let missing = begin_kg + in_kg - out_kg - inventory(&state);
            assert!(missing.abs() < 1e-12 * begin_kg, "{missing} of {begin_kg}");
        }
    }

    #[test]
    fn prop_a_valve_passes_no_more_than_its_law_between_the_pressures() {
        // From empty to open within one step, in tubes of every size: never more
        // than at the lowest port pressure, never beyond the supply by much.
        for length_m in [0.02, 0.3, 3.0] {
            for diameter_m in [0.003, 0.008] {
                let tube = TubeLine {
                    length_m,
                    diameter_m,
                };
                let mut state = TubeState::at_rest(1e5);
                let most = 3e-5 * 6e5_f64.sqrt();
                for _ in 0..5 {
                    let end = end(1e5, 1e8);
                    let valve = open_to(7e5, 3e-5);
                    let passed = tube.step(&mut state, &gas(), AMBIENT_K, valve, &end, 1e-3);
                    let flow = passed.supplied_kg_per_s;
                    assert!(flow < 1.02 * most, "{flow} of {most}, {length_m} m");
                    assert!(state.port_pa() < 7.05e5, "{}", state.port_pa());
                }
            }
        }
    }

    #[test]
    fn val_finer_steps_come_to_the_same_end_in_first_order() {
        // A pulse through the valve into a chamber: pressures after 100 ms.
        let after = |per_ms: u32| {
            let dt_s = 1e-3 / f64::from(per_ms);
            let mut state = TubeState::at_rest(3e5);
            let (mut chamber_pa, per_kg) = (3e5, 1.4 * 287.0 * AMBIENT_K / 1e-4);
            for step in 0..100 * per_ms {
                let time_s = f64::from(step) * dt_s;
                let size = 3e-6 * libm::sin(30.0 * time_s);
                let end = end(chamber_pa, per_kg);
                let valve = open_to(7e5, size);
                let passed = tube(1.0).step(&mut state, &gas(), AMBIENT_K, valve, &end, dt_s);
                chamber_pa += per_kg * passed.into_chamber_kg_per_s * dt_s;
            }
            [chamber_pa, state.port_pa(), state.far_pa()]
        };
        let ends = [1, 2, 4, 8, 64].map(after);
        for (signal, exact) in ends[4].iter().enumerate() {
            let errors = [0, 3].map(|i: usize| (ends[i][signal] - exact).abs());
            assert!(errors[1] < 0.25 * errors[0], "signal {signal}: {errors:?}");
            assert!(errors[0] < 0.002 * exact, "signal {signal}: {errors:?}");
        }
        // Of first order, where no wave stands out.
        let errors = [1, 2].map(|i: usize| (ends[i][0] - ends[4][0]).abs());
        let order = (errors[0] / errors[1]).log2();
        assert!((order - 1.0).abs() < 0.3, "order {order}: {errors:?}");
    }

    #[test]
    fn prop_stable_from_a_millimetre_to_ten_metres() {
        let gas = Gas::new(1.4_f32, 287.0);
        for length_m in [1e-3_f32, 0.02, 0.5, 10.0] {
            let tube = TubeLine {
                length_m,
                diameter_m: 0.004,
            };
            let mut state = TubeState::at_rest(5e5);
            let mut chamber = 5e5_f32;
            let per_kg = 1.4 * 287.0 * 293.0 / 2e-5;
            for step in 0..2000 {
                let valve = if (step / 50) % 2 == 0 { 5e-3 } else { -5e-3 };
                let end = end(chamber, per_kg);
                let passed = tube.step(&mut state, &gas, 293.15, given(valve), &end, 1e-3);
                chamber += per_kg * passed.into_chamber_kg_per_s * 1e-3;
                assert!(state.port_pa().is_finite() && chamber.abs() < 2e7);
            }
        }
    }

    #[test]
    fn prop_gas_at_rest_stays_to_the_bit() {
        let gas = Gas::new(1.4_f32, 287.0);
        let tube = TubeLine {
            length_m: 0.7_f32,
            diameter_m: 0.004,
        };
        let mut state = TubeState::at_rest(512_345.67);
        let begin = state;
        for _ in 0..1000 {
            let end = end(512_345.67, 1e9);
            tube.step(&mut state, &gas, 293.15, given(0.0), &end, 1e-3);
        }
        assert_eq!(state, begin);
    }
}
