"""Writes concealed cases: `python draw.py --seed S --n N --out DIR`.

A case is a folder `o<seed>-<nnn>` laid out as the practice cases: `rig.toml`, four train and two held-out recordings
and `truth.json`. The same seed gives the same cases.
"""

import argparse
import json
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from effects import FADING, IMMATERIAL, LISTED, STRENGTHS, UNLISTED, draw_changes, places_of
from motion import controller, draw_motions
from plant import ROW_S, Axis, Plant, Record
from rig import RESOLUTION, Rig, draw_rig, plant_of, rig_toml, sensor_noise, table_of

# What share of the cases is of which group.
MIX = {"single": 0.45, "late": 0.12, "pair": 0.15, "unlisted": 0.10, "healthy": 0.10, "dirty": 0.08}

# With these the rig file's gas law or the piston's reach changes, so that another effect beside them is not the same.
UNPAIRED = {"gas-temperature-dynamics", "end-cushion"}


# The contract's own names of parameters, where it gives any.
CONTRACT_NAMES = {"tube_length_m": "length_m"}


@dataclass
class Case:
    """What is wrong in a case, and when."""

    group: str
    names: list[str] = field(default_factory=list)
    strength: str = "none"
    begins: str = "always"


def deal(rng, count: int, only: str | None) -> list[Case]:
    """The cases of a draw: groups by their share, effects in a shuffled order so that none comes twice before all."""
    mix = {only: 1.0} if only else MIX
    shares = np.cumsum(list(mix.values())) * count
    groups = [list(mix)[int(np.searchsorted(shares, i + 0.5))] for i in range(count)]
    decks = {
        "single": Deck(rng, LISTED),
        "late": Deck(rng, [name for name, effect in LISTED.items() if effect.may_begin_late]),
        "unlisted": Deck(rng, UNLISTED),
    }
    strengths = {group: Deck(rng, STRENGTHS) for group in MIX}
    onsets = Deck(rng, ("mid-recording", "later-files", "part"))
    cases = [draw_case(rng, group, decks, strengths[group], onsets) for group in groups]
    return [cases[i] for i in rng.permutation(count)]


class Deck:
    """Shuffled cards that are dealt round and round."""

    def __init__(self, rng, cards):
        self.cards = list(rng.permutation(list(cards)))
        self.dealt = 0

    def next(self) -> str:
        """The next card."""
        self.dealt += 1
        return str(self.cards[(self.dealt - 1) % len(self.cards)])


def draw_case(rng, group, decks, strengths, onsets) -> Case:
    """One case of a group."""
    if group == "healthy":
        return Case(group)
    if group == "dirty":
        names = rng.choice(FADING, int(rng.integers(2, 4)), replace=False)
        return Case(group, [str(name) for name in names], IMMATERIAL)
    if group == "pair":
        return Case(group, draw_pair(rng), strengths.next())
    if group == "late":
        return Case(group, [decks["late"].next()], strengths.next(), onsets.next())
    return Case(group, [decks[group].next()], strengths.next())


def draw_pair(rng) -> list[str]:
    """Two effects of the list that share no place."""
    candidates = [name for name in LISTED if name not in UNPAIRED]
    first = str(rng.choice(candidates))
    apart = [name for name in candidates if not set(LISTED[name].places) & set(LISTED[first].places)]
    return [first, str(rng.choice(apart))]


def affect(case: Case, plant: Plant, rig: Rig, rng) -> tuple[Plant, dict[str, dict]]:
    """The plant with the case's effects, and what each of them changed."""
    changed = {name: draw_changes(name, case.strength, plant, rig.given, rng) for name in case.names}
    for changes in changed.values():
        plant = plant._replace(**changes)
    return plant, changed


def believe_reduced_gas(rig: Rig, healthy: Plant, affected: Plant) -> None:
    """The engineer models the gas by (6); what he holds of the wall is as uncertain as ever."""
    rig.given["chambers.model"] = "polytropic"
    for way in ("charging", "discharging"):
        name = f"heat_{way}_w_m2k"
        rig.given[f"chambers.heat_transfer_{way}_W_m2K"] *= getattr(affected, name) / getattr(healthy, name)


def affected_spans(case: Case, rng, order: int, start_file: int, rows: int) -> list[tuple[int, int]]:
    """Rows of a recording in which the effects are there; `order` counts train files first, then held-out ones."""
    if case.begins in ("mid-recording", "later-files") and order < start_file:
        return []
    if case.begins == "mid-recording" and order == start_file:
        return [(int(rng.uniform(0.3, 0.6) * rows), rows)]
    if case.begins == "part":
        length = int(rng.uniform(0.2, 0.3) * rows)
        starts = int(rng.uniform(0.05, 0.2) * rows), int(rng.uniform(0.5, 0.7) * rows)
        return [(start, start + length) for start in starts]
    return [(0, rows)]


