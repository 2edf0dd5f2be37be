//! Effects in tubes, supply, exhaust, leaks, heat and cushions.

use super::{Applied, CHAMBERS, Draw, Effect, FLOW, Form, SIDES};
use crate::plant::heat::Wall;
use crate::plant::line::Line;
use crate::plant::network::{Cushion, Silencer, Tank};

pub(super) const EFFECTS: &[Effect] = &[
    Effect {
        name: "tube-line",
        on_list: true,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: false,
        apply: tube_line,
    },
    Effect {
        name: "piston-leakage",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: piston_leakage,
    },
    Effect {
        name: "chamber-leakage",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: chamber_leakage,
    },
    Effect {
        name: "supply-droop",
        on_list: true,
        may_begin: false,
        has_other_form: true,
        may_be_immaterial: true,
        apply: supply_droop,
    },
    Effect {
        name: "exhaust-back-pressure",
        on_list: true,
        may_begin: true,
        has_other_form: false,
        may_be_immaterial: true,
        apply: exhaust_back_pressure,
    },
    Effect {
        name: GAS_TEMPERATURE,
        on_list: true,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: false,
        apply: gas_temperature_dynamics,
    },
    Effect {
        name: "variable-heat-transfer",
        on_list: true,
        may_begin: false,
        has_other_form: true,
        may_be_immaterial: true,
        apply: variable_heat_transfer,
    },
    Effect {
        name: "wall-temperature",
        on_list: true,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: true,
        apply: wall_temperature,
    },
    Effect {
        name: "end-cushion",
        on_list: true,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: true,
        apply: end_cushion,
    },
    Effect {
        name: "port-throttle",
        on_list: true,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: true,
        apply: port_throttle,
    },
];

/// The effect that lies in what the rig file says: it says "polytropic".
pub(crate) const GAS_TEMPERATURE: &str = "gas-temperature-dynamics";

fn tube_line(draw: &mut Draw<'_>) -> Applied {
    let length_m = draw.size([0.0, 0.5, 1.5, 2.6]);
    let diameter_m = *draw.random.one_of(&[0.004, 0.004, 0.0057]);
    draw.physics.network.line = Some(Line::new(length_m, diameter_m));
    Applied::new(
        FLOW,
        "finite volumes with inertia",
        [("length_m", length_m), ("diameter_m", diameter_m)],
    )
}

fn piston_leakage(draw: &mut Draw<'_>) -> Applied {
    // 1 to 14 l/min (ANR) from 5 to 4 bar.
    let orifice_m2 = draw.size([2.5e-9, 2.5e-8, 1.2e-7, 4e-7]);
    // A gap with the same flow from 5 to 4 bar.
    const GAP_PER_AREA: f64 = 7.5e-9;
    let leak = &mut draw.physics.network.piston_leak;
    if draw.form == Form::Other {
        leak.laminar_kg_per_s_pa2 = orifice_m2 * GAP_PER_AREA;
        let parameters = [("laminar_kg_s_Pa2", leak.laminar_kg_per_s_pa2)];
        return Applied::new(CHAMBERS, "laminar gap", parameters);
    }
    leak.orifice_m2 = orifice_m2;
    Applied::new(CHAMBERS, "orifice", [("orifice_m2", orifice_m2)])
}

fn chamber_leakage(draw: &mut Draw<'_>) -> Applied {
    // 0.6 to 10 l/min (ANR) from 4.3 bar to the surroundings.
    let area_m2 = draw.size([1.5e-9, 1.5e-8, 6e-8, 2.5e-7]);
    // A gap with the same flow from 4.3 bar.
    const GAP_PER_AREA: f64 = 4.7e-9;
    let leaking = *draw.random.one_of(&SIDES);
    // The physics of a leak in a seal is either: both are on the list.
    let laminar = draw.form == Form::Other || draw.random.chance(0.5);
    let mut applied = Applied {
        form: if laminar { "laminar gap" } else { "orifice" },
        ..Applied::default()
    };
    for &port in leaking {
        let leak = &mut draw.physics.network.chamber_leak[port];
        let side = ["a", "b"][port];
        let (key, value) = if laminar {
            leak.laminar_kg_per_s_pa2 = area_m2 * GAP_PER_AREA;
            (
                format!("laminar_{side}_kg_s_Pa2"),
                leak.laminar_kg_per_s_pa2,
            )
        } else {
            leak.orifice_m2 = area_m2;
            (format!("orifice_{side}_m2"), area_m2)
        };
        applied.places.push(CHAMBERS[port]);
        applied.parameters.insert(key, value);
    }
    applied
}

