"""Draws a rig: the file an engineer would write, and the plant as it truly is.

Values without an entry in [uncertainty] are exact. The others are true = given (1 + sigma n), n normal and clipped at
2.5; absolute for valve.null_V. Ranges are those of the dossier part B and of the practice rigs.
"""

from dataclasses import dataclass

import numpy as np

from plant import Plant

CLIP = 2.5

UNCERTAINTY = {
    "supply.pressure_Pa": 0.004,
    "valve.null_V": 0.025,
    "valve.critical_pressure_ratio": 0.06,
    "valve.opening_V": 0.03,
    "valve.supply_area_m2": 0.05,
    "valve.exhaust_area_m2": 0.05,
    "cylinder.dead_volume_a_m3": 0.12,
    "cylinder.dead_volume_b_m3": 0.12,
    "chambers.heat_transfer_charging_W_m2K": 0.25,
    "chambers.heat_transfer_discharging_W_m2K": 0.25,
    "carriage.mass_kg": 0.02,
    "friction.viscous_Ns_m": 0.15,
    "friction.coulomb_N": 0.12,
    "friction.static_N": 0.12,
    "friction.stribeck_velocity_m_s": 0.2,
}

# Fractions of full opening at which an engineer samples the curve: dense around the end of the overlap.
KNOTS = np.array(
    [0, 0.02, 0.035, 0.045, 0.055, 0.065, 0.075, 0.09, 0.11, 0.14, 0.18, 0.23, 0.3, 0.38, 0.48, 0.6, 0.72, 0.86, 1.0]
)


@dataclass
class Rig:
    """What is written into rig.toml, and the noise of the sensors."""

    given: dict  # "section.key": value
    noise_scale: float
    has_supply_gauge: bool


def rounded(value, digits=4):
    """As typed: so many significant digits."""
    return np.vectorize(lambda x: float(f"{x:.{digits}g}"))(value)


def draw_table(rng, scale: float) -> dict:
    """A smooth spool curve, sampled: nothing within the overlap, then rising, flattening at full opening."""
    full_v = rng.uniform(4.6, 5.0)
    overlap = rng.uniform(0.18, 0.34) / full_v
    travel = np.clip((KNOTS - overlap) / (1.0 - overlap), 0.0, 1.0)
    curve = np.sin(0.5 * np.pi * travel) ** rng.uniform(1.05, 1.4)
    leak_m2 = rng.uniform(0.05e-6, 0.13e-6)
    supply = scale * (leak_m2 + rng.uniform(14e-6, 19e-6) * curve)
    return {
        "valve.opening_V": rounded(full_v * KNOTS),
        "valve.supply_area_m2": rounded(supply),
        "valve.exhaust_area_m2": rounded(supply * rng.uniform(0.9, 1.18)),
    }


def draw_given(rng) -> dict:
    """The rig file's values."""
    bore_m = 0.025 if rng.random() < 0.75 else float(rng.choice([0.02, 0.032, 0.04]))
    scale = (bore_m / 0.025) ** 2
    stroke_m = float(rng.choice([0.3, 0.4, 0.5], p=[0.2, 0.2, 0.6]))
    coulomb = rng.uniform(13.0, 38.0) * scale**0.5
    given = {
        "supply.pressure_Pa": rounded(rng.uniform(5.0e5, 7.5e5)),
        "valve.feeds_a_when": "above-null" if rng.random() < 0.8 else "below-null",
        "valve.null_V": round(rng.uniform(4.88, 5.12), 3),
        "valve.critical_pressure_ratio": round(rng.uniform(0.24, 0.37), 3),
        "valve.laminar_pressure_ratio": 0.985,
        **draw_table(rng, scale**0.8),
        "cylinder.stroke_m": stroke_m,
        "cylinder.bore_m": bore_m,
        "cylinder.area_m2": rounded(0.25 * np.pi * bore_m**2),
        "cylinder.dead_volume_a_m3": rounded(rng.uniform(14e-6, 40e-6) * scale, 3),
        "cylinder.dead_volume_b_m3": rounded(rng.uniform(14e-6, 40e-6) * scale, 3),
        "cylinder.position_zero": "mid-stroke" if rng.random() < 0.85 else "end-a",
        "chambers.model": "energy-balance",
        "chambers.heat_transfer_charging_W_m2K": rounded(rng.uniform(38.0, 65.0), 3),
        "chambers.heat_transfer_discharging_W_m2K": rounded(rng.uniform(15.0, 28.0), 3),
        "carriage.mass_kg": round(min(8.0, rng.uniform(1.0, 5.5) * scale**0.7), 3),
        "friction.viscous_Ns_m": rounded(rng.uniform(42.0, 100.0), 3),
        "friction.coulomb_N": rounded(coulomb, 3),
        "friction.static_N": rounded(coulomb * rng.uniform(1.3, 1.65), 3),
        "friction.stribeck_velocity_m_s": rounded(rng.uniform(0.0045, 0.009), 3),
    }
    return {key: value if isinstance(value, (str, np.ndarray)) else float(value) for key, value in given.items()}


