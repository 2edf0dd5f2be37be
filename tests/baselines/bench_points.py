"""The numbers of `pneuma identify` beside fits of the same points by SciPy.

    pneuma identify friction    --rig rig.toml sliding-*.csv --json friction.json
    pneuma identify valve-flow  --rig rig.toml staircase.csv ratio.csv --json valve.json
    pneuma identify dead-volume --rig rig.toml pushed.csv --json dead.json
    pneuma identify spool       --rig rig.toml staircase.csv sines.csv --json spool.json
    python tests/baselines/bench_points.py friction.json valve.json dead.json spool.json

Each JSON file holds the points of its pictures. Here the laws are written down again and fitted
by `scipy.optimize.curve_fit`; a line says both numbers and how far they are apart in the stated
deviation.
"""

import json
import sys

import numpy as np
from scipy.optimize import curve_fit


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


def main(paths):
    for path in paths:
        with open(path, encoding="utf-8") as file:
            content = json.load(file)
        fits = {"Friction": friction, "Valve flow": valve_flow, "Spool": spool, "Dead volume": dead_volume}
        for key, other in fits[content["title"]](content).items():
            number = next((one for one in content["numbers"] if one["key"] == key), None)
            if number is None:
                print(f"{key:34} SciPy {other:.5g}, identify: not sought")
                continue
            apart = (number["value"] - other) / number["deviation"]
            print(f"{key:34} SciPy {other:.5g}, identify {number['value']:.5g} ± {number['deviation']:.2g}: {apart:+.2f} deviations")


if __name__ == "__main__":
    main(sys.argv[1:])
