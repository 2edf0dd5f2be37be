"""Left-out physics: what each effect does to the plant, how strongly, and where it is.

An effect has three sizes (weak, medium, strong) around the ranges of the dossier part C; a draw varies a size by a
tenth either way. `changes` turns a size into fields of `plant.Plant`, from the healthy plant, the rig file's values
and a random generator. `check.py effects` measures that each size can be seen in the recordings.

Places are those of `docs/verdict.md`. Effects that may begin late are those that wear, clog, leak or stick;
a tube does not grow within a recording.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from plant import Plant

STRENGTHS = ("weak", "medium", "strong")


@dataclass(frozen=True)
class Effect:
    """One left-out effect."""

    places: tuple[str, ...]
    sizes: tuple[float, float, float]
    changes: Callable[[float, Plant, dict, np.random.Generator], dict]
    may_begin_late: bool = False


CHAMBERS = ("chamber-a", "chamber-b")
GAUGES = ("sensor.p_a", "sensor.p_b")
TRANSDUCER = ("sensor.x", "sensor.v")


def field(name: str):
    """The size is a field of the plant."""
    return lambda size, plant, given, rng: {name: size}


def either_or_both(rng, first: dict, second: dict) -> dict:
    """One of two changes, or both."""
    return [first, second, first | second][rng.integers(3)]


def tube(size, plant, given, rng):
    """A hose of 4 mm at each port; wider cylinders get wider hoses."""
    return {"tube_length_m": size, "tube_diameter_m": 0.004 if plant.bore_m < 0.03 else 0.0055}


def spool(size, plant, given, rng):
    """P3 with a bandwidth below the catalogue's 100 Hz."""
    return {"spool_hz": size, "spool_damping": rng.uniform(0.6, 0.9)}


def piston_leak(size, plant, given, rng):
    """P8 as an orifice; the seal's circumference grows with the bore."""
    return {"piston_leak_m2": size * plant.bore_m / 0.025}


def chamber_leak(size, plant, given, rng):
    """P9 as an orifice, from either chamber or both."""
    area = size * plant.bore_m / 0.025
    return either_or_both(rng, {"chamber_leak_a_m2": area}, {"chamber_leak_b_m2": area})


def relative_to_valve(name: str):
    """An area as a fraction of the valve's full supply area."""
    return lambda size, plant, given, rng: {name: size * given["valve.supply_area_m2"][-1]}


def slow_gas(size, plant, given, rng):
    """The rig file ties temperature to pressure, (6); the gas has its own energy and a weakly coupled wall."""
    return {
        "heat_charging_w_m2k": size * plant.heat_charging_w_m2k,
        "heat_discharging_w_m2k": size * plant.heat_discharging_w_m2k,
    }


def variable_heat(size, plant, given, rng):
    """P13: density to the 0.7 at rest, and a part that grows with the flow."""
    return {"heat_density_exponent": 0.7, "heat_flow_w_m2k": size}


def dead_volume(size, plant, given, rng):
    """More volume than stated, by a multiple of the stated one; its standard deviation is 0.12."""
    a = {"dead_volume_a_m3": given["cylinder.dead_volume_a_m3"] * (1.0 + size)}
    b = {"dead_volume_b_m3": given["cylinder.dead_volume_b_m3"] * (1.0 + size)}
    return either_or_both(rng, a, b)


def friction_over_pressure(size, plant, given, rng):
    """M1: newtons per bar of mean gauge pressure, and 1.5 times as much per bar of difference."""
    return {"friction_per_mean_n_pa": 0.4 * size / 1e5, "friction_per_difference_n_pa": size / 1e5}


def friction_over_position(size, plant, given, rng):
    """M3."""
    return {
        "position_ratio": size,
        "position_wavelength_m": rng.uniform(0.06, 0.2),
        "position_phase_rad": rng.uniform(0.0, 2.0 * np.pi),
    }


