"""The extension module: what Rust answers. Users call :mod:`pneuma`."""

import os
from collections.abc import Callable, Sequence
from typing import Optional, Union

import numpy as np
import numpy.typing as npt

Path = Union[str, os.PathLike[str]]
Column = npt.NDArray[np.float64]
Codes = tuple[int, int, int, int, int]

__version__: str

class PneumaError(ValueError):
    """An input that cannot be used, in one line."""

    file: Optional[str]
    line: Optional[int]
    key: Optional[str]
    expected: Optional[str]

class Rig:
    """A rig file: signals, nameplate data, uncertainties, effects."""

    @staticmethod
    def read(path: Path) -> Rig: ...
    @staticmethod
    def parse(text: str, name: str = "rig.toml") -> Rig: ...
    def to_toml(self) -> str: ...
    def value(self, key: str) -> Optional[float]:
        """The number at ``section.key`` or ``effects.NAME.key``, in the unit that the key ends in."""

    def signals(self) -> list[tuple[str, str, str]]:
        """Name, column and unit of each signal."""

class Recording:
    """A recording in SI units, pressures in Pa absolute."""

    @staticmethod
    def read(path: Path, rig: Rig) -> Recording: ...
    @staticmethod
    def from_arrays(name: str, time_s: Column, signals: dict[str, Column]) -> Recording: ...
    @property
    def name(self) -> str: ...
    @property
    def time_s(self) -> Column:
        """Shape (n,), s."""

    @property
    def signals(self) -> list[str]: ...
    @property
    def remarks(self) -> list[str]: ...
    def part(self, from_: int, to: int) -> Recording: ...
    def __getitem__(self, signal: str) -> Column:
        """Shape (n,), SI."""

    def __len__(self) -> int: ...

class Diagnosis:
    @property
    def json(self) -> str: ...
    @property
    def lines(self) -> list[tuple[str, str]]: ...
    @property
    def improved_rig(self) -> Rig: ...
    def report(self, title: str) -> str: ...

class Plant:
    """A simulated axis behind the board's converters."""

    def __init__(self, rig: Rig, start_m: float = 0.0, seed: int = 1) -> None: ...
    def sample(self) -> Codes:
        """Position, both pressures, supply, velocity; each call draws new noise."""

    def advance(self, valve_code: int) -> None:
        """A millisecond under the present command, then the answer takes over."""

    def truth(self) -> dict[str, float]:
        """What no converter shows, SI."""

class Controller:
    """The firmware's control task: the very bytes of the board."""

    def __init__(self, rig: Rig) -> None: ...
    def tick(
        self,
        codes: Codes,
        position_m: float,
        velocity_m_per_s: float = 0.0,
        acceleration_m_per_s2: float = 0.0,
    ) -> tuple[int, str, int, list[float]]:
        """The valve's code, the state, the fault (0: none), what the observer believes (m, m/s, N, N)."""

def tables(path: Path) -> list[tuple[str, str, str, str, int]]: ...
def inspect(rig: Rig, recording: Recording) -> tuple[str, str]: ...
def compare(rig: Rig, recordings: Sequence[Recording]) -> tuple[str, str]: ...
def fit(
    rig: Rig, train: Sequence[Recording], held_out: Sequence[Recording], free: Sequence[str]
) -> tuple[str, str, Rig]: ...
def identify(part: str, rig: Rig, recordings: Sequence[Recording]) -> tuple[str, str, Rig]: ...
def valve_flow(rig: Rig, recordings: Sequence[Recording]) -> tuple[str, str, Rig]: ...
def diagnose(
    rig: Rig,
    train: Sequence[Recording],
    held_out: Sequence[Recording],
    progress: Optional[Callable[[str], object]],
) -> Diagnosis: ...
def simulate(path: Path) -> tuple[list[tuple[str, list[float]]], Optional[str]]: ...
