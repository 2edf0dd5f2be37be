//! Both chambers with what lies between them, the supply and the surroundings.
//!
//! Driven by the valve's areas and the piston's way over the step: in the axis by
//! valve and carriage, in an identification by recorded command and position. In the
//! axis the gas moves the piston in turn: the pressures of the predicted middle of the
//! step give the way ([`Piston`]), the whole step follows it. The
//! parts that [`crate::left_out`] adds are each skipped while neutral.

use crate::chamber::{Chamber, ChamberFlow, ChamberState};
use crate::gas::Gas;
use crate::left_out::{
    ChamberLeakage, Crossing, EndCushion, ExhaustBackPressure, Passed, PistonLeakage, PortFlow,
    PortThrottle, SilencerState, SupplyDroop, TankState, TubeEnd, TubeLine, TubeState,
};
use crate::real::Real;
use crate::valve::{FlowLaw, GasState, PathAreas};

/// Both chambers with what lies between them and the valve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pneumatics<R> {
    /// The gas.
    pub gas: Gas<R>,
    /// Flow law of every orifice.
    pub law: FlowLaw<R>,
    /// The surroundings.
    pub ambient: GasState<R>,
    /// Chamber a, which +x enlarges.
    pub chamber_a: Chamber<R>,
    /// Chamber b.
    pub chamber_b: Chamber<R>,
    /// Leak of chamber a.
    pub leak_a: ChamberLeakage<R>,
    /// Leak of chamber b.
    pub leak_b: ChamberLeakage<R>,
    /// Leak from chamber to chamber.
    pub piston_leak: PistonLeakage<R>,
    /// Tube between each port and its chamber (two of a kind).
    pub tube: TubeLine<R>,
    /// Tank between regulator and valve.
    pub supply_droop: SupplyDroop<R>,
    /// Silencer behind both exhaust paths, or one behind each (two of a kind).
    pub back_pressure: ExhaustBackPressure<R>,
    /// Whether each exhaust path has a port of its own, with its own silencer.
    pub separate_exhausts: bool,
    /// Cushions at the ends of the stroke (two of a kind).
    pub cushion: EndCushion<R>,
    /// One-way flow control at the port of chamber a.
    pub throttle_a: PortThrottle<R>,
    /// The same of chamber b.
    pub throttle_b: PortThrottle<R>,
}

/// State of the gas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PneumaticState<R> {
    /// Chamber a.
    pub a: ChamberState<R>,
    /// Chamber b.
    pub b: ChamberState<R>,
    /// Tube to chamber a.
    pub tube_a: TubeState<R>,
    /// Tube to chamber b.
    pub tube_b: TubeState<R>,
    /// Tank between regulator and valve.
    pub tank: TankState<R>,
    /// Silencer behind both exhaust paths, or behind that of port a.
    pub silencer: SilencerState<R>,
    /// Silencer behind the exhaust path of port b, where it has its own.
    pub silencer_b: SilencerState<R>,
}

impl<R: Real> PneumaticState<R> {
    /// Gas at rest in tubes and chambers, the tank full, the silencers empty.
    pub fn at_rest(a: GasState<R>, b: GasState<R>) -> Self {
        Self {
            a: ChamberState::new(a.pressure_pa, a.temperature_k),
            b: ChamberState::new(b.pressure_pa, b.temperature_k),
            tube_a: TubeState::at_rest(a.pressure_pa),
            tube_b: TubeState::at_rest(b.pressure_pa),
            tank: TankState::FULL,
            silencer: SilencerState::at_rest(),
            silencer_b: SilencerState::at_rest(),
        }
    }
}

/// The valve as the chambers see it through one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValveDrive<R> {
    /// Areas of the four paths.
    pub areas: PathAreas<R>,
    /// The supplied gas.
    pub supply: GasState<R>,
}

/// The piston's way over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piston<R, M> {
    /// Where the step begins, m.
    pub from_m: R,
    /// Where its middle is expected, m.
    pub middle_m: R,
    /// Where it ends, m, under the pressures in both chambers at its middle, Pa.
    pub end_m: M,
}

