//! Dry air as a perfect gas, held as mass and internal energy, and its flow
//! through a restriction.
//!
//! The state of a volume is what is conserved, mass and energy; pressure and
//! temperature follow: `p = (gamma - 1) U / V`, `T = U / (m c_v)`.

/// Ratio of the specific heats.
pub const HEAT_RATIO: f64 = 1.4;
/// Specific gas constant, J/(kg K).
pub const GAS_CONSTANT: f64 = 287.0;
/// Specific heat at constant volume, J/(kg K).
pub(crate) const HEAT_AT_CONSTANT_VOLUME: f64 = GAS_CONSTANT / (HEAT_RATIO - 1.0);
/// Specific heat at constant pressure, J/(kg K).
pub(crate) const HEAT_AT_CONSTANT_PRESSURE: f64 = HEAT_AT_CONSTANT_VOLUME * HEAT_RATIO;
/// Dynamic viscosity of air at 293 K, Pa s (Sutherland's formula).
pub(crate) const VISCOSITY_PA_S: f64 = 1.81e-5;
/// Conductivity of heat of air at 293 K, W/(m K).
pub(crate) const CONDUCTIVITY_W_PER_M_K: f64 = 0.0257;

/// Choked mass flow through a nozzle is this times area, pressure and the
/// inverse root of the temperature: `sqrt(gamma / R) (2 / (gamma + 1))^k` with
/// `k = (gamma + 1) / (2 (gamma - 1)) = 3`. In s K^0.5 / m.
pub(crate) fn choked_coefficient() -> f64 {
    let ratio = 2.0 / (HEAT_RATIO + 1.0);
    (HEAT_RATIO / GAS_CONSTANT).sqrt() * ratio * ratio * ratio
}

/// What a volume holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Content {
    /// Mass of the gas.
    pub mass_kg: f64,
    /// Its internal energy, zero at 0 K.
    pub energy_j: f64,
}

impl Content {
    /// The content of a volume at a pressure and temperature.
    pub fn filled(volume_m3: f64, state: Node) -> Self {
        let energy_j = state.pressure_pa * volume_m3 / (HEAT_RATIO - 1.0);
        Self {
            mass_kg: energy_j / (HEAT_AT_CONSTANT_VOLUME * state.temperature_k),
            energy_j,
        }
    }

    /// Pressure and temperature in that volume.
    pub fn state(&self, volume_m3: f64) -> Node {
        Node {
            pressure_pa: (HEAT_RATIO - 1.0) * self.energy_j / volume_m3,
            temperature_k: self.energy_j / (self.mass_kg * HEAT_AT_CONSTANT_VOLUME),
        }
    }

    pub(crate) fn advanced(self, rate: Self, time_s: f64) -> Self {
        Self {
            mass_kg: self.mass_kg + time_s * rate.mass_kg,
            energy_j: self.energy_j + time_s * rate.energy_j,
        }
    }

    /// Adds a stream that enters (or leaves, if its mass flow is negative).
    pub(crate) fn receive(&mut self, stream: Stream) {
        self.mass_kg += stream.mass_kg_per_s;
        self.energy_j += stream.enthalpy_w;
    }

    pub(crate) fn give(&mut self, stream: Stream) {
        self.mass_kg -= stream.mass_kg_per_s;
        self.energy_j -= stream.enthalpy_w;
    }
}

/// Pressure and temperature at one end of a restriction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Absolute pressure.
    pub pressure_pa: f64,
    /// Temperature of the gas.
    pub temperature_k: f64,
}

impl Node {
    pub(crate) fn density_kg_per_m3(&self) -> f64 {
        self.pressure_pa / (GAS_CONSTANT * self.temperature_k)
    }
}

/// Gas on its way, with the enthalpy of the side that it comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stream {
    /// Mass flow; negative if it runs backwards.
    pub mass_kg_per_s: f64,
    /// Flow of enthalpy.
    pub enthalpy_w: f64,
}

impl Stream {
    /// The stream of that mass flow between two nodes.
    pub(crate) fn between(mass_kg_per_s: f64, from: Node, to: Node) -> Self {
        let source = if mass_kg_per_s >= 0.0 { from } else { to };
        Self {
            mass_kg_per_s,
            enthalpy_w: mass_kg_per_s * HEAT_AT_CONSTANT_PRESSURE * source.temperature_k,
        }
    }
}

/// How the flow through a restriction depends on the pressure ratio: an
/// ellipse between the critical ratio and the laminar one, a straight line
/// from there to 1 (ISO 6358 with the seed paper's linear end), times a
/// discharge coefficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowShape {
    /// Pressure ratio below which the flow is choked.
    pub critical_ratio: f64,
    /// Pressure ratio above which the flow is proportional to the difference.
    pub laminar_ratio: f64,
    /// The discharge coefficient: constant, linear and quadratic term in the pressure ratio.
    pub discharge: [f64; 3],
}

/// The discharge coefficient of the paper, (2).
pub const PAPER_DISCHARGE: [f64; 3] = [0.8153, 0.0933, -0.1038];

impl FlowShape {
    /// Flow relative to the choked one.
    fn fraction(&self, ratio: f64) -> f64 {
        if ratio <= self.critical_ratio {
            return 1.0;
        }
        let ellipse = |ratio: f64| {
            let depth = (ratio - self.critical_ratio) / (1.0 - self.critical_ratio);
            (1.0 - depth * depth).sqrt()
        };
        if ratio < self.laminar_ratio {
            ellipse(ratio)
        } else {
            ellipse(self.laminar_ratio) * (1.0 - ratio) / (1.0 - self.laminar_ratio)
        }
    }

    /// The stream through an area from one node to another; it turns round
    /// with the pressures.
    pub fn stream(&self, area_m2: f64, from: Node, to: Node) -> Stream {
        let forwards = from.pressure_pa >= to.pressure_pa;
        let (high, low) = if forwards { (from, to) } else { (to, from) };
        let ratio = (low.pressure_pa / high.pressure_pa).max(0.0);
        let [constant, linear, quadratic] = self.discharge;
        let discharge = constant + ratio * (linear + ratio * quadratic);
        let size = area_m2 * discharge * choked_coefficient() * high.pressure_pa
            / high.temperature_k.sqrt()
            * self.fraction(ratio);
        Stream::between(if forwards { size } else { -size }, from, to)
    }
}

/// A leak: a small orifice, a laminar gap, or both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Leak {
    /// Area of the orifice.
    pub orifice_m2: f64,
    /// Mass flow of the gap over the difference of the squared pressures.
    pub laminar_kg_per_s_pa2: f64,
}

impl Leak {
    /// The stream from one node to the other.
    pub fn stream(&self, shape: &FlowShape, from: Node, to: Node) -> Stream {
        let orifice = if self.orifice_m2 > 0.0 {
            shape.stream(self.orifice_m2, from, to).mass_kg_per_s
        } else {
            0.0
        };
        let gap = self.laminar_kg_per_s_pa2
            * (from.pressure_pa * from.pressure_pa - to.pressure_pa * to.pressure_pa);
        Stream::between(orifice + gap, from, to)
    }
}
