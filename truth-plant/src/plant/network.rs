//! The gas of the whole axis: chambers, tubes, tank and silencer as mass and
//! energy, joined by streams, advanced by the midpoint rule.
//!
//! Everything that crosses the boundary is integrated beside the states by the
//! same rule, so mass and energy close to rounding ([`Ledger`]).

use super::gas::{Content, FlowShape, Leak, Node, Stream};
use super::heat::{Heat, Wall};
use super::line::{Line, LineState};
use super::valve::Paths;

/// The cylinder's geometry; `+x` enlarges chamber a, `x = 0` is mid-stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Full stroke.
    pub stroke_m: f64,
    /// Bore, for the surface that exchanges heat.
    pub bore_m: f64,
    /// Piston areas.
    pub area_m2: [f64; 2],
    /// Dead volumes.
    pub dead_volume_m3: [f64; 2],
}

/// Direction in which each chamber grows.
pub(crate) const GROWS: [f64; 2] = [1.0, -1.0];

impl Cylinder {
    fn length_m(&self, chamber: usize, position_m: f64) -> f64 {
        0.5 * self.stroke_m + GROWS[chamber] * position_m
    }

    /// Volume of a chamber.
    pub fn volume_m3(&self, chamber: usize, position_m: f64) -> f64 {
        self.dead_volume_m3[chamber] + self.area_m2[chamber] * self.length_m(chamber, position_m)
    }

    /// Both end faces and the bore along the chamber's length.
    pub fn surface_m2(&self, chamber: usize, position_m: f64) -> f64 {
        2.0 * self.area_m2[chamber]
            + core::f64::consts::PI * self.bore_m * self.length_m(chamber, position_m)
    }
}

/// Where the valve's supply comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply {
    /// Pressure that the regulator is set to.
    pub pressure_pa: f64,
    /// A tank that the regulator fills; without one the pressure is constant.
    pub tank: Option<Tank>,
    /// Oscillation of the regulated pressure: relative amplitude.
    pub ripple: f64,
    /// Its frequency.
    pub ripple_hz: f64,
}

/// A tank between regulator and valve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tank {
    /// Volume.
    pub volume_m3: f64,
    /// Regulator as an orifice of this area that does not flow back.
    pub feed_area_m2: f64,
    /// Regulator that opens in proportion to the missing pressure, in place of
    /// the orifice.
    pub feed_kg_per_s_pa: f64,
}

/// A silencer: a volume that both ports exhaust into, and an orifice to the
/// surroundings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Silencer {
    /// Volume.
    pub volume_m3: f64,
    /// Area of its outlet.
    pub area_m2: f64,
}

/// A cushion: over the last stretch of the stroke the chamber that shrinks
/// empties through a needle; it fills freely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cushion {
    /// Length of the stretch.
    pub length_m: f64,
    /// Area of the needle.
    pub needle_m2: f64,
}

/// Stroke over which a cushion's seal closes.
const CUSHION_CLOSING_M: f64 = 1e-3;
/// Stands for a passage that does not restrict.
const OPEN_M2: f64 = 1e-2;

impl Cushion {
    /// Area that lets gas out of a chamber of this free length.
    fn outlet_m2(&self, length_m: f64) -> f64 {
        let free = ((length_m - self.length_m) / CUSHION_CLOSING_M).clamp(0.0, 1.0);
        self.needle_m2 + free * free * (OPEN_M2 - self.needle_m2)
    }
}

/// Everything about the gas that does not change with time.
#[derive(Clone, Debug, PartialEq)]
pub struct Network {
    /// The surroundings.
    pub ambient: Node,
    /// The supply.
    pub supply: Supply,
    /// The silencer, if it restricts.
    pub silencer: Option<Silencer>,
    /// Flow law of all restrictions.
    pub flow: FlowShape,
    /// Relative change of a path's area per square of the upstream gas's
    /// relative departure from ambient temperature.
    pub area_by_temperature: f64,
    /// The tubes, if they matter.
    pub line: Option<Line>,
    /// The cylinder.
    pub cylinder: Cylinder,
    /// The cushions, if the piston has them.
    pub cushion: Option<Cushion>,
    /// Throttles at the ports, for gas that leaves a chamber: their areas.
    pub throttle_m2: [Option<f64>; 2],
    /// Past the piston, from a to b.
    pub piston_leak: Leak,
    /// From each chamber to the surroundings.
    pub chamber_leak: [Leak; 2],
    /// Heat exchange.
    pub heat: Heat,
    /// Walls that change their temperature; without them they stay ambient.
    pub wall: Option<Wall>,
}

/// What crossed the boundary of the gas since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Net gas from the supply.
    pub supplied: Content,
    /// Net gas to the surroundings.
    pub released: Content,
    /// Heat from the walls.
    pub heat_j: f64,
    /// Work on the piston.
    pub work_j: f64,
}