impl<R: Real> Piston<R, ()> {
    /// A piston that goes from here to there, whatever the pressures.
    #[inline]
    fn led(from_m: R, to_m: R) -> Piston<R, impl FnOnce(R, R) -> R> {
        Piston {
            from_m,
            middle_m: (from_m + to_m) * R::from_f64(0.5),
            end_m: move |_, _| to_m,
        }
    }
}

/// A side in the middle of a step.
#[derive(Clone, Copy)]
struct Underway<R> {
    gas: GasState<R>,
    /// What passes its tube over the step, if it has one.
    passed: Option<Passed<R>>,
}

/// The two paths that end at one port.
#[derive(Clone, Copy)]
struct PortPaths<R> {
    supply_area_m2: R,
    exhaust_area_m2: R,
    supply: GasState<R>,
    exhaust: GasState<R>,
}

/// What a port says of the flows through its paths over a step.
#[derive(Clone, Copy)]
enum Port<R> {
    /// The flow through a path on average is its flow at `gas` plus its slope times
    /// `beyond_pa`.
    Gas { gas: GasState<R>, beyond_pa: R },
    /// A tube has counted them.
    Tube(Passed<R>),
}

/// One side's parameters.
#[derive(Clone, Copy)]
struct Side<'a, R> {
    chamber: &'a Chamber<R>,
    leak: &'a ChamberLeakage<R>,
    throttle: &'a PortThrottle<R>,
    /// What crosses the piston into this chamber.
    crossing: Option<Crossing<R>>,
}

impl<R: Real> Pneumatics<R> {
    /// One step with the piston moving from `from_m` to `to_m`; without a valve
    /// the chambers are closed. The supply is taken as it is at the valve: measured
    /// there, or declared constant.
    #[inline]
    pub fn step(
        &self,
        state: &mut PneumaticState<R>,
        valve: Option<&ValveDrive<R>>,
        from_m: R,
        to_m: R,
        dt_s: R,
    ) {
        match valve {
            Some(drive) => self.step_driven(state, drive, Piston::led(from_m, to_m), dt_s),
            None => self.step_closed(state, (from_m, to_m), dt_s),
        }
    }

    /// One step with the valve, behind a piston that the gas may move.
    #[inline]
    pub fn step_driven(
        &self,
        state: &mut PneumaticState<R>,
        valve: &ValveDrive<R>,
        piston: Piston<R, impl FnOnce(R, R) -> R>,
        dt_s: R,
    ) {
        let areas = self.restricted(&valve.areas, valve.supply, state, piston.middle_m);
        self.step_open(state, (&areas, valve.supply), piston, dt_s);
    }

    /// A step with the supply as it is at the regulator: where there is a tank,
    /// the valve draws from it.
    #[inline]
    pub fn step_behind_regulator(
        &self,
        state: &mut PneumaticState<R>,
        valve: &ValveDrive<R>,
        from_m: R,
        to_m: R,
        dt_s: R,
    ) {
        self.step_driven_behind_regulator(state, valve, Piston::led(from_m, to_m), dt_s);
    }

    /// A step with the supply as it is at the regulator, behind a piston that the gas may move.
    #[inline]
    pub fn step_driven_behind_regulator(
        &self,
        state: &mut PneumaticState<R>,
        valve: &ValveDrive<R>,
        piston: Piston<R, impl FnOnce(R, R) -> R>,
        dt_s: R,
    ) {
        if !self.supply_droop.is_present() {
            self.step_driven(state, valve, piston, dt_s);
            return;
        }
        let constant = self.gas.gas_constant_j_per_kg_k;
        let tank = self
            .supply_droop
            .between(&self.law, constant, valve.supply, dt_s);
        let stored = tank.now(&state.tank);
        let areas = &self.restricted(&valve.areas, stored, state, piston.middle_m);
        let wanted = self.draw(areas, stored, self.ports(state));
        let seen = tank.seen(&state.tank, wanted);
        let ports = self.step_open(state, (areas, seen), piston, dt_s);
        let (drawn, _) = self.draw(areas, seen, ports);
        tank.step(&mut state.tank, seen, drawn);
    }

