"""Servo-pneumatic axes: simulate them, check their recordings, say what their model leaves out.

    import pneuma

    rig = pneuma.Rig.read("rig.toml")
    train = [pneuma.Recording.read(f"train-{n}.csv", rig) for n in (1, 2)]
    held_out = [pneuma.Recording.read("held-1.parquet", rig)]
    verdict = pneuma.diagnose(rig, train, held_out)
    print(verdict)                      # what the program prints
    verdict.effects[0].effect           # the fields of docs/verdict.md
    verdict.improved_rig.to_toml()

Recordings are in SI units, pressures in Pa absolute. Inputs that cannot be used raise
:class:`PneumaError`, whose text is one line and which knows ``file``, ``line``, ``key`` and
``expected``.
"""

from __future__ import annotations

import json as _json
import os as _os
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import SimpleNamespace
from typing import Any, Optional, Union

import numpy as _np

from . import _pneuma
from ._pneuma import Controller, Plant, PneumaError, Rig, __version__

__all__ = [
    "Controller",
    "Plant",
    "PneumaError",
    "Recording",
    "Result",
    "Rig",
    "Verdict",
    "compare",
    "diagnose",
    "fit",
    "identify",
    "identify_valve_flow",
    "inspect",
    "recording",
    "simulate",
    "tables",
]

Recording = _pneuma.Recording
Path = Union[str, "_os.PathLike[str]"]


class Result:
    """What a command found: the fields of its JSON as attributes, its text when printed.

    ``json`` is the very text that the program writes, ``data`` the same as dictionaries and lists.
    """

    def __init__(self, json: str, text: str) -> None:
        self.json = json
        self.text = text
        self.data: Any = _json.loads(json)
        self._fields = _json.loads(json, object_hook=lambda fields: SimpleNamespace(**fields))

    def __getattr__(self, name: str) -> Any:
        fields = self.__dict__.get("_fields")
        if isinstance(fields, SimpleNamespace) and hasattr(fields, name):
            return getattr(fields, name)
        known = ", ".join(vars(fields)) if isinstance(fields, SimpleNamespace) else "data"
        raise AttributeError(f"{name}: expected one of {known}")

    def __getitem__(self, key: Any) -> Any:
        return self._fields[key] if isinstance(self._fields, list) else getattr(self, key)

    def __len__(self) -> int:
        return len(self.data)

    def __dir__(self) -> list[str]:
        fields = vars(self._fields) if isinstance(self._fields, SimpleNamespace) else ()
        return [*super().__dir__(), *fields]

    def __repr__(self) -> str:
        return self.text


class Fit(Result):
    """Fitted numbers, and :attr:`improved_rig` with them."""

    def __init__(self, json: str, text: str, improved_rig: Rig) -> None:
        super().__init__(json, text)
        self.improved_rig = improved_rig


class Verdict(Result):
    """What :func:`diagnose` says; the fields are those of ``docs/verdict.md``."""

    def __init__(self, diagnosis: _pneuma.Diagnosis) -> None:
        text = "\n".join(f"{label:12} {line}" for label, line in diagnosis.lines)
        super().__init__(diagnosis.json, text)
        self._diagnosis = diagnosis
        self.improved_rig: Rig = diagnosis.improved_rig

    def report(self, path: Optional[Path] = None, title: str = "Diagnosis") -> str:
        """The page with plots, as HTML; written to ``path`` where one is given."""
        page = self._diagnosis.report(title)
        if path is not None:
            with open(path, "w", encoding="utf-8") as file:
                file.write(page)
        return page

    def _repr_html_(self) -> str:
        page = self.report().replace("&", "&amp;").replace('"', "&quot;")
        return f'<iframe srcdoc="{page}" style="width:100%;height:40em;border:0"></iframe>'


