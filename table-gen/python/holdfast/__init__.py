"""Formally synthesised frequency response of EV chargers.

    import holdfast
    spec = holdfast.Spec("paper-bi")
    synthesis = spec.synth()
    table = synthesis.table()
    table.verify(spec)["verified"]
    spec.simulate(table).summary["nadir_hz"]

Frequencies are deviations from 50 Hz in Hz, powers are in GW, axes are in the order f, g, l, p
(frequency, governor, lead-lag, turbine), unless a name says otherwise.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import _holdfast

__version__ = _holdfast.__version__
__all__ = ["AXES", "Grid", "NOT_WON", "Run", "Spec", "Synthesis", "Table", "compare", "shipped"]

AXES = ("f", "g", "l", "p")
NOT_WON = _holdfast.not_won()
_COLUMNS = ("time_s", "f_hz", "g_gw", "l_gw", "p_gw", "participation", "delivered")


def shipped():
    """Names of the shipped specs."""
    return _holdfast.shipped()


@dataclass(frozen=True)
class Grid:
    """The grid of cells, by axis."""

    lower: np.ndarray
    width: np.ndarray
    count: tuple

    def edges(self, axis):
        """Edges of the cells of an axis, by its name."""
        at = AXES.index(axis)
        return self.lower[at] + self.width[at] * np.arange(self.count[at] + 1)

    def centres(self, axis):
        """Centres of the cells of an axis, by its name."""
        edges = self.edges(axis)
        return 0.5 * (edges[:-1] + edges[1:])


class Spec:
    """A specification: a shipped name or the path of a TOML file, and keys to override."""

    def __init__(self, spec, overrides=None):
        pairs = [f"{key}={_toml(value)}" for key, value in (overrides or {}).items()]
        self._native = _holdfast.Spec.load(os.fspath(spec), pairs)

    @property
    def name(self):
        """The spec's name."""
        return self._native.name()

    @property
    def hash(self):
        """What a table says it was made for, in hexadecimal digits."""
        return self._native.hash()

    def toml(self):
        """The spec with every default, as TOML."""
        return self._native.toml()

    def to_dict(self):
        """The spec with every default."""
        return json.loads(self._native.json())

    def synth(self):
        """Solves the games. RuntimeError if no controller exists, or if the spec has no games."""
        return Synthesis(self._native.synth())

    def table(self):
        """The table, from games or, where the law is a response, from the spec itself."""
        return Table(self._native.table())

    def simulate(
        self,
        table=None,
        *,
        controller=None,
        loss_gw=None,
        duration_s=None,
        participation_error=0.0,
        seed=0,
    ):
        """The grid after a loss: with a table, or with controller "none" or "baseline" (the droop)."""
        if controller is None:
            controller = "none" if table is None else "symbolic"
        text, rows = _holdfast.simulate(
            self._native,
            controller,
            None if table is None else Table(table).data,
            loss_gw,
            duration_s,
            participation_error,
            seed,
        )
        return Run(json.loads(text), np.frombuffer(rows, "<f8").reshape(-1, len(_COLUMNS)))

    def __repr__(self):
        return f"Spec({self.name!r})"


def _toml(value):
    """A value as the command line's --set takes it."""
    if value is None:
        return "none"
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    return json.dumps(value)


class Synthesis:
    """The solved games of a spec."""

    def __init__(self, native):
        self._native = native
        lower, width, count = native.grid()
        self.grid = Grid(np.array(lower), np.array(width), tuple(count))
        self.problems = json.loads(native.problems())

    @property
    def laws(self):
        """Names of the laws: C1, and C2 and Hold where the spec has them."""
        return [problem["name"] for problem in self.problems]

    def ranks(self, law):
        """Worst-case steps to the target of each cell (0 in it, NOT_WON where none is sure)."""
        return self._shaped(self._native.ranks(law), "<u2")

    def winning(self, law, with_target=False):
        """The winning cells of a law."""
        ranks = self.ranks(law)
        return (ranks != NOT_WON) & (ranks >= (0 if with_target else 1))

    def inputs(self, law):
        """Allowed inputs of each cell: a bit for each level of participation."""
        return self._shaped(self._native.masks(law), "<u4")

    def table(self, dense=False):
        """The laws as a table; `dense` leaves out the compression."""
        return Table(self._native.table(dense))

    def _shaped(self, data, kind):
        return np.frombuffer(data, kind).reshape(self.grid.count, order="F")


class Table:
    """The bytes that are flashed."""

    def __init__(self, data):
        self.data = data.data if isinstance(data, Table) else bytes(data)

    @classmethod
    def load(cls, path):
        """Reads a table from a file."""
        return cls(Path(path).read_bytes())

    def save(self, path):
        """Writes the table to a file."""
        Path(path).write_bytes(self.data)

    def verify(self, spec):
        """The verdict of the independent check of the bytes, as verdict.json has it."""
        return json.loads(_holdfast.verify_table(self.data, spec._native))

    def __len__(self):
        return len(self.data)

    def __repr__(self):
        return f"Table({len(self)} bytes)"


class Run:
    """A run: columns as arrays, a summary, and the phases of the firmware."""

    def __init__(self, said, rows):
        self.summary = said["summary"]
        self.phases = said["phases"]
        self._rows = rows

    def __getitem__(self, column):
        return self._rows[:, _COLUMNS.index(column)]

    def keys(self):
        """Names of the columns: with them `pandas.DataFrame(dict(run))` is a table."""
        return list(_COLUMNS)

    @property
    def frequency_hz(self):
        """Absolute frequency."""
        return 50.0 + self["f_hz"]


def compare(spec, table, losses_gw, **options):
    """One row for each loss and controller, for a pandas.DataFrame."""
    rows = []
    for loss_gw in losses_gw:
        for name, controller in (("none", "none"), ("droop", "baseline"), ("table", "symbolic")):
            run = spec.simulate(table, controller=controller, loss_gw=loss_gw, **options)
            rows.append({"loss_gw": loss_gw, "controller": name, **run.summary})
    return rows
