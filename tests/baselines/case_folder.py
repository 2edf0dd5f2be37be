"""A case folder as arrays: the rig's numbers and the recordings, SI."""

import json
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

SIGNALS = ("t", "u", "p_a", "p_b", "x", "v")
SI_UNITS = {"s", "V", "Pa(abs)", "m", "m/s"}


@dataclass
class Recording:
    """Columns of one file."""

    name: str
    t: np.ndarray
    u: np.ndarray
    p_a: np.ndarray
    p_b: np.ndarray
    x: np.ndarray
    v: np.ndarray
    p_s: np.ndarray | None


class Rig:
    """The numbers of a rig file."""

    def __init__(self, folder: Path):
        self.table = tomllib.loads((folder / "rig.toml").read_text())
        self.uncertainty = self.table.get("uncertainty", {})

    def __getitem__(self, key: str):
        section, name = key.split(".")
        return self.table[section][name]

    def noise(self, signal: str) -> float:
        declared = self.table["signals"][signal]
        quantum = declared.get("resolution", 0.0)
        return float(np.hypot(declared["noise"], quantum / np.sqrt(12.0)))


def recordings(folder: Path, rig: Rig, pattern: str) -> list[Recording]:
    """The recordings whose names fit a pattern."""
    found = []
    for path in sorted(folder.glob(pattern)):
        table = np.genfromtxt(path, delimiter=",", names=True)
        columns = {}
        for signal, declared in rig.table["signals"].items():
            if declared["unit"] not in SI_UNITS:
                raise SystemExit(f"{path}: {signal} is in {declared['unit']}, expected SI")
            columns[signal] = table[declared["column"]]
        found.append(
            Recording(
                path.name,
                *(columns[signal] for signal in SIGNALS),
                p_s=columns.get("p_s"),
            )
        )
    return found


def smooth(column: np.ndarray, step_s: float, derivative: int = 0, rows: int = 21) -> np.ndarray:
    """A local cubic over that many rows, or its derivative."""
    return savgol_filter(column, rows, 3, deriv=derivative, delta=step_s)


def write_verdict(folder: Path, name: str, verdict: dict) -> None:
    """Writes what a baseline says, in the keys of a verdict."""
    (folder / f"{name}.json").write_text(json.dumps(verdict, indent=1) + "\n")
