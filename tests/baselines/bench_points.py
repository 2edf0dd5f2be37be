"""The numbers of `pneuma identify` beside fits of the same points by SciPy.

    pneuma identify friction    --rig rig.toml sliding-*.csv --json friction.json
    pneuma identify valve-flow  --rig rig.toml staircase.csv ratio.csv --json valve.json
    pneuma identify dead-volume --rig rig.toml pushed.csv --json dead.json
    pneuma identify spool       --rig rig.toml staircase.csv sines.csv --json spool.json
    pneuma identify heat-transfer --rig rig.toml charging-*.csv --json heat.json
    pneuma identify presliding  --rig rig.toml presliding.csv --json presliding.json
    python tests/baselines/bench_points.py friction.json valve.json dead.json spool.json \
        heat.json=FOLDER presliding.json=FOLDER

Each JSON file holds the points of its pictures; heat transfer and presliding are fitted to the
recordings themselves, in the folder with their rig.toml. Here the laws are written down again and
fitted by `scipy.optimize`; a line says both numbers and how far they are apart in the stated
deviation.
"""

import csv
import json
import pathlib
import sys
import tomllib

import numpy as np
from scipy.optimize import curve_fit, least_squares


def stribeck(speed, coulomb, rise, velocity, viscous):
    fall = np.exp(-((speed / velocity) ** 2))
    return np.sign(speed) * (coulomb + rise * fall) + viscous * speed


def friction(content):
    """(11) of the paper at the lowest pressure, units N and m/s."""
    curves = content["pictures"][0]["curves"]
    points = np.array(next(one["points"] for one in curves if one["kind"] == "points"))
    speed, force = 1e-3 * points[:, 0], points[:, 1]
    (coulomb, rise, velocity, viscous), _ = curve_fit(
        stribeck, speed, force, p0=[np.median(np.abs(force)), 5.0, 5e-3, 50.0]
    )
    return {
        "friction.coulomb_N": coulomb,
        "friction.static_N": coulomb + rise,
        "friction.stribeck_velocity_m_s": abs(velocity),
        "friction.viscous_Ns_m": viscous,
    }


def shape(ratio, scale, critical, slope):
    beyond = np.clip((ratio - critical) / (1.0 - critical), 0.0, None)
    discharge = 0.8153 + slope * ratio - 0.1038 * ratio**2
    return scale * discharge * np.sqrt(np.clip(1.0 - beyond**2, 0.0, None))


def valve_flow(content):
    """Cd(r) psi(r) of the widest command that was held over the pressure ratios."""
    curves = content["pictures"][-1]["curves"]
    points = np.array([one["points"] for one in curves if one["kind"] == "points"][-1])
    (_, critical, slope), _ = curve_fit(
        shape, points[:, 0], points[:, 1], p0=[1.0, 0.3, 0.09], bounds=([0.5, 0.05, -0.1], [2.0, 0.8, 0.25])
    )
    return {"valve.critical_pressure_ratio": critical, "valve.discharge_slope": slope}


def lag(frequency, natural, damping, delay):
    """Gain in dB and phase in degrees of a second-order lag and a dead time, one after the other."""
    ratio = frequency / natural
    response = np.exp(-2j * np.pi * frequency * delay) / (1 - ratio**2 + 2j * damping * ratio)
    return np.concatenate([20 * np.log10(np.abs(response)), np.degrees(np.unwrap(np.angle(response)))])


def spool(content):
    """Natural frequency, damping and dead time of the smallest amplitude's gains and phases."""
    gains, phases = (
        np.array(next(one["points"] for one in picture["curves"] if one["kind"] == "points"))
        for picture in content["pictures"][-2:]
    )
    measured = np.concatenate([gains[:, 1], phases[:, 1]])
    (natural, damping, delay), _ = curve_fit(
        lambda frequency, *numbers: lag(frequency[: len(gains)], *numbers),
        np.concatenate([gains[:, 0], phases[:, 0]]),
        measured,
        p0=[80.0, 0.7, 5e-4],
    )
    return {
        "effects.spool-dynamics.natural_frequency_Hz": natural,
        "effects.spool-dynamics.damping_ratio": damping,
        "effects.valve-delay.delay_s": delay,
    }


