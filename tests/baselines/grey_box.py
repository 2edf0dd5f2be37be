"""A grey box as an engineer writes it in a day: the rig's model fitted by SciPy's
`least_squares` in windows of 0.5 s, of which the second half counts, then one hypothesis after another.

Chambers: mass and energy balance of each, driven by recorded command and motion, all
windows stepped together. Forces: the balance of a sliding carriage, linear in its
unknowns. A hypothesis is named if it lowers the error on training recordings that were
left out by more than a threshold, the largest gain first.
"""

import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from case_folder import Rig, recordings, smooth, write_verdict
from model import friction_n, orifice_kg_s, port_areas, volumes

NAME = "grey-box"
WINDOW_ROWS = 500
# The first half settles the unknown temperatures and is not counted.
SETTLING_ROWS = 250
# Every so-manieth row is simulated, in so many steps. A command that changes every row
# must not be skipped: half a millisecond is ten times the noise.
STRIDE = 1
SUBSTEPS = 2
# Every so-manieth window is used: enough, and a minute is not exceeded.
THIN = 2
# Relative fall of the left-out mean square that is worth a name.
WORTH = 0.10
ORDINARY = {
    "null": ("valve.null_V", False),
    "stretch": ("valve.opening_V", True),
    "supply": ("valve.supply_area_m2", True),
    "exhaust": ("valve.exhaust_area_m2", True),
    "b": ("valve.critical_pressure_ratio", True),
    "dead_a": ("cylinder.dead_volume_a_m3", True),
    "dead_b": ("cylinder.dead_volume_b_m3", True),
    "pressure": ("supply.pressure_Pa", True),
    "charging": ("chambers.heat_transfer_charging_W_m2K", True),
    "discharging": ("chambers.heat_transfer_discharging_W_m2K", True),
}
# Hypotheses about the chambers: place, start and scale of the one parameter.
HYPOTHESES = {
    "valve-delay": ("valve-command", 2e-3, 2e-3),
    "spool-dynamics": ("valve-command", 2e-3, 2e-3),
    "valve-hysteresis": ("valve-command", 0.03, 0.03),
    "slew-limit": ("valve-command", 5e-3, 5e-3),
    "piston-leakage": ("chamber-a", 5e-8, 5e-8),
    "chamber-leakage": ("chamber-a", 5e-8, 5e-8),
    "supply-droop": ("supply", 1e4, 1e4),
    "exhaust-back-pressure": ("exhaust", 1e4, 1e4),
    "wall-temperature": ("chamber-a", 5.0, 5.0),
    "pressure-sensor-lag": ("sensor.p_a", 2e-3, 2e-3),
    "position-time-skew": ("sensor.x", 1e-3, 1e-3),
}


def late(column, t, delay_s):
    """The column, late by a fraction of rows."""
    return np.interp(t - delay_s, t, column)


def low_pass(column, dt, lag_s):
    """A first-order lag."""
    keep = np.exp(-dt / max(abs(lag_s), 1e-6))
    out, state = np.empty_like(column), column[0]
    for row, value in enumerate(column):
        state = value + (state - value) * keep
        out[row] = state
    return out


def play(column, width):
    """The output of a play."""
    out, state, half = np.empty_like(column), column[0], 0.5 * abs(width)
    for row, value in enumerate(column):
        state = min(max(state, value - half), value + half)
        out[row] = state
    return out


def slewed(column, dt, seconds_per_v):
    """A rate limit; the parameter is its inverse."""
    step = dt / max(abs(seconds_per_v), 1e-6)
    out, state = np.empty_like(column), column[0]
    for row, value in enumerate(column):
        state += min(max(value - state, -step), step)
        out[row] = state
    return out


class Windows:
    """All windows of some recordings as columns of arrays."""

    def __init__(self, found, offset):
        self.parts = []
        for one in found:
            starts = range(offset * WINDOW_ROWS, len(one.t) - WINDOW_ROWS, THIN * WINDOW_ROWS)
            self.parts.append((one, [np.arange(start, start + WINDOW_ROWS) for start in starts]))

    def cut(self, columns):
        """Windows of one column per recording: rows by windows."""
        pieces = [column[rows] for (_, all_rows), column in zip(self.parts, columns) for rows in all_rows]
        return np.array(pieces).T

    def of(self, signal):
        """Windows of a recorded signal."""
        return self.cut([getattr(one, signal) for one, _ in self.parts])