    fn step_closed(&self, state: &mut PneumaticState<R>, way_m: (R, R), dt_s: R) {
        let middle_m = (way_m.0 + way_m.1) * R::from_f64(0.5);
        let [a, b] = self.sides(state, middle_m, dt_s);
        for (side, chamber) in [(a, &mut state.a), (b, &mut state.b)] {
            let flow = |gas| ChamberFlow::NONE.with_losses(self, &side, gas);
            let stroke = side.chamber.stroke(way_m.0, way_m.1);
            side.chamber.step(chamber, &stroke, flow, dt_s);
        }
    }

    /// A step with the valve; returns the gas at its ports.
    #[inline]
    fn step_open(
        &self,
        state: &mut PneumaticState<R>,
        (areas, supply): (&PathAreas<R>, GasState<R>),
        piston: Piston<R, impl FnOnce(R, R) -> R>,
        dt_s: R,
    ) -> [Port<R>; 2] {
        if !self.back_pressure.is_present() {
            return self.step_sides(state, (areas, supply), [self.ambient; 2], piston, dt_s);
        }
        let constant = self.gas.gas_constant_j_per_kg_k;
        let silencer = self
            .back_pressure
            .within(&self.law, constant, self.ambient, dt_s);
        let now = [&state.silencer, &state.silencer_b].map(|one| silencer.now(one));
        if self.separate_exhausts {
            let [offered_a, offered_b] = self.vent(areas, now, self.ports(state));
            let seen = [
                silencer.seen(&state.silencer, offered_a),
                silencer.seen(&state.silencer_b, offered_b),
            ];
            let ports = self.step_sides(state, (areas, supply), seen, piston, dt_s);
            let [(vented_a, _), (vented_b, _)] = self.vent(areas, seen, ports);
            silencer.step(&mut state.silencer, seen[0], vented_a);
            silencer.step(&mut state.silencer_b, seen[1], vented_b);
            return ports;
        }
        let [a, b] = self.vent(areas, [now[0]; 2], self.ports(state));
        let seen = silencer.seen(&state.silencer, (a.0 + b.0, a.1 + b.1));
        let ports = self.step_sides(state, (areas, supply), [seen; 2], piston, dt_s);
        let [(vented_a, _), (vented_b, _)] = self.vent(areas, [seen; 2], ports);
        silencer.step(&mut state.silencer, seen, vented_a + vented_b);
        ports
    }

    #[inline]
    fn step_sides(
        &self,
        state: &mut PneumaticState<R>,
        (areas, supply): (&PathAreas<R>, GasState<R>),
        exhausts: [GasState<R>; 2],
        piston: Piston<R, impl FnOnce(R, R) -> R>,
        dt_s: R,
    ) -> [Port<R>; 2] {
        let [a, b] = self.sides(state, piston.middle_m, dt_s);
        let paths_a = PortPaths {
            supply_area_m2: areas.supply_a_m2,
            exhaust_area_m2: areas.exhaust_a_m2,
            supply,
            exhaust: exhausts[0],
        };
        let paths_b = PortPaths {
            supply_area_m2: areas.supply_b_m2,
            exhaust_area_m2: areas.exhaust_b_m2,
            supply,
            exhaust: exhausts[1],
        };
        let half_m = (piston.from_m, piston.middle_m);
        let tube_a = &mut state.tube_a;
        let middle_a = self.predict_side(&a, (&mut state.a, tube_a), &paths_a, half_m, dt_s);
        let tube_b = &mut state.tube_b;
        let middle_b = self.predict_side(&b, (&mut state.b, tube_b), &paths_b, half_m, dt_s);
        let end_m = (piston.end_m)(middle_a.gas.pressure_pa, middle_b.gas.pressure_pa);
        let way_m = (piston.from_m, end_m);
        [
            self.complete_side(&a, &mut state.a, middle_a, &paths_a, way_m, dt_s),
            self.complete_side(&b, &mut state.b, middle_b, &paths_b, way_m, dt_s),
        ]
    }

    /// A side up to the middle of a step of `dt_s`, but for its tube, which takes all of it.
    #[inline]
    fn predict_side(
        &self,
        side: &Side<'_, R>,
        (state, tube): (&mut ChamberState<R>, &mut TubeState<R>),
        paths: &PortPaths<R>,
        half_m: (R, R),
        dt_s: R,
    ) -> Underway<R> {
        let stroke = side.chamber.stroke(half_m.0, half_m.1);
        let passed = self
            .tube
            .is_present()
            .then(|| self.step_tube(side, state, tube, paths, half_m.1, dt_s));
        let start_k = state.temperature_k.value;
        let flow = |gas| self.side_flow(side, (passed, start_k), paths, gas);
        let gas = side.chamber.predict(state, &stroke, flow, dt_s);
        Underway { gas, passed }
    }

