//! The axis that the tests step.

use truth_plant::plant::Physics;
use truth_plant::plant::friction::{Friction, Presliding};
use truth_plant::plant::gas::{FlowShape, Leak, Node, PAPER_DISCHARGE};
use truth_plant::plant::heat::Heat;
use truth_plant::plant::mechanics::Mechanics;
use truth_plant::plant::network::{Cylinder, Network, Supply};
use truth_plant::plant::sensors::Sensors;
use truth_plant::plant::valve::{AreaCurve, Areas, CommandPath, OPENINGS_V};

/// The surroundings.
pub const AMBIENT: Node = Node {
    pressure_pa: 101_325.0,
    temperature_k: 293.15,
};

/// The seed paper's axis with middling numbers and no effect.
pub fn axis() -> Physics {
    let curve = AreaCurve {
        overlap_v: 0.25,
        largest_m2: 17e-6,
        leak_m2: 0.1e-6,
        shape: 1.25,
        span_v: 3.0,
    };
    Physics {
        command: CommandPath::default(),
        areas: Areas {
            null_v: 5.0,
            openings_v: OPENINGS_V.to_vec(),
            supply_m2: curve.table_m2().to_vec(),
            asymmetry: 1.05,
            exhaust_late_v: 0.0,
        },
        network: Network {
            ambient: AMBIENT,
            supply: Supply {
                pressure_pa: 700e3,
                tank: None,
                ripple: 0.0,
                ripple_hz: 0.0,
            },
            silencer: None,
            flow: FlowShape {
                critical_ratio: 0.3,
                laminar_ratio: 0.985,
                discharge: PAPER_DISCHARGE,
            },
            area_by_temperature: 0.0,
            line: None,
            cylinder: Cylinder {
                stroke_m: 0.5,
                bore_m: 0.025,
                area_m2: [4.909e-4; 2],
                dead_volume_m3: [20e-6, 30e-6],
            },
            cushion: None,
            throttle_m2: [None; 2],
            piston_leak: Leak::default(),
            chamber_leak: [Leak::default(); 2],
            heat: Heat {
                charging_w_per_m2_k: 50.0,
                discharging_w_per_m2_k: 20.0,
                per_flow_w_per_m2_k: 0.0,
                density_exponent: 0.0,
                eichelberg_exponent: 0.0,
            },
            wall: None,
        },
        mechanics: Mechanics {
            mass_kg: 2.0,
            friction: Friction {
                presliding: Presliding::LuGre,
                stiffness_n_per_m: 9.14e5,
                damping_n_s_per_m: 1327.0,
                viscous_n_s_per_m: 64.5,
                quadratic_n_s2_per_m2: 0.0,
                coulomb_n: 20.2,
                static_n: 28.9,
                stribeck_m_per_s: 5.03e-3,
                per_mean_pressure_n_per_pa: 0.0,
                per_difference_n_per_pa: 0.0,
                mean_pressure_exponent: 1.0,
                asymmetry: 0.0,
                wave: None,
                zone: None,
                dwell: None,
            },
            constant_n: 0.0,
            load: None,
            cable: None,
            spring: None,
            cogging: None,
            drift_n_per_s: 0.0,
            disturbance: None,
            half_stroke_m: 0.25,
        },
        sensors: Sensors {
            pressure_lag_s: 0.0,
            second_pressure_lag_s: 0.0,
            pressure_offset_pa: [0.0; 2],
            pressure_gain: [1.0; 2],
            position_gain: 1.0,
            position_late_s: 0.0,
            position_wave_m: [0.0, 1.0],
            pressure_noise_pa: 0.0,
            position_noise_m: 0.0,
            speed_noise_m_per_s: 0.0,
        },
    }
}
