"""Checks of the plant, by numbers: `python check.py plant` and `python check.py effects [--seeds N]`.

`plant`: mass and energy balance, halving of the sub-step, and a healthy plant against a second solution of the
equations of the dossier (A.1 to A.6, pressure and temperature as states, Runge-Kutta 4) with the true parameters.

`effects`: every effect at every strength is run; each 0.25 s the healthy plant starts from the same state on the same
commands. Printed is the rms difference of each signal over its noise, the largest over the six recordings.
"""

import argparse
from math import exp, pi

import numpy as np

import plant as p
from effects import EFFECTS, FADING, IMMATERIAL, STRENGTHS, draw_changes
from motion import controller, draw_motions
from rig import RESOLUTION, draw_rig, plant_of, sensor_noise, table_of

WINDOW_ROWS = 250


class Bench:
    """One rig with its motions, without noise."""

    def __init__(self, seed: int, to_the_ends: bool = False):
        self.rng = np.random.default_rng(seed)
        self.rig, truth, tank_m3 = draw_rig(self.rng)
        self.given, self.table = self.rig.given, table_of(truth)
        self.plant = plant_of(truth, tank_m3)
        self.control = controller(self.rng, self.rig)
        self.motions = draw_motions(self.rng, self.plant.stroke_m, to_the_ends)

    def record(self, name: str) -> p.Record:
        """An empty record of a motion."""
        return p.Record(self.motions[name], np.zeros((len(self.motions[name]), 5)))

    def start(self, plant: p.Plant, record: p.Record) -> p.Axis:
        """The axis where the motion begins."""
        return p.Axis(plant, record.reference[0, 0])

    def run(self, axis, plant, record, first, last, **options) -> None:
        """Runs some rows."""
        axis.run(plant, self.control, self.table, record, first, last, **options)


def stored(axis: p.Axis) -> tuple[float, float]:
    """Mass and internal energy of all gas."""
    return axis.gas[0].sum(), axis.gas[1].sum()


def check_balance(bench: Bench) -> None:
    """A plant with every path open: what is stored against what was booked at the reservoirs, walls and piston."""
    plant = bench.plant._replace(
        tube_length_m=1.5, piston_leak_m2=2e-7, chamber_leak_a_m2=2e-7, pocket_volume_m3=3e-5, pocket_area_m2=1e-6,
        feed_area_m2=4e-6, silencer_area_m2=4e-6, wall_excess_k=10.0, external_force_n=5.0,
    )  # fmt: skip
    record = bench.record("train-1")
    axis = bench.start(plant, record)
    mass_kg, energy_j = stored(axis)
    x_m = axis.state["x"][0]
    bench.run(axis, plant, record, 0, len(record.rows))
    s = axis.state[0]
    mass_left = stored(axis)[0] - mass_kg - s["booked_kg"]
    energy_left = stored(axis)[1] - energy_j - s["booked_j"] - s["heat_j"] + s["gas_work_j"]
    kinetic_j = 0.5 * plant.mass_kg * s["v"] ** 2
    work_left = s["gas_work_j"] - kinetic_j - s["friction_j"] - s["stop_j"] - 5.0 * (s["x"] - x_m)
    print(f"mass: {mass_left:.1e} kg of {abs(s['booked_kg']):.1e} kg that passed")
    print(f"gas energy: {energy_left:.1e} J of {abs(s['booked_j']):.1e} J that passed")
    print(f"work of the gas against carriage: {work_left:.1e} J of {s['friction_j']:.1e} J lost to friction")


def window_differences(bench, truth, other, names, **options) -> dict[str, np.ndarray]:
    """Rms difference per signal and recording, the other plant restarted each window from the true one's state."""
    differences = {}
    for name in names:
        record = bench.record(name)
        axis = bench.start(truth, record)
        twin_record = record.copy()
        for first in range(0, len(record.rows) - WINDOW_ROWS, WINDOW_ROWS):
            last = first + WINDOW_ROWS
            twin = axis.copy()
            twin.keep_pressures(truth, other)
            bench.run(axis, truth, record, first, last)
            twin_record.commands[:last] = record.commands[:last]
            twin_record.seen[:first] = record.seen[:first]
            bench.run(twin, other, twin_record, first, last, replay=True, **options)
        differences[name] = np.sqrt(np.mean((twin_record.rows[:last] - record.rows[:last]) ** 2, axis=0))
    return differences