/// The gas and what it has exchanged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gas {
    /// Chambers a and b.
    pub chambers: [Content; 2],
    /// Tubes to a and b; meaningless without tubes.
    pub lines: [LineState; 2],
    /// The tank; meaningless without one.
    pub tank: Content,
    /// The silencer; meaningless without one.
    pub silencer: Content,
    /// Temperatures of the walls of a and b.
    pub wall_k: [f64; 2],
    /// What crossed the boundary.
    pub ledger: Ledger,
}

/// Where the piston is and how fast it moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Position.
    pub position_m: f64,
    /// Speed.
    pub speed_m_per_s: f64,
}

impl Motion {
    fn after(self, time_s: f64) -> Self {
        Self {
            position_m: self.position_m + time_s * self.speed_m_per_s,
            ..self
        }
    }
}

impl Network {
    /// All gas at rest: chambers and tubes at `pressure_pa`, the tank full, the
    /// silencer empty.
    pub fn at_rest(&self, position_m: f64, pressure_pa: [f64; 2]) -> Gas {
        let temperature_k = self.ambient.temperature_k;
        let node = |pressure_pa: f64| Node {
            pressure_pa,
            temperature_k,
        };
        let line = |pressure_pa: f64| {
            self.line
                .map_or_else(LineState::default, |line| line.filled(node(pressure_pa)))
        };
        let chamber = |chamber: usize| {
            Content::filled(
                self.cylinder.volume_m3(chamber, position_m),
                node(pressure_pa[chamber]),
            )
        };
        let warmer_k = self.wall.map_or(0.0, |wall| wall.warmer_k);
        Gas {
            chambers: [chamber(0), chamber(1)],
            lines: [line(pressure_pa[0]), line(pressure_pa[1])],
            tank: self.supply.tank.map_or_else(Content::default, |tank| {
                Content::filled(tank.volume_m3, node(self.supply.pressure_pa))
            }),
            silencer: self.silencer.map_or_else(Content::default, |silencer| {
                Content::filled(silencer.volume_m3, self.ambient)
            }),
            wall_k: [temperature_k + warmer_k; 2],
            ledger: Ledger::default(),
        }
    }

    /// Pressure and temperature of a chamber.
    pub fn chamber(&self, gas: &Gas, chamber: usize, position_m: f64) -> Node {
        gas.chambers[chamber].state(self.cylinder.volume_m3(chamber, position_m))
    }

    /// Pressure and temperature in front of the valve.
    pub fn supply(&self, gas: &Gas, time_s: f64) -> Node {
        match self.supply.tank {
            Some(tank) => gas.tank.state(tank.volume_m3),
            None => self.regulated(time_s),
        }
    }

    fn regulated(&self, time_s: f64) -> Node {
        let mut pressure_pa = self.supply.pressure_pa;
        if self.supply.ripple > 0.0 {
            let phase = 2.0 * core::f64::consts::PI * self.supply.ripple_hz * time_s;
            pressure_pa *= 1.0 + self.supply.ripple * libm::sin(phase);
        }
        Node {
            pressure_pa,
            ..self.ambient
        }
    }

    fn exhaust(&self, gas: &Gas) -> Node {
        self.silencer.map_or(self.ambient, |silencer| {
            gas.silencer.state(silencer.volume_m3)
        })
    }

    /// One step with the valve's paths held and the piston at constant speed.
    pub fn advance(&self, gas: &Gas, paths: &Paths, motion: Motion, time_s: f64, dt_s: f64) -> Gas {
        let start = self.rates(gas, paths, motion, time_s);
        let half_s = 0.5 * dt_s;
        let middle = self.moved(gas, &start, half_s);
        let rate = self.rates(&middle, paths, motion.after(half_s), time_s + half_s);
        self.moved(gas, &rate, dt_s)
    }

    fn moved(&self, gas: &Gas, rate: &Gas, time_s: f64) -> Gas {
        let cells = self.line.map_or(0, |line| line.cells());
        let along = |now: f64, rate: f64| now + time_s * rate;
        Gas {
            chambers: [0, 1].map(|port| gas.chambers[port].advanced(rate.chambers[port], time_s)),
            lines: [0, 1].map(|port| gas.lines[port].advanced(&rate.lines[port], cells, time_s)),
            tank: gas.tank.advanced(rate.tank, time_s),
            silencer: gas.silencer.advanced(rate.silencer, time_s),
            wall_k: [0, 1].map(|port| along(gas.wall_k[port], rate.wall_k[port])),
            ledger: Ledger {
                supplied: gas.ledger.supplied.advanced(rate.ledger.supplied, time_s),
                released: gas.ledger.released.advanced(rate.ledger.released, time_s),
                heat_j: along(gas.ledger.heat_j, rate.ledger.heat_j),
                work_j: along(gas.ledger.work_j, rate.ledger.work_j),
            },
        }
    }