    /// A side from the middle of a step to its end.
    #[inline]
    fn complete_side(
        &self,
        side: &Side<'_, R>,
        state: &mut ChamberState<R>,
        middle: Underway<R>,
        paths: &PortPaths<R>,
        way_m: (R, R),
        dt_s: R,
    ) -> Port<R> {
        let stroke = side.chamber.stroke(way_m.0, way_m.1);
        let start_k = state.temperature_k.value;
        let flow = |gas| self.side_flow(side, (middle.passed, start_k), paths, gas);
        let exchange = side
            .chamber
            .complete(state, middle.gas, &stroke, flow, dt_s);
        match middle.passed {
            Some(passed) => Port::Tube(passed),
            None => Port::Gas {
                gas: exchange.middle,
                beyond_pa: exchange.beyond_pa,
            },
        }
    }

    /// Flow into a chamber with this gas: through valve or tube, and its leaks. What comes
    /// back through a tube has the temperature of the step's start, `start_k`.
    #[inline]
    fn side_flow(
        &self,
        side: &Side<'_, R>,
        (passed, start_k): (Option<Passed<R>>, R),
        paths: &PortPaths<R>,
        gas: GasState<R>,
    ) -> ChamberFlow<R> {
        let through_port = match passed {
            Some(passed) => ChamberFlow::NONE.with(
                passed.into_chamber_kg_per_s,
                R::ZERO,
                self.ambient.temperature_k,
                start_k,
            ),
            None => self.port_flow(paths, gas),
        };
        through_port.with_losses(self, side, gas)
    }

    /// Steps the tube; returns what passed it.
    fn step_tube(
        &self,
        side: &Side<'_, R>,
        state: &ChamberState<R>,
        tube: &mut TubeState<R>,
        paths: &PortPaths<R>,
        position_m: R,
        dt_s: R,
    ) -> Passed<R> {
        let tube_k = self.ambient.temperature_k;
        let within = |pressure_pa| GasState {
            pressure_pa,
            temperature_k: tube_k,
        };
        let gas = state.gas_state();
        let (chamber, far) = (side.chamber, within(tube.far_pa()));
        let needle = if self.cushion.is_present() {
            let length_m = chamber.geometry.length_m(position_m);
            self.cushion
                .resistance_pa_s_per_kg(&self.law, length_m, gas, far)
        } else {
            R::ZERO
        };
        let throttle = side.throttle.resistance_pa_s_per_kg(&self.law, gas, far);
        self.tube.step(
            tube,
            &self.gas,
            tube_k,
            |pressure_pa| self.path_flows(paths, within(pressure_pa)),
            &TubeEnd {
                pressure_pa: gas.pressure_pa,
                pa_per_kg: self.pa_per_kg(chamber, gas.temperature_k, position_m),
                resistance_pa_s_per_kg: needle + throttle,
            },
            dt_s,
        )
    }

    /// The pressures that both chambers come to, at a position and a velocity, once what is on
    /// its way in their tubes has arrived, Pa:
    ///
    /// ```text
    /// p + kappa (p_t - p - p_v) / (kappa + V / V_t)
    /// ```
    ///
    /// with `p_t` the mean pressure of the tube, `V_t` its volume, and `p_v` by how much that
    /// stands over the chamber's while the flow that the piston's motion takes passes. Without a
    /// tube they are what they are.
    #[inline]
    pub fn settled_pa(
        &self,
        state: &PneumaticState<R>,
        position_m: R,
        velocity_m_per_s: R,
    ) -> (R, R) {
        let (a, b) = (state.a.pressure_pa.value, state.b.pressure_pa.value);
        if !self.tube.is_present() {
            return (a, b);
        }
        let settled = |chamber: &Chamber<R>, pressure_pa, tube: &TubeState<R>, speed| {
            let flow = pressure_pa * chamber.geometry.area_m2 * speed / self.tube_specific();
            let steady_pa = self
                .tube
                .steady_over_pa(self.tube_specific(), pressure_pa, flow);
            let kappa = self.gas.heat_capacity_ratio;
            let ratio = chamber.geometry.volume_m3(position_m) / self.tube.volume_m3();
            let over_pa = tube.mean_pa() - pressure_pa - steady_pa;
            pressure_pa + kappa * over_pa / (kappa + ratio)
        };
        (
            settled(&self.chamber_a, a, &state.tube_a, velocity_m_per_s),
            settled(&self.chamber_b, b, &state.tube_b, -velocity_m_per_s),
        )
    }