def dead_volume(content):
    """Volume per pressure: a line over the length, its slope the piston area; no leak."""
    found = {}
    for curve, key in zip(
        [one for one in content["pictures"][0]["curves"] if one["kind"] != "law"],
        ["cylinder.dead_volume_a_m3", "cylinder.dead_volume_b_m3"],
    ):
        points = np.array(curve["points"])
        lines = [one for one in content["pictures"][0]["curves"] if one["kind"] == "law"]
        (x0, y0), (x1, y1) = lines[len(found)]["points"]
        area = (y1 - y0) / (x1 - x0)
        # 1/p = (Vd + A l)/c: linear in 1 and l; Vd is A times the ratio of both.
        slope, intercept = np.polyfit(points[:, 0], points[:, 1], 1)
        found[key] = 1e-6 * area * intercept / slope
    return found


SCALES = {"s": 1, "V": 1, "N": 1, "Pa(abs)": 1, "m": 1, "mm": 1e-3, "um": 1e-6}


def recorded(folder, rig, file):
    """Signals of a recording in SI."""
    with open(pathlib.Path(folder) / file, encoding="utf-8") as lines:
        rows = list(csv.reader(lines))
    table = dict(zip(rows[0], np.array(rows[1:], float).T))
    known = {name: one for name, one in rig["signals"].items() if one["unit"] in SCALES}
    return {name: table[one["column"]] * SCALES[one["unit"]] for name, one in known.items()}


def stopped_run(folder, rig, stretch):
    """One run of the stop method: a function of the heat transfer, zero where both masses agree."""
    signals = recorded(folder, rig, stretch["recording"])
    time, pressure = signals["t"], signals["p_a"]
    opened, stopped = np.searchsorted(time, [stretch["from_s"], stretch["to_s"]])
    gas, wall = rig["gas"]["gas_constant_J_kgK"], rig["environment"]["temperature_K"]
    ratio, cylinder = rig["gas"]["gamma"], rig["cylinder"]
    length = np.mean(signals["x"]) + 0.5 * cylinder["stroke_m"]
    volume = cylinder["dead_volume_a_m3"] + cylinder["area_a_m2"] * length
    surface = 2 * cylinder["area_a_m2"] + np.pi * cylinder["bore_m"] * length
    # What the pressure settles at: an exponential and a leak, from 30 ms after the stop.
    after = time > time[stopped] + 0.03
    since = time[after] - time[stopped]
    (settled, above, tau, leak), _ = curve_fit(
        lambda t, settled, above, tau, leak: settled + above * np.exp(-t / tau) + leak * t,
        since,
        pressure[after],
        p0=[pressure[-1], pressure[stopped] - pressure[-1], 1.0, 0.0],
        bounds=([0.0, -np.inf, 0.05, -np.inf], [np.inf, np.inf, 100.0, np.inf]),
    )
    begin = np.mean(pressure[max(opened - 400, 0) : opened])
    rows = slice(opened, stopped + 1)
    course = pressure[rows].copy()
    course[0], course[-1] = begin, settled + above
    fills = settled > begin
    cp = ratio * gas / (ratio - 1)

    def apart(heat_transfer):
        """The masses' difference as a pressure; four stages of Runge and Kutta from row to row."""

        def rate(here, slope, mass):
            temperature = here * volume / (mass * gas)
            heat = heat_transfer * surface * (wall - temperature)
            return (volume * slope / (ratio - 1) - heat) / (cp * (wall if fills else temperature))

        mass = begin * volume / (gas * wall)
        for step, here, there in zip(np.diff(time[rows]), course[:-1], course[1:]):
            slope, middle = (there - here) / step, 0.5 * (here + there)
            one = rate(here, slope, mass)
            two = rate(middle, slope, mass + 0.5 * step * one)
            three = rate(middle, slope, mass + 0.5 * step * two)
            four = rate(there, slope, mass + step * three)
            mass += step * (one + 2 * two + 2 * three + four) / 6
        return mass * gas * wall / volume - settled

    return fills, apart