def friction_over_direction(size, plant, given, rng):
    """M2, either way."""
    return {"direction_ratio": size * rng.choice([-1.0, 1.0])}


def dwell_stiction(size, plant, given, rng):
    """M4: newtons added to the static level by resting, as a multiple of Coulomb's."""
    return {"dwell_n": size * plant.coulomb_n, "dwell_s": rng.uniform(0.3, 1.0)}


def more_coulomb(size, plant, given, rng):
    """The stated level and a multiple of it; the static level rises as much. The standard deviation is 0.12."""
    added = given["friction.coulomb_N"] * (1.0 + size) - plant.coulomb_n
    return {"coulomb_n": plant.coulomb_n + added, "static_n": plant.static_n + added}


def more_viscous(size, plant, given, rng):
    """The stated coefficient and a multiple of it; the standard deviation is 0.15."""
    return {"viscous_ns_m": given["friction.viscous_Ns_m"] * (1.0 + size)}


def soft_load(size, plant, given, rng):
    """M8: part of the mass on a spring; the size is its frequency on a fixed carriage."""
    load_kg = rng.uniform(0.45, 0.65) * plant.mass_kg
    omega = 2.0 * np.pi * size
    damping = 2.0 * rng.uniform(0.03, 0.08) * omega * load_kg
    return {"load_mass_kg": load_kg, "load_stiffness_n_m": load_kg * omega**2, "load_damping_ns_m": damping}


def loose_load(size, plant, given, rng):
    """M9: part of the mass behind a gap, on a stiff contact."""
    return {
        "load_mass_kg": rng.uniform(0.45, 0.65) * plant.mass_kg,
        "load_stiffness_n_m": 2e5,
        "load_damping_ns_m": 120.0,
        "load_gap_m": size,
    }


def push(size, plant, given, rng):
    """M10, as a multiple of Coulomb's level, either way."""
    return {"external_force_n": size * plant.coulomb_n * rng.choice([-1.0, 1.0])}


def cushion(size, plant, given, rng):
    """M11: within the last part of the stroke the exhaust passes a needle; the size is the valve's area over it."""
    return {
        "cushion_length_m": rng.uniform(0.05, 0.08) * plant.stroke_m + 0.01,
        "cushion_area_m2": given["valve.supply_area_m2"][-1] / size,
    }


def gauge_offset(size, plant, given, rng):
    """S2, one gauge or both, each either way."""
    sign_a, sign_b = rng.choice([-1.0, 1.0], 2)
    return either_or_both(rng, {"gauge_offset_a_pa": sign_a * size}, {"gauge_offset_b_pa": sign_b * size})