def recording(
    time_s: Any, signals: Union[Mapping[str, Any], Any, None] = None, name: str = "recording"
) -> Recording:
    """A recording of arrays in SI units, pressures in Pa absolute.

    ``time_s`` has shape (n,) in s and rises; ``signals`` maps names of signals (``u`` in V, ``p_a``,
    ``p_b``, ``p_s`` in Pa, ``x`` in m, ``v`` in m/s, ``force`` in N) to arrays of shape (n,). A data
    frame of pandas or polars with a column ``t`` and columns of these names may stand alone.
    Values are copied once.
    """
    if signals is None:
        frame, time_s = time_s, time_s["t"]
        signals = {column: frame[column] for column in frame.columns if column != "t"}
    column = lambda values: _np.ascontiguousarray(_np.asarray(values), dtype=_np.float64)
    arrays = {signal: column(values) for signal, values in signals.items()}
    return Recording.from_arrays(name, column(time_s), arrays)


def tables(path: Path) -> dict[str, list[SimpleNamespace]]:
    """What a file holds, without a rig: by table its columns with ``name``, ``unit``, ``description``
    and ``rows``. Formats: ``docs/recordings.md``."""
    found: dict[str, list[SimpleNamespace]] = {}
    for table, name, unit, description, rows in _pneuma.tables(path):
        column = SimpleNamespace(name=name, unit=unit, description=description, rows=rows)
        found.setdefault(table, []).append(column)
    return found


def inspect(rig: Rig, recording: Recording) -> Result:
    """What a recording is worth before anything is fitted: timing, noise, excitation, faults."""
    return Result(*_pneuma.inspect(rig, recording))


def compare(rig: Rig, recordings: Union[Recording, Sequence[Recording]]) -> Result:
    """Where the rig as given and recordings part, a law after the other."""
    return Result(*_pneuma.compare(rig, _listed(recordings)))


def fit(
    rig: Rig,
    train: Union[Recording, Sequence[Recording]],
    held_out: Union[Recording, Sequence[Recording]] = (),
    free: Iterable[str] = (),
) -> Fit:
    """Numbers of the rig fitted to recordings, law by law.

    ``free`` are keys such as ``"valve.null_V"``, ``"KEY=START"`` or ``"KEY=START,LOWER..UPPER"``; without
    any all are free that the rig lists under ``[uncertainty]``.
    """
    return Fit(*_pneuma.fit(rig, _listed(train), _listed(held_out), list(free)))


def identify(part: str, rig: Rig, recordings: Union[Recording, Sequence[Recording]]) -> Fit:
    """Numbers of the rig from a bench experiment, each with its deviation; ``improved_rig`` has them.

    ``part`` is ``"valve-flow"``, ``"spool"``, ``"heat-transfer"``, ``"friction"``, ``"presliding"`` or
    ``"dead-volume"``; what each needs stands in ``docs/identify.md``.
    """
    return Fit(*_pneuma.identify(part, rig, _listed(recordings)))


def identify_valve_flow(rig: Rig, recordings: Union[Recording, Sequence[Recording]]) -> Fit:
    """Null, areas over the opening, critical pressure ratio and dead volumes, measured with the
    chambers as flow meters."""
    return Fit(*_pneuma.valve_flow(rig, _listed(recordings)))


def diagnose(
    rig: Rig,
    train: Union[Recording, Sequence[Recording]],
    held_out: Union[Recording, Sequence[Recording]] = (),
    progress: Optional[Callable[[str], object]] = None,
) -> Verdict:
    """Says what physics the rig leaves out, how large it is, and proves it on held-out recordings.

    ``progress`` is called with the name of each stage. Other threads run meanwhile; Ctrl-C ends the
    work at the next stage.
    """
    return Verdict(_pneuma.diagnose(rig, _listed(train), _listed(held_out), progress))


def simulate(scenario: Path) -> dict[str, _np.ndarray]:
    """A scenario file to the columns of a recording, by name, in the rig's units, shape (rows,)."""
    columns, note = _pneuma.simulate(scenario)
    if note is not None:
        import warnings

        warnings.warn(note, stacklevel=2)
    return {name: _np.asarray(values) for name, values in columns}


def _listed(recordings: Union[Recording, Sequence[Recording]]) -> list[Recording]:
    return [recordings] if isinstance(recordings, Recording) else list(recordings)