def check_halving(bench: Bench) -> None:
    """Half the sub-step over windows of 0.25 s, healthy and with tubes."""
    for label, plant in (("healthy", bench.plant), ("tubes of 1 m", bench.plant._replace(tube_length_m=1.0))):
        found = window_differences(bench, plant, plant, ["train-1", "train-2"], steps=2 * p.STEPS_PER_ROW)
        worst = np.max(list(found.values()), axis=0)
        p_pa, x_um, v_mm_s = worst[:2].max(), worst[3] * 1e6, worst[4] * 1e3
        print(f"half the sub-step, {label}: p {p_pa:.1f} Pa, x {x_um:.2f} um, v {v_mm_s:.3f} mm/s")


def check_stops(rigs: int) -> None:
    """How near healthy carriages come to the hard stops, over some rigs."""
    furthest = 0.0
    for seed in range(rigs):
        bench = Bench(seed)
        for name in bench.motions:
            record = bench.record(name)
            bench.run(bench.start(bench.plant, record), bench.plant, record, 0, len(record.rows))
            furthest = max(furthest, np.abs(record.rows[:, 3]).max() / (0.5 * bench.plant.stroke_m))
    print(f"furthest from mid-stroke in {rigs} rigs: {furthest:.2f} of the way to the stop")


def flow(plant, area, up_pa, up_k, down_pa, down_k):
    """(1) and (2), signed."""
    if down_pa > up_pa:
        return -flow(plant, area, down_pa, down_k, up_pa, up_k)
    r, b, lam = down_pa / up_pa, plant.critical_ratio, plant.laminar_ratio
    psi = 1.0 if r <= b else (1.0 - ((min(r, lam) - b) / (1.0 - b)) ** 2) ** 0.5
    psi *= (1.0 - r) / (1.0 - lam) if r > lam else 1.0
    return area * (0.8153 + 0.0933 * r - 0.1038 * r * r) * 0.0404184 * up_pa / up_k**0.5 * psi


def chamber_rates(plant, pressure, temperature, volume, volume_rate, length, fill, vent):
    """(3) and (5) for the net of two paths; gas that enters from either side is at ambient temperature."""
    ambient_k, gamma, gas = p.AMBIENT_K, 1.4, 287.0
    inflow, outflow = max(fill, 0.0) + max(-vent, 0.0), max(-fill, 0.0) + max(vent, 0.0)
    h = plant.heat_charging_w_m2k if fill >= vent else plant.heat_discharging_w_m2k
    heat = h * (2.0 * plant.area_m2 + pi * plant.bore_m * length) * (ambient_k - temperature)
    enthalpy = inflow * ambient_k - outflow * temperature
    pressure_rate = -gamma * pressure * volume_rate / volume + gamma * gas / volume * enthalpy + 0.4 * heat / volume
    mixing = inflow * (gamma * ambient_k - temperature) - outflow * 0.4 * temperature
    temperature_rate = -0.4 * temperature * volume_rate / volume
    temperature_rate += temperature / (pressure * volume) * (gas * mixing + 0.4 * heat)
    return pressure_rate, temperature_rate


def dossier_rates(plant, table, state, opening):
    """Right-hand side of (1) to (11); state is x, v, z, p_a, T_a, p_b, T_b."""
    x, v, z, p_a, t_a, p_b, t_b = state
    fed, vented = np.interp(abs(opening), table[0], table[1]), np.interp(abs(opening), table[0], table[2])
    areas = (fed, table[2, 0], table[1, 0], vented) if opening >= 0.0 else (table[1, 0], vented, fed, table[2, 0])
    supply, room, cold = plant.supply_pressure_pa, p.AMBIENT_PA, p.AMBIENT_K
    length_a, length_b = 0.5 * plant.stroke_m + x, 0.5 * plant.stroke_m - x
    a = chamber_rates(
        plant, p_a, t_a, plant.dead_volume_a_m3 + plant.area_m2 * length_a, plant.area_m2 * v, length_a,
        flow(plant, areas[0], supply, cold, p_a, t_a), flow(plant, areas[1], p_a, t_a, room, cold),
    )  # fmt: skip
    b = chamber_rates(
        plant, p_b, t_b, plant.dead_volume_b_m3 + plant.area_m2 * length_b, -plant.area_m2 * v, length_b,
        flow(plant, areas[2], supply, cold, p_b, t_b), flow(plant, areas[3], p_b, t_b, room, cold),
    )  # fmt: skip
    level = plant.coulomb_n + (plant.static_n - plant.coulomb_n) * exp(-((v / plant.stribeck_m_s) ** 2))
    z_rate = v - plant.bristle_stiffness_n_m * abs(v) / level * z
    friction = plant.bristle_stiffness_n_m * z + plant.bristle_damping_ns_m * z_rate + plant.viscous_ns_m * v
    return np.array([v, ((p_a - p_b) * plant.area_m2 - friction) / plant.mass_kg, z_rate, *a, *b])