LISTED = {
    "tube-line": Effect(("valve-flow",), (0.4, 0.9, 2.0), tube),
    "spool-dynamics": Effect(("valve-command",), (65.0, 38.0, 20.0), spool),
    "valve-hysteresis": Effect(("valve-command",), (0.05, 0.1, 0.2), field("hysteresis_v"), True),
    "valve-delay": Effect(("valve-command",), (0.002, 0.005, 0.012), field("delay_s"), True),
    "piston-leakage": Effect(CHAMBERS, (0.07e-6, 0.15e-6, 0.4e-6), piston_leak, True),
    "chamber-leakage": Effect(CHAMBERS, (0.05e-6, 0.12e-6, 0.3e-6), chamber_leak, True),
    "supply-droop": Effect(("supply",), (0.5, 0.28, 0.15), relative_to_valve("feed_area_m2"), True),
    "exhaust-back-pressure": Effect(("exhaust",), (0.45, 0.25, 0.14), relative_to_valve("silencer_area_m2"), True),
    "gas-temperature-dynamics": Effect(CHAMBERS, (1.0, 0.6, 0.3), slow_gas),
    "variable-heat-transfer": Effect(CHAMBERS, (120.0, 250.0, 500.0), variable_heat),
    "wall-temperature": Effect(CHAMBERS, (12.0, 20.0, 35.0), field("wall_excess_k")),
    "dead-volume": Effect(CHAMBERS, (0.7, 1.2, 2.2), dead_volume),
    "pressure-dependent-friction": Effect(("force-balance",), (2.5, 5.0, 9.0), friction_over_pressure),
    "position-dependent-friction": Effect(("force-balance",), (0.25, 0.4, 0.6), friction_over_position, True),
    "direction-dependent-friction": Effect(("force-balance",), (0.2, 0.35, 0.5), friction_over_direction, True),
    "dwell-stiction": Effect(("force-balance",), (1.0, 1.7, 2.5), dwell_stiction, True),
    "coulomb-friction": Effect(("force-balance",), (0.65, 1.1, 1.8), more_coulomb, True),
    "viscous-friction": Effect(("force-balance",), (0.8, 1.5, 2.6), more_viscous, True),
    "load-compliance": Effect(("force-balance",), (25.0, 16.0, 10.0), soft_load),
    "load-backlash": Effect(("force-balance",), (0.5e-3, 1.0e-3, 2.0e-3), loose_load),
    "constant-force": Effect(("force-balance",), (0.3, 0.6, 1.0), push, True),
    "end-cushion": Effect((*CHAMBERS, "valve-flow"), (20.0, 40.0, 80.0), cushion),
    "pressure-sensor-lag": Effect(GAUGES, (0.002, 0.005, 0.012), field("gauge_lag_s"), True),
    "pressure-sensor-offset": Effect(GAUGES, (3e3, 7e3, 15e3), gauge_offset, True),
    "position-time-skew": Effect(TRANSDUCER, (0.003, 0.006, 0.012), field("position_skew_s")),
    "slew-limit": Effect(("valve-command",), (120.0, 60.0, 30.0), field("slew_v_s"), True),
}


def hum(size, plant, given, rng):
    """Mains voltage on the command line."""
    return {"hum_v": size, "hum_hz": 50.0}


def drifting_area(size, plant, given, rng):
    """Moist air ices the spool's edges while air flows; they thaw within seconds."""
    return {"area_loss_ratio": size, "area_loss_s": rng.uniform(0.4, 1.2)}


def warming_friction(size, plant, given, rng):
    """Dry friction falls while the seal slides itself warm."""
    return {"warm_up_ratio": size, "warm_up_m": rng.uniform(0.3, 0.8)}


def cable(size, plant, given, rng):
    """A cable chain that unrolls: its drag grows along the stroke and is larger forth than back."""
    return {"cable_n": size * plant.coulomb_n}


def bumper(size, plant, given, rng):
    """A spring that the carriage meets beyond some point; the size is newtons over a tenth of the stroke."""
    return {"bumper_n_m": size / (0.1 * plant.stroke_m), "bumper_start_m": rng.uniform(-0.02, 0.04) * plant.stroke_m}


def eddy_brake(size, plant, given, rng):
    """A magnet over a metal rail: drag that peaks at a speed and falls beyond."""
    speed = rng.uniform(0.1, 0.2)
    return {"brake_ns_m": 2.0 * size / speed, "brake_peak_m_s": speed}


def worn_scale(size, plant, given, rng):
    """A periodic error of the position scale."""
    return {"scale_error_m": size, "scale_period_m": rng.uniform(0.015, 0.03)}


def pocket(size, plant, given, rng):
    """A blind space behind a narrow bore on chamber A."""
    return {"pocket_volume_m3": size * plant.dead_volume_a_m3, "pocket_area_m2": rng.uniform(0.4e-6, 1.0e-6)}


def hunting_regulator(size, plant, given, rng):
    """A supply that swings around its value."""
    return {"supply_pulse_pa": size, "supply_pulse_hz": rng.uniform(1.2, 4.0)}


def neighbour(size, plant, given, rng):
    """Another machine vents into the same manifold."""
    return {"exhaust_pulse_pa": size, "exhaust_pulse_hz": rng.uniform(0.7, 2.0)}