    /// How long a change at the valve takes through a tube, s.
    pub fn transit_s(&self) -> R {
        self.tube.transit_s(self.tube_specific())
    }

    /// R T of the gas in the tubes, J/kg.
    fn tube_specific(&self) -> R {
        self.gas.gas_constant_j_per_kg_k * self.ambient.temperature_k
    }

    /// How much the pressure of a chamber rises per mass let in.
    fn pa_per_kg(&self, chamber: &Chamber<R>, temperature_k: R, position_m: R) -> R {
        self.gas.heat_capacity_ratio * self.gas.gas_constant_j_per_kg_k * temperature_k
            / chamber.geometry.volume_m3(position_m)
    }

    /// Both sides, with what crosses the piston over the step.
    #[inline]
    fn sides(&self, state: &PneumaticState<R>, position_m: R, dt_s: R) -> [Side<'_, R>; 2] {
        let into_b = self
            .piston_leak
            .is_present()
            .then(|| self.crossing(state, position_m, dt_s));
        let into_a = into_b.map(|crossing| Crossing {
            into_kg_per_s: -crossing.into_kg_per_s,
            ..crossing
        });
        [
            Side {
                chamber: &self.chamber_a,
                leak: &self.leak_a,
                throttle: &self.throttle_a,
                crossing: into_a,
            },
            Side {
                chamber: &self.chamber_b,
                leak: &self.leak_b,
                throttle: &self.throttle_b,
                crossing: into_b,
            },
        ]
    }

    /// How fast leaks change the force of the gas towards +x, N/s: nought, at once, where
    /// there are none.
    #[inline]
    pub(crate) fn leaks_n_per_s(&self, state: &PneumaticState<R>, position_m: R, dt_s: R) -> R {
        let losses = self.leak_a.is_present() || self.leak_b.is_present();
        if losses || self.piston_leak.is_present() {
            self.leaking_n_per_s(state, position_m, dt_s)
        } else {
            R::ZERO
        }
    }

    #[inline(never)]
    fn leaking_n_per_s(&self, state: &PneumaticState<R>, position_m: R, dt_s: R) -> R {
        let n_per_kg = |chamber: &Chamber<R>, temperature_k| {
            chamber.geometry.area_m2 * self.pa_per_kg(chamber, temperature_k, position_m)
        };
        let lost = |chamber: &Chamber<R>, leak: &ChamberLeakage<R>, state| {
            let gas = chamber.offered(state);
            let (out_kg_per_s, _) = leak.outflow(&self.law, gas, self.ambient);
            n_per_kg(chamber, gas.temperature_k) * out_kg_per_s
        };
        let Crossing {
            into_kg_per_s: into_b,
            temperature_k,
        } = self.crossing(state, position_m, dt_s);
        let crossed =
            n_per_kg(&self.chamber_a, temperature_k) + n_per_kg(&self.chamber_b, temperature_k);
        lost(&self.chamber_b, &self.leak_b, &state.b)
            - lost(&self.chamber_a, &self.leak_a, &state.a)
            - crossed * into_b
    }

    /// What crosses the piston from a into b.
    fn crossing(&self, state: &PneumaticState<R>, position_m: R, dt_s: R) -> Crossing<R> {
        let a = self.chamber_a.offered(&state.a);
        let b = self.chamber_b.offered(&state.b);
        let pa_per_kg = self.pa_per_kg(&self.chamber_a, a.temperature_k, position_m)
            + self.pa_per_kg(&self.chamber_b, b.temperature_k, position_m);
        self.piston_leak
            .crossing(&self.law, (a, b), pa_per_kg, dt_s)
    }