    fn rates(&self, gas: &Gas, paths: &Paths, motion: Motion, time_s: f64) -> Gas {
        let mut rate = Gas::still();
        let supply = self.supply(gas, time_s);
        let exhaust = self.exhaust(gas);
        let chambers = [0, 1].map(|port| self.chamber(gas, port, motion.position_m));
        let mut into = [Stream::default(); 2];
        for port in 0..2 {
            into[port] = match &self.line {
                None => {
                    let (charge, discharge) = self.ports(
                        paths,
                        port,
                        (supply, exhaust),
                        chambers[port],
                        self.outlet_m2(port, motion.position_m),
                    );
                    self.exchange(&mut rate, charge, discharge);
                    Stream {
                        mass_kg_per_s: charge.mass_kg_per_s - discharge.mass_kg_per_s,
                        enthalpy_w: charge.enthalpy_w - discharge.enthalpy_w,
                    }
                }
                Some(line) => {
                    let state = &gas.lines[port];
                    let first = state.cells[0].state(line.cell_volume_m3());
                    let (charge, discharge) =
                        self.ports(paths, port, (supply, exhaust), first, OPEN_M2);
                    self.exchange(&mut rate, charge, discharge);
                    let outlet_m2 = if state.flow_kg_per_s[line.cells() - 1] < 0.0 {
                        self.outlet_m2(port, motion.position_m)
                    } else {
                        OPEN_M2
                    };
                    let (mut cells, stream, heat_w) =
                        line.rates(state, self.ambient.temperature_k, chambers[port], outlet_m2);
                    cells.cells[0].receive(charge);
                    cells.cells[0].give(discharge);
                    rate.lines[port] = cells;
                    rate.ledger.heat_j += heat_w;
                    stream
                }
            };
            rate.chambers[port].receive(into[port]);
        }
        self.leak(&mut rate, chambers, &mut into);
        for port in 0..2 {
            self.work_and_heat(&mut rate, gas, port, chambers[port], into[port], motion);
        }
        self.feed(&mut rate, supply, time_s);
        self.silence(&mut rate, exhaust);
        rate
    }

    /// The streams from the supply to a port and from the port to the exhaust.
    fn ports(
        &self,
        paths: &Paths,
        port: usize,
        (supply, exhaust): (Node, Node),
        node: Node,
        outlet_m2: f64,
    ) -> (Stream, Stream) {
        let through = |path_m2: f64, from: Node, to: Node, leaves: bool| {
            let upstream = if from.pressure_pa >= to.pressure_pa {
                from
            } else {
                to
            };
            let warm = upstream.temperature_k / self.ambient.temperature_k - 1.0;
            let mut area_m2 = path_m2 * (1.0 + self.area_by_temperature * warm * warm);
            let out_of_chamber = leaves == (from.pressure_pa >= to.pressure_pa);
            if out_of_chamber && outlet_m2 < OPEN_M2 {
                area_m2 = in_series_m2(area_m2, outlet_m2);
            }
            // With tubes the throttle stands at the chamber.
            match self.throttle_m2[port].filter(|_| out_of_chamber && self.line.is_none()) {
                None => self.flow.stream(area_m2, from, to),
                Some(throttle_m2) => self.through_both(area_m2, throttle_m2, from, to),
            }
        };
        (
            through(paths.supply_m2[port], supply, node, false),
            through(paths.exhaust_m2[port], node, exhaust, true),
        )
    }

    /// The stream through two passages without a volume between them: at the pressure there,
    /// found by halves, both pass the same. That gas is as warm as the gas before them (a throttle
    /// does no work).
    fn through_both(&self, first_m2: f64, second_m2: f64, from: Node, to: Node) -> Stream {
        const HALVES: usize = 24;
        let high = from.pressure_pa.max(to.pressure_pa);
        let low = from.pressure_pa.min(to.pressure_pa);
        let (upstream, downstream) = if from.pressure_pa >= to.pressure_pa {
            (from, to)
        } else {
            (to, from)
        };
        let (mut below, mut above) = (low, high);
        for _ in 0..HALVES {
            let between = Node {
                pressure_pa: 0.5 * (below + above),
                temperature_k: upstream.temperature_k,
            };
            let arrives = self.flow.stream(second_m2, upstream, between);
            let leaves = self.flow.stream(first_m2, between, downstream);
            if arrives.mass_kg_per_s > leaves.mass_kg_per_s {
                below = between.pressure_pa;
            } else {
                above = between.pressure_pa;
            }
        }
        let between = Node {
            pressure_pa: 0.5 * (below + above),
            temperature_k: upstream.temperature_k,
        };
        let size = self.flow.stream(second_m2, upstream, between).mass_kg_per_s;
        let forwards = from.pressure_pa >= to.pressure_pa;
        Stream::between(if forwards { size } else { -size }, from, to)
    }