UNLISTED = {
    "mains-hum-on-command": Effect(("valve-command",), (0.15, 0.3, 0.6), hum),
    "amplifier-compression": Effect(("valve-command",), (2.5, 1.5, 0.9), field("compression_v")),
    "spool-flow-force": Effect(("valve-flow", "valve-command"), (0.4e-6, 0.8e-6, 1.6e-6), field("flow_force_1_pa")),
    "icing-edges": Effect(("valve-flow",), (0.15, 0.3, 0.5), drifting_area),
    "hunting-regulator": Effect(("supply",), (8e3, 16e3, 32e3), hunting_regulator),
    "neighbour-exhaust": Effect(("exhaust",), (60e3, 100e3, 160e3), neighbour),
    "blind-pocket": Effect(("chamber-a",), (1.0, 2.0, 4.0), pocket),
    "friction-warms-up": Effect(("force-balance",), (0.3, 0.5, 0.7), warming_friction),
    "cable-chain": Effect(("force-balance",), (0.4, 0.8, 1.4), cable),
    "bumper-spring": Effect(("force-balance",), (4.0, 9.0, 20.0), bumper),
    "eddy-brake": Effect(("force-balance",), (6.0, 14.0, 30.0), eddy_brake),
    "worn-scale": Effect(TRANSDUCER, (0.15e-3, 0.3e-3, 0.6e-3), worn_scale),
    "yielding-mount": Effect(TRANSDUCER, (3e5, 1.5e5, 0.7e5), field("mount_stiffness_n_m")),
    "gauge-bow": Effect(("sensor.p_a",), (6e3, 12e3, 24e3), field("gauge_bow_a_pa")),
    "ringing-gauges": Effect(GAUGES, (45.0, 32.0, 22.0), field("gauge_ringing_hz")),
    "filtered-velocity": Effect(("sensor.v",), (0.004, 0.01, 0.025), field("velocity_filter_s")),
}

EFFECTS = LISTED | UNLISTED

# Effects whose law fades to nothing with their size; a short tube or a stiff spring is another law's matter.
FADING = (
    "valve-hysteresis", "valve-delay", "spool-dynamics", "slew-limit", "piston-leakage", "chamber-leakage",
    "supply-droop", "exhaust-back-pressure", "wall-temperature", "pressure-dependent-friction",
    "position-dependent-friction", "direction-dependent-friction", "dwell-stiction", "constant-force",
    "pressure-sensor-lag", "pressure-sensor-offset", "position-time-skew",
)  # fmt: skip
IMMATERIAL = "immaterial"
DIRT = 0.02  # of the weak size: a tenth of the noise in the pressures

# Sizes that fall as the effect grows: a narrow feed starves more than a wide one.
INVERSE = {name for name, effect in EFFECTS.items() if effect.sizes[0] > effect.sizes[2]}


def draw_changes(name: str, strength: str, plant: Plant, given: dict, rng) -> dict:
    """The plant's fields with one effect."""
    effect = EFFECTS[name]
    size = rng.uniform(0.9, 1.1)
    if strength == IMMATERIAL:
        size *= effect.sizes[0] * (1.0 / DIRT if name in INVERSE else DIRT)
    else:
        size *= effect.sizes[STRENGTHS.index(strength)]
    return {key: float(value) for key, value in effect.changes(size, plant, given, rng).items()}


def places_of(name: str, changes: dict) -> list[str]:
    """Where the effect is, down to the side that it was drawn for."""
    places = EFFECTS[name].places
    for place, mark in (("chamber-a", "_a_"), ("chamber-b", "_b_"), ("sensor.p_a", "_a_"), ("sensor.p_b", "_b_")):
        sided = any("_a_" in key or "_b_" in key for key in changes)
        if sided and place in places and not any(mark in key for key in changes):
            places = tuple(other for other in places if other != place)
    return list(places)