def heat_transfer(content, folder):
    """One number for the runs of a kind, all with the same weight."""
    with open(pathlib.Path(folder) / "rig.toml", "rb") as file:
        rig = tomllib.load(file)
    runs = [stopped_run(folder, rig, stretch) for stretch in content["stretches"]]
    found = {}
    for kind, key in [(True, "charging"), (False, "discharging")]:
        of_kind = [apart for fills, apart in runs if fills == kind]
        solved = least_squares(lambda h: [apart(h[0]) for apart in of_kind], [50.0], x_scale=10.0)
        found[f"chambers.heat_transfer_{key}_W_m2K"] = solved.x[0]
    return found


def bristle_force(time, speed, numbers, viscous, stribeck):
    """LuGre force of a recorded speed, the bristle by its exact step over a row of constant speed."""
    stiffness, damping, coulomb, static = numbers
    level = coulomb + (static - coulomb) * np.exp(-((speed / stribeck) ** 2))
    rate = stiffness * np.abs(speed) / level
    step = np.diff(time, prepend=time[0])
    bristle, force = 0.0, np.empty_like(time)
    settled = np.sign(speed) * level / stiffness
    decay = np.exp(-rate * step)
    for row in range(len(time)):
        bristle = settled[row] + (bristle - settled[row]) * decay[row] if rate[row] > 0 else bristle
        force[row] = stiffness * bristle + damping * (speed[row] - rate[row] * bristle) + viscous * speed[row]
    return force


def presliding(content, folder):
    """The displacement of the file drives the law; the zero is one number and a slope."""
    with open(pathlib.Path(folder) / "rig.toml", "rb") as file:
        rig = tomllib.load(file)
    signals = recorded(folder, rig, content["stretches"][0]["recording"])
    time, position, force = signals["t"], signals["x"], signals["force"]
    speed = np.gradient(position, time)
    mass = rig["carriage"]["mass_kg"]
    acceleration = np.gradient(speed, time)
    friction = rig["friction"]
    scale = np.array([1e6, 1e3, 10.0, 10.0])

    def left(numbers):
        law = bristle_force(
            time, speed, numbers[:4] * scale, friction["viscous_Ns_m"], friction["stribeck_velocity_m_s"]
        )
        zero = numbers[4] + numbers[5] * (time - time[0])
        return force + law + mass * acceleration - zero

    level = np.quantile(np.abs(force - np.mean(force)), 0.98) / 10.0
    solved = least_squares(left, [0.5, 1.0, 0.9 * level, level, 0.0, 0.0])
    keys = ["bristle_stiffness_N_m", "bristle_damping_Ns_m", "coulomb_N", "static_N"]
    return {f"friction.{key}": value for key, value in zip(keys, solved.x[:4] * scale)}


OF_POINTS = {"Friction": friction, "Valve flow": valve_flow, "Spool": spool, "Dead volume": dead_volume}
OF_RECORDINGS = {"Heat transfer": heat_transfer, "Presliding": presliding}


def main(paths):
    for path in paths:
        path, _, folder = path.partition("=")
        with open(path, encoding="utf-8") as file:
            content = json.load(file)
        title = content["title"]
        others = OF_RECORDINGS[title](content, folder) if title in OF_RECORDINGS else OF_POINTS[title](content)
        for key, other in others.items():
            number = next((one for one in content["numbers"] if one["key"] == key), None)
            if number is None:
                print(f"{key:34} SciPy {other:.5g}, identify: not sought")
                continue
            apart = (number["value"] - other) / number["deviation"]
            print(f"{key:34} SciPy {other:.5g}, identify {number['value']:.5g} ± {number['deviation']:.2g}: {apart:+.2f} deviations")


if __name__ == "__main__":
    main(sys.argv[1:])