    /// The gas at both ports before the step.
    fn ports(&self, state: &PneumaticState<R>) -> [Port<R>; 2] {
        let port = |chamber: &Chamber<R>, state: &ChamberState<R>, tube: &TubeState<R>| Port::Gas {
            gas: if self.tube.is_present() {
                GasState {
                    pressure_pa: tube.port_pa(),
                    temperature_k: self.ambient.temperature_k,
                }
            } else {
                chamber.offered(state)
            },
            beyond_pa: R::ZERO,
        };
        [
            port(&self.chamber_a, &state.a, &state.tube_a),
            port(&self.chamber_b, &state.b, &state.tube_b),
        ]
    }

    /// Flow through both supply paths out of a supply, and its slope by the
    /// supply's pressure (of no use, and nought, where it has been counted).
    fn draw(&self, areas: &PathAreas<R>, supply: GasState<R>, ports: [Port<R>; 2]) -> (R, R) {
        let through = |area_m2, port| match port {
            Port::Gas { gas, beyond_pa } => {
                let flow = self.law.flow(area_m2, supply, gas);
                let mass = flow.mass_flow_kg_per_s + flow.slope_2_kg_per_s_pa * beyond_pa;
                (mass, flow.slope_1_kg_per_s_pa)
            }
            Port::Tube(passed) => (passed.supplied_kg_per_s, R::ZERO),
        };
        let a = through(areas.supply_a_m2, ports[0]);
        let b = through(areas.supply_b_m2, ports[1]);
        (a.0 + b.0, a.1 + b.1)
    }

    /// Flow through each exhaust path into its exhaust, and its slope by the
    /// exhaust's pressure (nought as above).
    fn vent(
        &self,
        areas: &PathAreas<R>,
        exhausts: [GasState<R>; 2],
        ports: [Port<R>; 2],
    ) -> [(R, R); 2] {
        let through = |area_m2, exhaust, port| match port {
            Port::Gas { gas, beyond_pa } => {
                let flow = self.law.flow(area_m2, gas, exhaust);
                let mass = flow.mass_flow_kg_per_s + flow.slope_1_kg_per_s_pa * beyond_pa;
                (mass, flow.slope_2_kg_per_s_pa)
            }
            Port::Tube(passed) => (passed.exhausted_kg_per_s, R::ZERO),
        };
        [
            through(areas.exhaust_a_m2, exhausts[0], ports[0]),
            through(areas.exhaust_b_m2, exhausts[1], ports[1]),
        ]
    }

    /// The areas through a step, with throttles and the needles of the cushions before each path that leads
    /// out of a chamber: to the exhaust and, from a chamber that begins the step above the
    /// supply, back into that. With a tube the needles stand behind it instead.
    #[inline]
    fn restricted(
        &self,
        areas: &PathAreas<R>,
        supply: GasState<R>,
        state: &PneumaticState<R>,
        middle_m: R,
    ) -> PathAreas<R> {
        if !self.are_outlets_restricted() || self.tube.is_present() {
            return *areas;
        }
        let needled = |(supply_m2, exhaust_m2),
                       throttle: &PortThrottle<R>,
                       chamber: &Chamber<R>,
                       state: &ChamberState<R>| {
            let (length_m, inside) = (chamber.geometry.length_m(middle_m), state.gas_state());
            let outlet_m2 = |valve_m2, beyond| {
                let throttled_m2 = throttle.outlet_area_m2(&self.law, valve_m2, inside, beyond);
                self.cushion.outlet_area_m2(throttled_m2, length_m)
            };
            let supply_m2 = if inside.pressure_pa > supply.pressure_pa {
                outlet_m2(supply_m2, supply)
            } else {
                supply_m2
            };
            (supply_m2, outlet_m2(exhaust_m2, self.ambient))
        };
        let paths_a = (areas.supply_a_m2, areas.exhaust_a_m2);
        let paths_b = (areas.supply_b_m2, areas.exhaust_b_m2);
        let (supply_a_m2, exhaust_a_m2) =
            needled(paths_a, &self.throttle_a, &self.chamber_a, &state.a);
        let (supply_b_m2, exhaust_b_m2) =
            needled(paths_b, &self.throttle_b, &self.chamber_b, &state.b);
        PathAreas {
            supply_a_m2,
            supply_b_m2,
            exhaust_a_m2,
            exhaust_b_m2,
        }
    }