def record_motion(healthy, affected, control, table, reference, noise, spans) -> tuple[Record, bool]:
    """Runs a motion, changing plants at the borders of the spans; also whether it met a hard stop."""
    record = Record(reference, noise)
    at_start = any(first == 0 < last for first, last in spans)
    axis = Axis(affected if at_start else healthy, reference[0, 0])
    borders = sorted({0, len(reference), *(row for span in spans for row in span)})
    for first, last in pairwise(borders):
        inside = any(begin <= first < end for begin, end in spans)
        axis.run(affected if inside else healthy, control, table, record, first, last)
    return record, axis.state["stop_j"][0] != 0.0


def record_clear(healthy, affected, control, table, reference, noise, spans) -> Record:
    """A motion that keeps clear of the hard stops, which no rig file describes; else it is run again, smaller."""
    while True:
        record, stopped = record_motion(healthy, affected, control, table, reference, noise, spans)
        if not stopped or affected.cushion_length_m > 0.0:
            return record
        reference = 0.7 * reference


def write_recording(path: Path, rig: Rig, record: Record) -> None:
    """Rounds to the converters' steps and writes a file."""
    rows = record.rows.copy()
    if rig.given["cylinder.position_zero"] == "end-a":
        rows[:, 3] += 0.5 * rig.given["cylinder.stroke_m"]
    stepped = RESOLUTION > 0.0
    rows[:, stepped] = np.round(rows[:, stepped] / RESOLUTION[stepped]) * RESOLUTION[stepped]
    columns = ["t_s", "u_V", "p_a_Pa", "p_b_Pa", "p_s_Pa", "x_m", "v_m_s"]
    formats = ["%.4f", "%.4f", "%.1f", "%.1f", "%.1f", "%.8f", "%.6f"]
    table = np.column_stack([np.arange(len(rows)) * ROW_S, record.commands, rows])
    keep = [i for i, column in enumerate(columns) if column != "p_s_Pa" or rig.has_supply_gauge]
    np.savetxt(
        path,
        table[:, keep],
        delimiter=",",
        header=",".join(columns[i] for i in keep),
        comments="",
        fmt=[formats[i] for i in keep],
    )


def plain(values: dict) -> dict:
    """Numbers of a truth, readable."""
    return {CONTRACT_NAMES.get(key, key): float(f"{value:.6g}") for key, value in values.items()}


def write_truth(folder: Path, case: Case, plant: Plant, changed: dict, spans: dict) -> None:
    """What the judge reads."""
    material = case.group not in ("healthy", "dirty")
    truth = {
        "group": case.group,
        "effects": case.names if material and case.group != "unlisted" else [],
        "unlisted": case.names if case.group == "unlisted" else [],
        "immaterial": case.names if case.group == "dirty" else [],
        "places": {name: places_of(name, changed[name]) for name in case.names} if material else {},
        "strength": case.strength,
        "begins": case.begins,
        "affected_s": {name: [[a * ROW_S, b * ROW_S] for a, b in found] for name, found in spans.items()},
        "parameters": {name: plain(changes) for name, changes in changed.items()},
        "plant": {key: float(f"{value:.6g}") for key, value in plant._asdict().items()},
    }
    (folder / "truth.json").write_text(json.dumps(truth, indent=1) + "\n")


def write_case(folder: Path, case: Case, rng) -> None:
    """Draws a rig, runs its motions and writes the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rig, truth, tank_m3 = draw_rig(rng)
    healthy = plant_of(truth, tank_m3)
    affected, changed = affect(case, healthy, rig, rng)
    if "gas-temperature-dynamics" in case.names:
        believe_reduced_gas(rig, healthy, affected)
    control = controller(rng, rig)
    motions = draw_motions(rng, healthy.stroke_m, to_the_ends="end-cushion" in case.names)
    start_file = int(rng.integers(1, 3))
    spans = {}
    for order, (name, reference) in enumerate(motions.items()):
        found = affected_spans(case, rng, order, start_file, len(reference))
        noise = rng.normal(size=(len(reference), 5)) * sensor_noise(rig)
        record = record_clear(healthy, affected, control, table_of(truth), reference, noise, found)
        write_recording(folder / f"{name}.csv", rig, record)
        spans[name] = found if case.names else []
    (folder / "rig.toml").write_text(rig_toml(rig))
    write_truth(folder, case, affected, changed, spans)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--n", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", choices=list(MIX), help="one group alone")
    arguments = parser.parse_args()
    cases = deal(np.random.default_rng([arguments.seed, 0]), arguments.n, arguments.only)
    for number, case in enumerate(cases, start=1):
        name = f"o{arguments.seed}-{number:03d}"
        write_case(arguments.out / name, case, np.random.default_rng([arguments.seed, number]))
        print(name, flush=True)


if __name__ == "__main__":
    main()