fn supply_droop(draw: &mut Draw<'_>) -> Applied {
    let volume_m3 = draw.size([10e-3, 3e-3, 0.8e-3, 0.4e-3]);
    if draw.form == Form::Other {
        // Droop of the regulator at 5 g/s.
        let droop_pa = draw.size([1e3, 1e4, 3e4, 7e4]);
        let feed_kg_per_s_pa = 5e-3 / droop_pa;
        draw.physics.network.supply.tank = Some(Tank {
            volume_m3,
            feed_area_m2: 0.0,
            feed_kg_per_s_pa,
        });
        let parameters = [
            ("tank_volume_m3", volume_m3),
            ("regulator_kg_s_Pa", feed_kg_per_s_pa),
        ];
        return Applied::new(["supply"], "proportional regulator", parameters);
    }
    let feed_area_m2 = draw.size([4e-5, 9e-6, 4.5e-6, 2.5e-6]);
    draw.physics.network.supply.tank = Some(Tank {
        volume_m3,
        feed_area_m2,
        feed_kg_per_s_pa: 0.0,
    });
    let parameters = [
        ("tank_volume_m3", volume_m3),
        ("feed_area_m2", feed_area_m2),
    ];
    Applied::new(["supply"], "tank behind an orifice", parameters)
}

fn exhaust_back_pressure(draw: &mut Draw<'_>) -> Applied {
    let area_m2 = draw.size([8e-5, 1.5e-5, 7e-6, 3.5e-6]);
    let volume_m3 = draw.random.between(2e-5, 1e-4);
    draw.physics.network.silencer = Some(Silencer { volume_m3, area_m2 });
    let parameters = [("silencer_area_m2", area_m2), ("volume_m3", volume_m3)];
    Applied::new(["exhaust"], "silencer", parameters)
}

fn gas_temperature_dynamics(draw: &mut Draw<'_>) -> Applied {
    // The less heat is exchanged, the further the gas is from the polytropic
    // law with its exponents of 1.11 and 1.18.
    let charging = draw.size([0.0, 60.0, 40.0, 25.0]);
    let discharging = charging * draw.random.between(0.4, 0.5);
    let heat = &mut draw.physics.network.heat;
    heat.charging_w_per_m2_k = charging;
    heat.discharging_w_per_m2_k = discharging;
    let parameters = [
        ("heat_transfer_charging_W_m2K", charging),
        ("heat_transfer_discharging_W_m2K", discharging),
    ];
    Applied::new(CHAMBERS, "energy balance, declared polytropic", parameters)
}

fn variable_heat_transfer(draw: &mut Draw<'_>) -> Applied {
    if draw.form == Form::Other {
        let exponent = draw.size([0.05, 0.5, 1.0, 1.5]);
        draw.physics.network.heat.eichelberg_exponent = exponent;
        return Applied::new(CHAMBERS, "Eichelberg", [("exponent", exponent)]);
    }
    let per_flow = draw.size([2.0, 20.0, 60.0, 150.0]);
    let exponent = draw.size([0.03, 0.3, 0.5, 0.8]);
    let heat = &mut draw.physics.network.heat;
    heat.per_flow_w_per_m2_k = per_flow;
    heat.density_exponent = exponent;
    let parameters = [("flow_W_m2K", per_flow), ("density_exponent", exponent)];
    Applied::new(CHAMBERS, "density and flow", parameters)
}

fn wall_temperature(draw: &mut Draw<'_>) -> Applied {
    let warmer_k = draw.size([0.8, 8.0, 15.0, 30.0]) * draw.random.sign();
    // Half a profile of 1 to 2.5 kJ/K; a thin sleeve far less.
    let capacity_j_per_k = draw.size([1000.0, 1000.0, 600.0, 200.0]);
    let outward_w_per_k = draw.random.between(0.2, 0.5);
    draw.physics.network.wall = Some(Wall {
        capacity_j_per_k,
        outward_w_per_k,
        warmer_k,
    });
    let parameters = [
        ("offset_K", warmer_k),
        ("heat_capacity_J_K", capacity_j_per_k),
        ("outer_W_K", outward_w_per_k),
    ];
    Applied::new(CHAMBERS, "wall with a heat capacity", parameters)
}

fn port_throttle(draw: &mut Draw<'_>) -> Applied {
    let throttled = *draw.random.one_of(&SIDES);
    let mut applied = Applied {
        form: "pressure between valve and throttle",
        ..Applied::default()
    };
    for &port in throttled {
        // The valve opens to 7 or 12 mm2; two throttles are never set alike.
        let area_m2 = draw.size([6e-5, 1.2e-5, 6e-6, 3e-6]);
        draw.physics.network.throttle_m2[port] = Some(area_m2);
        applied.places.push(CHAMBERS[port]);
        let side = ["a", "b"][port];
        applied
            .parameters
            .insert(format!("outlet_{side}_m2"), area_m2);
    }
    applied
}

fn end_cushion(draw: &mut Draw<'_>) -> Applied {
    let needle_m2 = draw.size([3e-6, 8e-7, 4e-7, 2e-7]);
    let length_m = draw.random.between(0.018, 0.026);
    draw.physics.network.cushion = Some(Cushion {
        length_m,
        needle_m2,
    });
    let parameters = [("needle_area_m2", needle_m2), ("length_m", length_m)];
    Applied::new(CHAMBERS, "needle", parameters)
}
