"""Motions as in the practice recordings: references for the controller, one row a millisecond.

A reference has three columns: position, speed and a voltage added open-loop.
"""

import numpy as np

from plant import ROW_S, Control
from rig import Rig


def min_jerk(from_m: float, to_m: float, peak_m_s: float) -> np.ndarray:
    """A smooth move with that peak speed, 15/8 of its mean."""
    distance = abs(to_m - from_m)
    rows = max(int(1.875 * distance / peak_m_s / ROW_S), 2)
    s = np.arange(1, rows + 1) / rows
    return from_m + (to_m - from_m) * (10 * s**3 - 15 * s**4 + 6 * s**5)


def finish(position: np.ndarray, rows: int) -> np.ndarray:
    """Position cut or held to length."""
    position = np.concatenate([position, np.full(max(rows - len(position), 0), position[-1])])[:rows]
    return np.column_stack([position, np.zeros((rows, 2))])


def limited(reference: np.ndarray, limit_m: float) -> np.ndarray:
    """Position kept within limits, and its speed."""
    position = np.clip(reference[:, 0], -limit_m, limit_m)
    speed = np.diff(position, prepend=position[0]) / ROW_S
    return np.column_stack([position, speed, reference[:, 2]])


def way_points(rng, rows: int, targets, peaks, dwells) -> np.ndarray:
    """Moves between targets with dwells; each argument draws one number."""
    position = np.full(int(rng.uniform(0.2, 0.5) / ROW_S), targets())
    while len(position) < rows:
        move = min_jerk(position[-1], targets(), peaks())
        position = np.concatenate([position, move, np.full(int(dwells() / ROW_S), move[-1])])
    return finish(position, rows)


def steps(rng, rows, centre_m, reach_m):
    """Quick moves, short dwells."""
    return way_points(
        rng,
        rows,
        lambda: centre_m + rng.uniform(-reach_m, reach_m),
        lambda: rng.uniform(0.7, 1.6),
        lambda: rng.uniform(0.15, 0.8),
    )


def moves(rng, rows, centre_m, reach_m):
    """Random moves, slow and quick, some long dwells."""
    return way_points(
        rng,
        rows,
        lambda: centre_m + rng.uniform(-1.3, 1.3) * reach_m,
        lambda: rng.choice([0.2, 0.6, 1.2]),
        lambda: rng.choice([0.1, 0.3, 0.9]),
    )


def staircase(rng, rows, centre_m, reach_m):
    """Small moves out of rest after long dwells."""
    place = [centre_m + 0.3 * reach_m * rng.uniform(-1.0, 1.0)]

    def target():
        place[0] += rng.choice([-1.0, 1.0, 1.0]) * rng.uniform(0.01, 0.04)
        return place[0]

    return way_points(rng, rows, target, lambda: rng.uniform(0.1, 0.3), lambda: rng.choice([0.3, 0.8, 1.6]))


def ramps(rng, rows, centre_m, reach_m):
    """Slow triangles with a rest at each turn."""
    speed = rng.uniform(0.02, 0.06)
    half = rng.uniform(0.5, 0.9) * reach_m
    run = np.linspace(0.0, 1.0, int(half / speed / ROW_S))
    rest = np.ones(int(rng.uniform(0.4, 0.8) / ROW_S))
    shape = np.concatenate([0 * rest, run, rest, 1 - run, 0 * rest, -run, -rest, run - 1])
    return finish(np.tile(centre_m + half * shape, 2), rows)


def sine(rng, rows, centre_m, reach_m):
    """Bursts of sines, a dwell between them."""
    position = np.full(400, centre_m)
    while len(position) < rows:
        frequency, amplitude = rng.uniform(0.4, 1.1), rng.uniform(0.5, 1.0) * reach_m
        turns = int(rng.integers(1, 4))
        s = np.arange(int(turns / frequency / ROW_S)) * ROW_S
        burst = centre_m + amplitude * np.sin(2.0 * np.pi * frequency * s)
        position = np.concatenate([position, burst, np.full(int(rng.uniform(0.3, 1.0) / ROW_S), centre_m)])
    return finish(position, rows)


def wander(rng, rows, centre_m, reach_m):
    """A multisine on the valve while the controller only keeps the carriage in the middle."""
    t = np.arange(rows) * ROW_S
    frequencies = rng.uniform(0.5, 12.0, 14)
    phases = rng.uniform(0.0, 2.0 * np.pi, 14)
    voltage = sum(np.sin(2.0 * np.pi * f * t + phase) for f, phase in zip(frequencies, phases))
    voltage *= rng.uniform(0.28, 0.42) * reach_m / 0.12
    reference = finish(np.array([centre_m]), rows)
    reference[:, 2] = voltage * np.minimum(t / 0.3, 1.0)
    # A third of the recording is left alone, so that the carriage comes to rest.
    reference[int(rng.uniform(0.65, 0.8) * rows) :, 2] = 0.0
    return reference


RECORDINGS = {
    "train-1": (steps, 6.0),
    "train-2": (wander, 6.0),
    "train-3": (ramps, 8.0),
    "train-4": (staircase, 10.0),
    "held-1": (sine, 6.0),
    "held-2": (moves, 7.0),
}


def draw_motions(rng, stroke_m: float, to_the_ends: bool) -> dict[str, np.ndarray]:
    """References of all recordings of a case."""
    references = {}
    for name, (kind, seconds) in RECORDINGS.items():
        reach_m = rng.uniform(0.22, 0.3) * stroke_m
        centre_m = rng.uniform(-0.1, 0.1) * stroke_m
        if to_the_ends:
            # Cushions act within their length of an end only, so the motion has to get there.
            reach_m = (0.25 if kind is wander else 0.45) * stroke_m
            centre_m = (0.0 if kind is wander else 0.13) * stroke_m * rng.choice([-1.0, 1.0])
        reference = kind(rng, int(rng.uniform(1.0, 1.15) * seconds / ROW_S) + 1, centre_m, reach_m)
        # Only a cushion's motions come near the hard stops.
        limit_m = (0.475 if to_the_ends else 0.4) * stroke_m
        references[name] = limited(reference, limit_m)
    return references


def opening_v(given: dict, speed_m_s: float) -> float:
    """The opening that feeds a speed, at 0.6 of the supply pressure and choked inflow."""
    area = 0.6 * given["cylinder.area_m2"] * speed_m_s / (287.0 * 293.15 * 0.82 * 0.0404184 * 0.75) * 293.15**0.5
    return float(np.interp(area, given["valve.supply_area_m2"], given["valve.opening_V"]))


def controller(rng, rig: Rig) -> Control:
    """Gains from the rig file: a crossover of a few radians a second, damped by the pressure difference."""
    given = rig.given
    overlap_v = float(given["valve.opening_V"][np.argmax(np.diff(given["valve.supply_area_m2"]) > 0.0)])
    volts_per_speed = (opening_v(given, 0.5) - overlap_v) / 0.5
    return Control(
        null_v=given["valve.null_V"],
        feeds_a_sign=1.0 if given["valve.feeds_a_when"] == "above-null" else -1.0,
        position_v_m=rng.uniform(11.0, 18.0) * volts_per_speed,
        speed_v_s_m=rng.uniform(0.8, 1.1) * volts_per_speed,
        pressure_v_pa=rng.uniform(0.2, 0.45) * volts_per_speed / 1e5,
        dead_zone_v=rng.uniform(0.7, 0.9) * overlap_v,
        tolerance_m=rng.uniform(0.5e-3, 2e-3),
    )
