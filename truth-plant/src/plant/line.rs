//! A tube between the valve's port and the chamber, as finite volumes: each
//! cell holds mass and energy, each face carries a mass flow with inertia and
//! friction.
//!
//! ```text
//! valve -> cell 0 | cell 1 | ... | cell n-1 | chamber
//!                 w0       w1              w(n-1)
//! (dx / A) dw/dt = p_left - p_right - friction(w)
//! ```
//!
//! Friction per face is the larger of Poiseuille's and Blasius' law; the last
//! face adds the loss of an entry and an exit. Heat goes to a tube wall at
//! ambient temperature (3.66 and, moving, the
//! analogy of Chilton and Colburn to the friction). Neglected: the flux of
//! momentum (of the order of the entry loss) and the elasticity of the tube.

use super::gas::{CONDUCTIVITY_W_PER_M_K, Content, Node, Stream, VISCOSITY_PA_S};

/// Most cells of a line.
pub const CELLS: usize = 12;
/// A cell is not made shorter than about this: the flow of the open valve into
/// a smaller one is too stiff for the step.
const CELL_LENGTH_M: f64 = 0.15;
/// Entry 0.5 and exit 1, in dynamic heads.
const END_LOSS: f64 = 1.5;

/// A tube; both ports have one alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    length_m: f64,
    diameter_m: f64,
    cells: usize,
    area_m2: f64,
    cell_length_m: f64,
    cell_volume_m3: f64,
    /// Heat per kelvin of a cell without flow, and what the root of the
    /// root of its Reynolds number cubed adds.
    still_w_per_k: f64,
    moving_w_per_k: f64,
}

/// What a line holds. The first [`Line::cells`] entries count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineState {
    /// The gas of each cell.
    pub cells: [Content; CELLS],
    /// Mass flow from each cell to the next, from the last to the chamber.
    pub flow_kg_per_s: [f64; CELLS],
}

/// Nusselt number of laminar flow in a tube of constant temperature.
const STILL_NUSSELT: f64 = 3.66;
/// Blasius' friction factor is this over the fourth root of the Reynolds number.
const BLASIUS: f64 = 0.3164;
/// Root of the third degree of the Prandtl number of air, 0.71.
const PRANDTL_ROOT: f64 = 0.892;

impl Line {
    /// A tube of that length and inner diameter.
    pub fn new(length_m: f64, diameter_m: f64) -> Self {
        let wanted = libm::round(length_m / CELL_LENGTH_M) as usize;
        let cells = wanted.clamp(3, CELLS);
        let area_m2 = 0.25 * core::f64::consts::PI * diameter_m * diameter_m;
        let cell_length_m = length_m / cells as f64;
        // k / D times the surface pi D dx.
        let per_nusselt_w_per_k = CONDUCTIVITY_W_PER_M_K * core::f64::consts::PI * cell_length_m;
        Self {
            length_m,
            diameter_m,
            cells,
            area_m2,
            cell_length_m,
            cell_volume_m3: area_m2 * cell_length_m,
            still_w_per_k: STILL_NUSSELT * per_nusselt_w_per_k,
            // Chilton and Colburn: Nu = f / 8 Re Pr^(1/3).
            moving_w_per_k: BLASIUS / 8.0 * PRANDTL_ROOT * per_nusselt_w_per_k,
        }
    }

    /// Its length.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// How many cells it has.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Volume of a cell.
    pub fn cell_volume_m3(&self) -> f64 {
        self.cell_volume_m3
    }

    /// All cells at one state, nothing flowing.
    pub fn filled(&self, state: Node) -> LineState {
        LineState {
            cells: [Content::filled(self.cell_volume_m3, state); CELLS],
            flow_kg_per_s: [0.0; CELLS],
        }
    }

    /// The fourth root of the Reynolds number.
    fn reynolds_root(&self, flow_kg_per_s: f64) -> f64 {
        let reynolds = flow_kg_per_s.abs() * self.diameter_m / (self.area_m2 * VISCOSITY_PA_S);
        reynolds.sqrt().sqrt()
    }