    fn are_outlets_restricted(&self) -> bool {
        self.cushion.is_present() || self.throttle_a.is_present() || self.throttle_b.is_present()
    }

    /// Flow through the valve's two paths into a volume with this gas.
    #[inline]
    fn port_flow(&self, paths: &PortPaths<R>, gas: GasState<R>) -> ChamberFlow<R> {
        let flows = self.path_flows(paths, gas);
        ChamberFlow::NONE
            .with(
                flows.supplied_kg_per_s,
                flows.supply_slope,
                paths.supply.temperature_k,
                gas.temperature_k,
            )
            .with(
                -flows.exhausted_kg_per_s,
                -flows.exhaust_slope,
                paths.exhaust.temperature_k,
                gas.temperature_k,
            )
    }

    /// The same path by path.
    #[inline]
    fn path_flows(&self, paths: &PortPaths<R>, gas: GasState<R>) -> PortFlow<R> {
        let filling = self.law.flow(paths.supply_area_m2, paths.supply, gas);
        let emptying = self.law.flow(paths.exhaust_area_m2, gas, paths.exhaust);
        PortFlow {
            supplied_kg_per_s: filling.mass_flow_kg_per_s,
            exhausted_kg_per_s: emptying.mass_flow_kg_per_s,
            supply_slope: filling.slope_2_kg_per_s_pa,
            exhaust_slope: emptying.slope_1_kg_per_s_pa,
        }
    }
}

impl<R: Real> ChamberFlow<R> {
    /// Adds a chamber's leaks: to the surroundings and past the piston.
    #[inline]
    fn with_losses(self, pneumatics: &Pneumatics<R>, side: &Side<'_, R>, gas: GasState<R>) -> Self {
        let (out, slope) = side.leak.outflow(&pneumatics.law, gas, pneumatics.ambient);
        let flow = self.with(
            -out,
            -slope,
            pneumatics.ambient.temperature_k,
            gas.temperature_k,
        );
        match side.crossing {
            None => flow,
            Some(Crossing {
                into_kg_per_s,
                temperature_k,
            }) => flow.with(into_kg_per_s, R::ZERO, temperature_k, temperature_k),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper;

    /// The valve shut, one tube under more pressure than its chamber, the other under less.
    #[test]
    fn val_what_is_on_its_way_arrives() {
        let mut pneumatics = paper::axis::<f64>().pneumatics;
        pneumatics.tube = TubeLine {
            length_m: 1.5,
            diameter_m: 0.004,
        };
        for chamber in [&mut pneumatics.chamber_a, &mut pneumatics.chamber_b] {
            chamber.heat_transfer_charging_w_per_m2_k = 0.0;
            chamber.heat_transfer_discharging_w_per_m2_k = 0.0;
            chamber.wall_conductance_w_per_k = 0.0;
        }
        let gas = GasState {
            pressure_pa: 5e5,
            temperature_k: pneumatics.ambient.temperature_k,
        };
        let mut state = PneumaticState::at_rest(gas, gas);
        state.tube_a = TubeState::at_rest(5.4e5);
        state.tube_b = TubeState::at_rest(4.7e5);
        let expected = pneumatics.settled_pa(&state, 0.05, 0.0);
        assert!(expected.0 > 5.05e5 && expected.1 < 4.96e5, "{expected:?}");
        let shut = ValveDrive {
            areas: PathAreas {
                supply_a_m2: 0.0,
                exhaust_a_m2: 0.0,
                supply_b_m2: 0.0,
                exhaust_b_m2: 0.0,
            },
            supply: gas,
        };
        for _ in 0..600 {
            pneumatics.step(&mut state, Some(&shut), 0.05, 0.05, 1e-3);
        }
        for (expected_pa, side_pa) in [
            (expected.0, state.a.pressure_pa.value),
            (expected.1, state.b.pressure_pa.value),
        ] {
            let rise_pa = (expected_pa - 5e5).abs();
            assert!(
                (side_pa - expected_pa).abs() < 0.02 * rise_pa,
                "{side_pa} {expected_pa}"
            );
        }
    }
}
