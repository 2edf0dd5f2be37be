//! Effects in the balance of forces.

use super::{Applied, Draw, Effect, FORCE, Form, Strength};
use crate::plant::friction::{Dwell, Wave, Zone};
use crate::plant::mechanics::Load;

pub(super) const EFFECTS: &[Effect] = &[
    Effect {
        name: "pressure-dependent-friction",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: pressure_dependent,
    },
    Effect {
        name: "position-dependent-friction",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: position_dependent,
    },
    Effect {
        name: FRICTION_ZONE,
        on_list: true,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: true,
        apply: friction_zone,
    },
    Effect {
        name: "direction-dependent-friction",
        on_list: true,
        may_begin: true,
        has_other_form: false,
        may_be_immaterial: true,
        apply: direction_dependent,
    },
    Effect {
        name: "dwell-stiction",
        on_list: true,
        may_begin: true,
        has_other_form: true,
        may_be_immaterial: true,
        apply: dwell_stiction,
    },
    Effect {
        name: "load-compliance",
        on_list: true,
        may_begin: false,
        has_other_form: false,
        may_be_immaterial: true,
        apply: load_compliance,
    },
    Effect {
        name: "load-backlash",
        on_list: true,
        may_begin: false,
        has_other_form: true,
        may_be_immaterial: true,
        apply: load_backlash,
    },
    Effect {
        name: "constant-force",
        on_list: true,
        may_begin: true,
        has_other_form: false,
        may_be_immaterial: true,
        apply: constant_force,
    },
];

const BAR_PA: f64 = 1e5;

/// A form of `position-dependent-friction` that is asked for by a name of its own.
pub(crate) const FRICTION_ZONE: &str = "friction-zone";

fn pressure_dependent(draw: &mut Draw<'_>) -> Applied {
    let mean_n_per_pa = draw.size([0.1, 1.0, 3.0, 6.0]) / BAR_PA;
    let difference_n_per_pa = draw.size([0.05, 0.5, 1.5, 3.0]) / BAR_PA;
    let friction = &mut draw.physics.mechanics.friction;
    friction.per_mean_pressure_n_per_pa = mean_n_per_pa;
    friction.per_difference_n_per_pa = difference_n_per_pa;
    let form = match draw.form {
        Form::Usual => "linear",
        Form::Other => {
            friction.mean_pressure_exponent = 2.0;
            "quadratic in the mean pressure"
        }
    };
    let parameters = [
        ("per_mean_pressure_N_Pa", mean_n_per_pa),
        ("per_pressure_difference_N_Pa", difference_n_per_pa),
    ];
    Applied::new(FORCE, form, parameters)
}

fn position_dependent(draw: &mut Draw<'_>) -> Applied {
    let wave = Wave {
        amplitude: draw.size([0.008, 0.08, 0.2, 0.4]),
        period_m: draw.random.between(0.04, 0.2),
        phase_rad: draw.random.between(0.0, 2.0 * core::f64::consts::PI),
        triangular: draw.form == Form::Other,
    };
    draw.physics.mechanics.friction.wave = Some(wave);
    let form = if wave.triangular { "triangle" } else { "sine" };
    let parameters = [
        ("cosine", wave.amplitude * libm::sin(wave.phase_rad)),
        ("sine", wave.amplitude * libm::cos(wave.phase_rad)),
        ("wavelength_m", wave.period_m),
    ];
    Applied::new(FORCE, form, parameters)
}

fn friction_zone(draw: &mut Draw<'_>) -> Applied {
    let half_m = draw.physics.mechanics.half_stroke_m;
    let length_m = draw.random.between(0.1, 0.5) * half_m;
    let middle_m = draw.random.between(-0.4, 0.4) * half_m;
    let zone = Zone {
        more: draw.size([0.02, 0.2, 0.5, 1.0]),
        from_m: middle_m - 0.5 * length_m,
        to_m: middle_m + 0.5 * length_m,
        border_m: draw.random.between(0.02, 0.2) * length_m,
    };
    draw.physics.mechanics.friction.zone = Some(zone);
    let parameters = [
        ("zone_share", zone.more),
        ("zone_middle_m", middle_m),
        ("zone_length_m", length_m + zone.border_m),
    ];
    Applied::new(FORCE, "zone with even borders", parameters)
}