    /// Area that lets gas out of a chamber into its tube, or past its cushion's seal.
    fn outlet_m2(&self, port: usize, position_m: f64) -> f64 {
        let needle_m2 = self.cushion.map_or(OPEN_M2, |cushion| {
            cushion.outlet_m2(self.cylinder.length_m(port, position_m))
        });
        match self.throttle_m2[port].filter(|_| self.line.is_some()) {
            None => needle_m2,
            Some(throttle_m2) => in_series_m2(needle_m2, throttle_m2),
        }
    }

    /// Books what a port takes from the supply side and gives to the exhaust.
    fn exchange(&self, rate: &mut Gas, charge: Stream, discharge: Stream) {
        if self.supply.tank.is_some() {
            rate.tank.give(charge);
        } else {
            rate.ledger.supplied.receive(charge);
        }
        if self.silencer.is_some() {
            rate.silencer.receive(discharge);
        } else {
            rate.ledger.released.receive(discharge);
        }
    }

    fn leak(&self, rate: &mut Gas, chambers: [Node; 2], into: &mut [Stream; 2]) {
        let past_piston = self
            .piston_leak
            .stream(&self.flow, chambers[0], chambers[1]);
        rate.chambers[0].give(past_piston);
        rate.chambers[1].receive(past_piston);
        into[0].mass_kg_per_s -= past_piston.mass_kg_per_s;
        into[1].mass_kg_per_s += past_piston.mass_kg_per_s;
        for port in 0..2 {
            let outward = self.chamber_leak[port].stream(&self.flow, chambers[port], self.ambient);
            rate.chambers[port].give(outward);
            rate.ledger.released.receive(outward);
            into[port].mass_kg_per_s -= outward.mass_kg_per_s;
        }
    }

    fn work_and_heat(
        &self,
        rate: &mut Gas,
        gas: &Gas,
        port: usize,
        chamber: Node,
        into: Stream,
        motion: Motion,
    ) {
        let growth_m3_per_s = GROWS[port] * self.cylinder.area_m2[port] * motion.speed_m_per_s;
        let work_w = chamber.pressure_pa * growth_m3_per_s;
        let coefficient = self
            .heat
            .coefficient_w_per_m2_k(chamber, into.mass_kg_per_s);
        let heat_w = coefficient
            * self.cylinder.surface_m2(port, motion.position_m)
            * (gas.wall_k[port] - chamber.temperature_k);
        rate.chambers[port].energy_j += heat_w - work_w;
        rate.ledger.heat_j += heat_w;
        rate.ledger.work_j += work_w;
        if let Some(wall) = &self.wall {
            let outward_w = wall.outward_w_per_k * (gas.wall_k[port] - self.ambient.temperature_k);
            rate.wall_k[port] = -(heat_w + outward_w) / wall.capacity_j_per_k;
        }
    }

    fn feed(&self, rate: &mut Gas, tank_node: Node, time_s: f64) {
        let Some(tank) = &self.supply.tank else {
            return;
        };
        let source = self.regulated(time_s);
        let missing_pa = (source.pressure_pa - tank_node.pressure_pa).max(0.0);
        if missing_pa <= 0.0 {
            return;
        }
        let orifice = self.flow.stream(tank.feed_area_m2, source, tank_node);
        let fed = Stream::between(
            orifice.mass_kg_per_s + tank.feed_kg_per_s_pa * missing_pa,
            source,
            tank_node,
        );
        rate.tank.receive(fed);
        rate.ledger.supplied.receive(fed);
    }

    fn silence(&self, rate: &mut Gas, silencer_node: Node) {
        let Some(silencer) = &self.silencer else {
            return;
        };
        let outward = self
            .flow
            .stream(silencer.area_m2, silencer_node, self.ambient);
        rate.silencer.give(outward);
        rate.ledger.released.receive(outward);
    }
}

impl Gas {
    /// All rates zero.
    fn still() -> Self {
        Self {
            chambers: [Content::default(); 2],
            lines: [LineState::default(); 2],
            tank: Content::default(),
            silencer: Content::default(),
            wall_k: [0.0; 2],
            ledger: Ledger::default(),
        }
    }
}

/// Two orifices one behind the other, without a volume between them.
fn in_series_m2(first_m2: f64, second_m2: f64) -> f64 {
    first_m2 * second_m2 / (first_m2 * first_m2 + second_m2 * second_m2).sqrt()
}