def deviations(rng) -> dict:
    """How far the truth is from what was typed, in standard deviations."""
    return {key: float(np.clip(rng.normal(), -CLIP, CLIP)) for key in UNCERTAINTY}


def true_values(given: dict, deviation: dict) -> dict:
    """The truth behind a rig file."""
    truth = dict(given)
    for key, sigma in UNCERTAINTY.items():
        moved = sigma * deviation[key]
        truth[key] = given[key] + moved if key.endswith("_V") and "opening" not in key else given[key] * (1.0 + moved)
    return truth


def draw_truth(rng, given: dict) -> dict:
    """True values; a static level below Coulomb's would be no friction law, so it is drawn again."""
    while True:
        truth = true_values(given, deviations(rng))
        if truth["friction.static_N"] > 1.1 * truth["friction.coulomb_N"]:
            return truth


def plant_of(truth: dict, tank_volume_m3: float) -> Plant:
    """The healthy plant with those values."""
    return Plant(
        supply_pressure_pa=truth["supply.pressure_Pa"],
        null_v=truth["valve.null_V"],
        feeds_a_sign=1.0 if truth["valve.feeds_a_when"] == "above-null" else -1.0,
        critical_ratio=truth["valve.critical_pressure_ratio"],
        laminar_ratio=truth["valve.laminar_pressure_ratio"],
        stroke_m=truth["cylinder.stroke_m"],
        bore_m=truth["cylinder.bore_m"],
        area_m2=truth["cylinder.area_m2"],
        dead_volume_a_m3=truth["cylinder.dead_volume_a_m3"],
        dead_volume_b_m3=truth["cylinder.dead_volume_b_m3"],
        heat_charging_w_m2k=truth["chambers.heat_transfer_charging_W_m2K"],
        heat_discharging_w_m2k=truth["chambers.heat_transfer_discharging_W_m2K"],
        mass_kg=truth["carriage.mass_kg"],
        viscous_ns_m=truth["friction.viscous_Ns_m"],
        coulomb_n=truth["friction.coulomb_N"],
        static_n=truth["friction.static_N"],
        stribeck_m_s=truth["friction.stribeck_velocity_m_s"],
        bristle_stiffness_n_m=9.14e5,  # the paper's bristle, in every practice rig
        bristle_damping_ns_m=1327.0,
        tank_volume_m3=tank_volume_m3,
    )


def table_of(truth: dict) -> np.ndarray:
    """The valve table that the plant uses."""
    return np.array([truth[f"valve.{name}"] for name in ("opening_V", "supply_area_m2", "exhaust_area_m2")])


def draw_rig(rng) -> tuple[Rig, dict, float]:
    """A rig, its true values and its tank."""
    given = draw_given(rng)
    rig = Rig(given, noise_scale=float(rounded(rng.uniform(1.0, 3.0), 2)), has_supply_gauge=rng.random() < 0.7)
    return rig, draw_truth(rng, given), rng.uniform(0.6e-3, 1.5e-3)