def dossier_run(plant, table, record, rows, dt_s=1e-5):
    """x, v, p_a, p_b at each row, by Runge-Kutta 4."""
    start = 0.6 * plant.supply_pressure_pa
    state = np.array([record.reference[0, 0], 0.0, 0.0, start, p.AMBIENT_K, start, p.AMBIENT_K])
    found = np.empty((rows, 4))
    for row in range(rows):
        found[row] = state[[0, 1, 3, 5]]
        opening = plant.feeds_a_sign * (record.commands[row] - plant.null_v)
        for _ in range(round(p.ROW_S / dt_s)):
            k1 = dossier_rates(plant, table, state, opening)
            k2 = dossier_rates(plant, table, state + 0.5 * dt_s * k1, opening)
            k3 = dossier_rates(plant, table, state + 0.5 * dt_s * k2, opening)
            k4 = dossier_rates(plant, table, state + dt_s * k3, opening)
            state = state + dt_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return found


def check_dossier(bench: Bench, rows: int = 700) -> None:
    """The healthy plant, free-running, against the dossier's equations on the same commands."""
    record = bench.record("train-2")
    bench.run(bench.start(bench.plant, record), bench.plant, record, 0, rows)
    expected = dossier_run(bench.plant, bench.table, record, rows)
    off = np.sqrt(np.mean((record.rows[:rows][:, [3, 4, 0, 1]] - expected) ** 2, axis=0))
    print(
        f"dossier's equations, {rows} ms free: x {off[0] * 1e6:.2f} um of {np.ptp(expected[:, 0]) * 1e3:.0f} mm, "
        f"v {off[1] * 1e3:.3f} mm/s, p {max(off[2:]):.1f} Pa"
    )


def check_effects(seeds: int) -> None:
    """Each effect at each strength, over the noise; the median over some rigs."""
    print("| effect | strength | p_a | p_b | p_s | x | v | on noise |")
    print("|---|---|---|---|---|---|---|---|")
    for name in EFFECTS:
        benches = [Bench(seed, to_the_ends=name == "end-cushion") for seed in range(seeds)]
        for strength in (IMMATERIAL, *STRENGTHS) if name in FADING else STRENGTHS:
            ratios = []
            for bench in benches:
                changes = draw_changes(name, strength, bench.plant, bench.given, bench.rng)
                healthy = bench.plant
                if name == "gas-temperature-dynamics":
                    healthy = healthy._replace(heat_charging_w_m2k=1e3, heat_discharging_w_m2k=1e3)
                found = window_differences(bench, bench.plant._replace(**changes), healthy, bench.motions)
                noise = np.hypot(sensor_noise(bench.rig), RESOLUTION / 12**0.5)
                ratios.append(np.max(list(found.values()), axis=0) / noise)
            median = np.median(ratios, axis=0)
            figures = " | ".join(f"{figure:.1f}" for figure in median)
            print(f"| {name} | {strength} | {figures} | {np.min(np.max(ratios, axis=1)):.1f} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("plant", "effects"))
    parser.add_argument("--seeds", type=int, default=1, help="rigs to try each effect on")
    arguments = parser.parse_args()
    if arguments.what == "effects":
        check_effects(arguments.seeds)
        return
    for seed in range(3):
        print(f"rig {seed}")
        bench = Bench(seed)
        check_balance(bench)
        check_halving(bench)
        check_dossier(bench)
    check_stops(20)


if __name__ == "__main__":
    main()