    /// Pressure lost along one cell's length, with the sign of the flow.
    pub fn friction_pa(&self, flow_kg_per_s: f64, density_kg_per_m3: f64) -> f64 {
        let root = self.reynolds_root(flow_kg_per_s);
        let speed_m_per_s = flow_kg_per_s / (density_kg_per_m3 * self.area_m2);
        self.friction_with_root_pa(root, speed_m_per_s, density_kg_per_m3)
    }

    fn friction_with_root_pa(&self, root: f64, speed_m_per_s: f64, density_kg_per_m3: f64) -> f64 {
        let slimness = self.cell_length_m / self.diameter_m;
        let laminar_pa = 32.0 * VISCOSITY_PA_S * speed_m_per_s / self.diameter_m * slimness;
        let turbulent_pa = BLASIUS * slimness * head_pa(speed_m_per_s, density_kg_per_m3) / root;
        // The curves cross at a Reynolds number of 1188; without flow, 0 / 0.
        if turbulent_pa.abs() > laminar_pa.abs() {
            turbulent_pa
        } else {
            laminar_pa
        }
    }

    /// The rates of the cells and faces, the stream into the chamber and the
    /// heat taken from the tube's wall, in W.
    pub(crate) fn rates(
        &self,
        state: &LineState,
        wall_k: f64,
        chamber: Node,
        outlet_m2: f64,
    ) -> (LineState, Stream, f64) {
        let mut rate = LineState::default();
        let mut heat_w = 0.0;
        let mut into_chamber = Stream::default();
        let mut here = state.cells[0].state(self.cell_volume_m3);
        for cell in 0..self.cells {
            let last = cell + 1 == self.cells;
            let next = if last {
                chamber
            } else {
                state.cells[cell + 1].state(self.cell_volume_m3)
            };
            let flow = state.flow_kg_per_s[cell];
            let density = if flow >= 0.0 { here } else { next }.density_kg_per_m3();
            let speed = flow / (density * self.area_m2);
            let root = self.reynolds_root(flow);
            let mut loss_pa = self.friction_with_root_pa(root, speed, density);
            let mut inertia_m = self.cell_length_m;
            if last {
                // From the middle of the last cell to the mouth it is half a
                // cell; its friction stands for that of the first half as well.
                inertia_m *= 0.5;
                loss_pa += END_LOSS * head_pa(speed, density);
                loss_pa += orifice_loss_pa(flow, density, outlet_m2);
            }
            rate.flow_kg_per_s[cell] =
                self.area_m2 / inertia_m * (here.pressure_pa - next.pressure_pa - loss_pa);
            let stream = Stream::between(flow, here, next);
            rate.cells[cell].give(stream);
            if last {
                into_chamber = stream;
            } else {
                rate.cells[cell + 1].receive(stream);
            }
            let conductance = self.still_w_per_k + self.moving_w_per_k * root * root * root;
            let warming_w = conductance * (wall_k - here.temperature_k);
            rate.cells[cell].energy_j += warming_w;
            heat_w += warming_w;
            here = next;
        }
        (rate, into_chamber, heat_w)
    }
}

impl Default for LineState {
    fn default() -> Self {
        Self {
            cells: [Content::default(); CELLS],
            flow_kg_per_s: [0.0; CELLS],
        }
    }
}

impl LineState {
    pub(crate) fn advanced(&self, rate: &Self, cells: usize, time_s: f64) -> Self {
        let mut next = *self;
        for cell in 0..cells {
            next.cells[cell] = self.cells[cell].advanced(rate.cells[cell], time_s);
            next.flow_kg_per_s[cell] += time_s * rate.flow_kg_per_s[cell];
        }
        next
    }
}

/// Dynamic head with the sign of the speed.
fn head_pa(speed_m_per_s: f64, density_kg_per_m3: f64) -> f64 {
    0.5 * density_kg_per_m3 * speed_m_per_s * speed_m_per_s.abs()
}

/// Loss of a narrow passage at the chamber's end; an infinite area has none.
fn orifice_loss_pa(flow_kg_per_s: f64, density_kg_per_m3: f64, area_m2: f64) -> f64 {
    const DISCHARGE: f64 = 0.82;
    let speed = flow_kg_per_s / (density_kg_per_m3 * DISCHARGE * area_m2);
    head_pa(speed, density_kg_per_m3)
}