class Chambers:
    """The chambers predicted in windows."""

    def __init__(self, rig, windows):
        self.rig, self.windows = rig, windows
        self.dt = float(np.median(np.diff(windows.parts[0][0].t)))
        self.noise = rig.noise("p_a")
        self.measured = [windows.of("p_a")[::STRIDE], windows.of("p_b")[::STRIDE]]
        self.start = []
        for name in ("p_a", "p_b"):
            level = [smooth(getattr(one, name), self.dt) for one, _ in windows.parts]
            self.start.append(windows.cut(level)[0])

    def inputs(self, effect, size):
        """Command, position and velocity as the hypothesis makes them."""
        commands, positions, speeds = [], [], []
        for one, _ in self.windows.parts:
            u = one.u
            if effect == "valve-delay":
                u = late(u, one.t, size)
            elif effect == "spool-dynamics":
                u = low_pass(u, self.dt, size)
            elif effect == "valve-hysteresis":
                u = play(u, size)
            elif effect == "slew-limit":
                u = slewed(u, self.dt, size)
            x, v = smooth(one.x, self.dt), smooth(one.x, self.dt, 1)
            if effect == "position-time-skew":
                x, v = late(x, one.t, -size), late(v, one.t, -size)
            commands.append(u)
            # A step of the gas has the piston in its middle.
            positions.append(x + 0.5 * self.dt * v)
            speeds.append(v)
        return [self.windows.cut(columns)[::STRIDE] for columns in (commands, positions, speeds)]

    def predict(self, values, effect=None, size=0.0):
        """Pressures of both chambers, rows by windows."""
        rig = self.rig
        factor = dict(zip(ORDINARY, values))
        gas, gamma = rig["gas.gas_constant_J_kgK"], rig["gas.gamma"]
        ambient_pa, ambient_k = rig["environment.pressure_Pa"], rig["environment.temperature_K"]
        supply_pa = rig["supply.pressure_Pa"] * factor["pressure"]
        b = float(np.clip(rig["valve.critical_pressure_ratio"] * factor["b"], 0.05, 0.6))
        laminar = rig["valve.laminar_pressure_ratio"]
        u, x, v = self.inputs(effect, size)
        turn = 1.0 if rig["valve.feeds_a_when"] == "above-null" else -1.0
        opening = (u - rig["valve.null_V"] - factor["null"]) * turn
        areas = [port_areas(rig, sign * opening, *(factor[k] for k in ("stretch", "supply", "exhaust"))) for sign in (1, -1)]
        dead = [rig[f"cylinder.dead_volume_{s}_m3"] * factor[f"dead_{s}"] for s in "ab"]
        volume = volumes(rig, x, *dead)
        piston = [rig["cylinder.area_a_m2"], -rig["cylinder.area_b_m2"]]
        bore = rig["cylinder.bore_m"]
        faces = [2.0 * area + np.pi * bore * vol / area for area, vol in zip(map(abs, piston), volume)]
        heat = [rig["chambers.heat_transfer_charging_W_m2K"] * factor["charging"],
                rig["chambers.heat_transfer_discharging_W_m2K"] * factor["discharging"]]
        wall_k = ambient_k + (size if effect == "wall-temperature" else 0.0)
        leak = abs(size) if effect and effect.endswith("-leakage") else 0.0
        p = [start.copy() for start in self.start]
        temperature = [np.full_like(p[0], ambient_k) for _ in p]
        step = self.dt * STRIDE / SUBSTEPS
        out = [np.empty_like(x), np.empty_like(x)]
        shown = [p[0].copy(), p[1].copy()]
        flows = [0.0, 0.0]
        for row in range(x.shape[0]):
            for side in (0, 1):
                out[side][row] = shown[side] if effect == "pressure-sensor-lag" else p[side]
            for _ in range(SUBSTEPS):
                fed = sum(np.maximum(flow, 0.0) for flow in flows) / 5e-3
                vented = sum(np.maximum(-flow, 0.0) for flow in flows) / 5e-3
                feeding_pa = supply_pa - (size * fed if effect == "supply-droop" else 0.0)
                back_pa = ambient_pa + (size * vented if effect == "exhaust-back-pressure" else 0.0)
                new = []
                for side in (0, 1):
                    supply_area, exhaust_area = areas[side][0][row], areas[side][1][row]
                    t_gas = temperature[side]
                    from_supply = orifice_kg_s(supply_area, feeding_pa, p[side], ambient_k, t_gas, b, laminar)
                    to_air = orifice_kg_s(exhaust_area, p[side], back_pa, t_gas, ambient_k, b, laminar)
                    flow = from_supply - to_air
                    inward_k = np.where(from_supply > 0.0, ambient_k, t_gas)
                    enthalpy = from_supply * inward_k - to_air * t_gas
                    if effect == "piston-leakage":
                        across = orifice_kg_s(leak, p[1 - side], p[side], temperature[1 - side], t_gas, b, laminar)
                        flow, enthalpy = flow + across, enthalpy + across * t_gas
                    if effect == "chamber-leakage":
                        lost = orifice_kg_s(leak, p[side], ambient_pa, t_gas, ambient_k, b, laminar)
                        flow, enthalpy = flow - lost, enthalpy - lost * t_gas
                    conductance = np.where(flow >= 0.0, heat[0], heat[1]) * faces[side][row]
                    vol = volume[side][row]
                    work = p[side] * piston[side] * v[row]
                    power = conductance * (wall_k - t_gas)
                    rate = (gamma * gas * enthalpy + (gamma - 1.0) * power - gamma * work) / vol
                    mass = p[side] * vol / (gas * t_gas)
                    warming = t_gas * (rate / p[side] + piston[side] * v[row] / vol - flow / mass)
                    new.append((p[side] + step * rate, t_gas + step * warming, flow))
                for side, (pressure, warm, flow) in enumerate(new):
                    p[side] = np.clip(pressure, 0.5e5, 1.2e6)
                    temperature[side] = np.clip(warm, 200.0, 450.0)
                    flows[side] = flow
                    keep = np.exp(-step / max(abs(size), 1e-6)) if effect == "pressure-sensor-lag" else 0.0
                    shown[side] = p[side] + (shown[side] - p[side]) * keep
        return out

    def residuals(self, values, effect=None, size=0.0):
        """Errors in units of the noise, one long column."""
        errors = [(pred - meas)[SETTLING_ROWS // STRIDE :] for pred, meas in zip(self.predict(values, effect, size), self.measured)]
        return np.nan_to_num(np.concatenate([error.ravel() for error in errors]) / self.noise, nan=1e3)


def priors(rig):
    """Start and deviation of the ordinary numbers: factors, the null a difference."""
    start = np.array([1.0 if relative else 0.0 for _, relative in ORDINARY.values()])
    sigma = np.array([rig.uncertainty.get(key, 1e-3) for key, _ in ORDINARY.values()])
    return start, sigma


def fit(chambers, guess, start, sigma, effect=None, evaluations=6):
    """Ordinary numbers and the effect's size fitted together."""
    count = len(start)
    scale = HYPOTHESES[effect][2] if effect else 1.0

    def errors(parameters):
        values = start + sigma * parameters[:count]
        size = scale * parameters[count] if effect else 0.0
        misfit = chambers.residuals(values, effect, size)
        # Rows of a window hang together: they count as a few.
        return np.concatenate([misfit / np.sqrt(50.0), parameters[:count]])

    first = np.append(guess, HYPOTHESES[effect][1] / scale) if effect else guess
    found = least_squares(errors, first, loss="soft_l1", x_scale="jac", diff_step=1e-3, max_nfev=evaluations)
    return found.x


def mean_square(chambers, parameters, start, sigma, effect=None):
    """Robust mean square over windows that were not fitted."""
    count = len(start)
    size = HYPOTHESES[effect][2] * parameters[count] if effect else 0.0
    misfit = chambers.residuals(start + sigma * parameters[:count], effect, size)
    return float(np.mean(np.minimum(misfit**2, 100.0 * np.median(misfit**2) + 9.0)))


def chamber_findings(rig, train, deadline_s):
    """Hypotheses about the chambers with their gains."""
    fitted, judged = Chambers(rig, Windows(train, 0)), Chambers(rig, Windows(train, 1))
    start, sigma = priors(rig)
    base = fit(fitted, np.zeros(len(start)), start, sigma, evaluations=25)
    before = mean_square(judged, base, start, sigma)
    findings = []
    for effect, (place, _, scale) in HYPOTHESES.items():
        if time.process_time() > deadline_s:
            break
        found = fit(fitted, base, start, sigma, effect, 3)
        gain = 1.0 - mean_square(judged, found, start, sigma, effect) / before
        findings.append((gain, effect, place, float(scale * found[-1])))
    return before, findings


def force_findings(rig, train):
    """Hypotheses about the forces, by linear least squares on sliding rows."""
    rows = []
    for one in train:
        dt = float(np.median(np.diff(one.t)))
        ambient_pa = rig["environment.pressure_Pa"]
        acceleration, v = smooth(one.x, dt, 2, 41), smooth(one.x, dt, 1, 41)
        p_a, p_b = smooth(one.p_a, dt, 0, 41), smooth(one.p_b, dt, 0, 41)
        pushed = (p_a - ambient_pa) * rig["cylinder.area_a_m2"] - (p_b - ambient_pa) * rig["cylinder.area_b_m2"]
        moving = np.abs(v) > 0.03
        sign = np.sign(v)
        base = np.column_stack([sign, v, acceleration])
        waves = np.column_stack([sign * f(2 * np.pi * one.x / w) for w in (0.06, 0.1, 0.18) for f in (np.cos, np.sin)])
        extra = {
            "constant-force": np.ones_like(v)[:, None],
            "pressure-dependent-friction": (sign * (p_a + p_b - 2 * ambient_pa))[:, None],
            "position-dependent-friction": waves,
        }
        target = pushed - rig["carriage.mass_kg"] * acceleration - friction_n(rig, v)
        rows.append((target[moving], base[moving], {name: column[moving] for name, column in extra.items()}))
    fold = np.concatenate([(np.arange(len(target)) // 500) % 2 for target, _, _ in rows])
    target = np.concatenate([row[0] for row in rows])
    base = np.concatenate([row[1] for row in rows])

    def left_out(columns):
        squares = []
        for judged in (0, 1):
            weights, *_ = np.linalg.lstsq(columns[fold != judged], target[fold != judged], rcond=None)
            squares.append(np.mean((target - columns @ weights)[fold == judged] ** 2))
        return float(np.mean(squares))

    before = left_out(base)
    findings = []
    for name in rows[0][2]:
        extra = np.concatenate([row[2][name] for row in rows])
        findings.append((1.0 - left_out(np.column_stack([base, extra])) / before, name, "force-balance", None))
    return findings


SIZE_KEYS = {"valve-delay": "delay_s", "valve-hysteresis": "width", "pressure-sensor-lag": "time_constant_s",
             "position-time-skew": "delay_s", "piston-leakage": "orifice_m2", "wall-temperature": "offset_K"}


def diagnose(folder: Path) -> dict:
    """The verdict on a case folder."""
    begin = time.process_time()
    rig = Rig(folder)
    train = recordings(folder, rig, "train-*.csv")
    before, findings = chamber_findings(rig, train, begin + 50.0)
    findings += force_findings(rig, train)
    findings.sort(key=lambda finding: finding[0], reverse=True)
    gain, effect, place, size = findings[0]
    named = gain > WORTH
    parameters = {SIZE_KEYS[effect]: {"value": abs(size)}} if effect in SIZE_KEYS and size is not None else {}
    effects = [{"effect": effect, "places": [place], "probability": min(1.0, gain), "parameters": parameters}]
    return {
        "verdict": "named" if named else "nothing-missing",
        "sentence": f"baseline at {before:.1f} times the noise's energy; best: {effect}, less by {100 * gain:.0f} %",
        "effects": effects if named else [],
        "ranking": [{"effect": name, "probability": float(np.clip(gain, 0.0, 1.0))} for gain, name, *_ in findings],
        "seconds": time.process_time() - begin,
    }


if __name__ == "__main__":
    write_verdict(Path(sys.argv[1]), NAME, diagnose(Path(sys.argv[1])))