fn direction_dependent(draw: &mut Draw<'_>) -> Applied {
    let asymmetry = draw.size([0.006, 0.06, 0.15, 0.3]) * draw.random.sign();
    draw.physics.mechanics.friction.asymmetry = asymmetry;
    Applied::new(FORCE, "Coulomb and static", [("asymmetry", asymmetry)])
}

fn dwell_stiction(draw: &mut Draw<'_>) -> Applied {
    let dwell = Dwell {
        growth_n: draw.size([0.8, 8.0, 20.0, 45.0]),
        time_constant_s: draw.random.between(0.5, 2.0),
        logarithmic: draw.form == Form::Other,
    };
    draw.physics.mechanics.friction.dwell = Some(dwell);
    let form = if dwell.logarithmic {
        "logarithm of the rest"
    } else {
        "exponential of the rest"
    };
    let parameters = [
        ("rise_N", dwell.growth_n),
        ("time_constant_s", dwell.time_constant_s),
    ];
    Applied::new(FORCE, form, parameters)
}

/// Puts a share of the moving mass on a coupling with that damping ratio.
fn couple(draw: &mut Draw<'_>, stiffness_n_per_m: f64, damping: f64) -> Load {
    let whole_kg = draw.physics.mechanics.mass_kg;
    let share = draw.random.between(0.4, 0.6);
    let reduced_kg = whole_kg * share * (1.0 - share);
    Load {
        mass_kg: whole_kg * share,
        stiffness_n_per_m,
        damping_n_s_per_m: 2.0 * damping * (stiffness_n_per_m * reduced_kg).sqrt(),
        gap_m: 0.0,
        guide_n: 0.0,
    }
}

fn load_compliance(draw: &mut Draw<'_>) -> Applied {
    let stiffness_n_per_m = draw.size([5e6, 4e5, 1e5, 3e4]);
    let damping = draw.random.between(0.03, 0.06);
    let load = couple(draw, stiffness_n_per_m, damping);
    draw.physics.mechanics.load = Some(load);
    let parameters = [
        ("load_mass_kg", load.mass_kg),
        ("stiffness_N_m", load.stiffness_n_per_m),
        ("damping_Ns_m", load.damping_n_s_per_m),
    ];
    Applied::new(FORCE, "spring and damper", parameters)
}

fn load_backlash(draw: &mut Draw<'_>) -> Applied {
    let gap_m = draw.size([1e-5, 0.2e-3, 0.5e-3, 1.2e-3]);
    // In next to no play a load hangs on its contact alone: where the play is not to matter, nor
    // is that as a spring.
    let contact_n_per_m = match draw.strength {
        Strength::Immaterial => 5e6,
        _ => 2e5,
    };
    let mut load = couple(draw, contact_n_per_m, 0.1);
    load.gap_m = gap_m;
    let form = match draw.form {
        Form::Usual => "free load",
        Form::Other => {
            load.guide_n = 2.0;
            "load with friction of its own"
        }
    };
    draw.physics.mechanics.load = Some(load);
    let parameters = [
        ("load_mass_kg", load.mass_kg),
        ("gap_m", gap_m),
        ("stiffness_N_m", load.stiffness_n_per_m),
        ("damping_Ns_m", load.damping_n_s_per_m),
        ("guide_N", load.guide_n),
    ];
    Applied::new(FORCE, form, parameters)
}

fn constant_force(draw: &mut Draw<'_>) -> Applied {
    let force_n = draw.size([0.15, 1.5, 5.0, 12.0]) * draw.random.sign();
    draw.physics.mechanics.constant_n = force_n;
    Applied::new(FORCE, "constant", [("force_N", force_n)])
}