def sensor_noise(rig: Rig) -> np.ndarray:
    """Standard deviations of p_a, p_b, p_s, x, v: the practice rigs' times a factor."""
    return rig.noise_scale * np.array([250.0, 250.0, 250.0, 4e-6, 1.5e-3])


RESOLUTION = np.array([244.0, 244.0, 244.0, 7.6e-6, 0.0])  # 12 bits of 10 bar, 16 bits of 500 mm; v is not rounded


def listed(values) -> str:
    return "[" + ", ".join(f"{value:.4g}" for value in values) + "]"


def rig_toml(rig: Rig) -> str:
    """The rig file."""
    g = rig.given
    noise = sensor_noise(rig)
    gauge = f'unit = "Pa(abs)", noise = {noise[0]:.1f}, resolution = 244.0'
    supply_gauge = f'p_s = {{ column = "p_s_Pa", {gauge} }}\n' if rig.has_supply_gauge else ""
    uncertainty = "\n".join(f'"{key}" = {sigma}' for key, sigma in UNCERTAINTY.items())
    return f"""format = "rig/1"

[signals]
t = {{ column = "t_s", unit = "s" }}
u = {{ column = "u_V", unit = "V" }}
p_a = {{ column = "p_a_Pa", {gauge} }}
p_b = {{ column = "p_b_Pa", {gauge} }}
{supply_gauge}x = {{ column = "x_m", unit = "m", noise = {noise[3]:.2e}, resolution = 7.6e-6 }}
v = {{ column = "v_m_s", unit = "m/s", noise = {noise[4]:.2e} }}

[gas]
gamma = 1.4
gas_constant_J_kgK = 287.0

[environment]
pressure_Pa = 101325.0
temperature_K = 293.15

[supply]
pressure_Pa = {g["supply.pressure_Pa"]:.1f}

[valve]
feeds_a_when = "{g["valve.feeds_a_when"]}"
null_V = {g["valve.null_V"]:.3f}
critical_pressure_ratio = {g["valve.critical_pressure_ratio"]:.3f}
laminar_pressure_ratio = 0.985
opening_V = {listed(g["valve.opening_V"])}
supply_area_m2 = {listed(g["valve.supply_area_m2"])}
exhaust_area_m2 = {listed(g["valve.exhaust_area_m2"])}

[cylinder]
stroke_m = {g["cylinder.stroke_m"]}
bore_m = {g["cylinder.bore_m"]}
area_a_m2 = {g["cylinder.area_m2"]:.4g}
area_b_m2 = {g["cylinder.area_m2"]:.4g}
dead_volume_a_m3 = {g["cylinder.dead_volume_a_m3"]:.3g}
dead_volume_b_m3 = {g["cylinder.dead_volume_b_m3"]:.3g}
position_zero = "{g["cylinder.position_zero"]}"

[chambers]
model = "{g["chambers.model"]}"
heat_transfer_charging_W_m2K = {g["chambers.heat_transfer_charging_W_m2K"]:.3g}
heat_transfer_discharging_W_m2K = {g["chambers.heat_transfer_discharging_W_m2K"]:.3g}
expansion_index = 1.11
compression_index = 1.18

[carriage]
mass_kg = {g["carriage.mass_kg"]:.3f}
external_force_N = 0.0

[friction]
bristle_stiffness_N_m = 9.14e5
bristle_damping_Ns_m = 1327.0
viscous_Ns_m = {g["friction.viscous_Ns_m"]:.3g}
coulomb_N = {g["friction.coulomb_N"]:.3g}
static_N = {g["friction.static_N"]:.3g}
stribeck_velocity_m_s = {g["friction.stribeck_velocity_m_s"]:.3g}

[uncertainty]  # one standard deviation, relative unless the key ends in _V
{uncertainty}
"""
