"""Rows of the trace: columns of all signals, and common values."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Layout, Record
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.scenario import MAX_DIAGNOSTICS, MAX_UNKNOWNS
from slipgrasp.core.scenario.custom_laws import Diagnostic
from slipgrasp.core.scenario.space import Space
from slipgrasp.core.trace.signals import SIGNALS, Signal, TraceShape

LARGEST = 1e300
DEPENDENT = 1e-10

# Column index: a constant, and coefficients per finger, unknown and diagnostic.
Columns = tuple[int, int, int, int]
_Places = namedtuple("_Places", [*(signal.name for signal in SIGNALS), "end"])


def place_signals(space: Space) -> Any:
    """First column of every signal by name, and the end of a row for hard fingertips.

    Columns of soft fingertips follow.
    """

    def columns_before(signals: Sequence[Signal]) -> Columns:
        def columns(n: int, p: int, d: int) -> int:
            shape = _shape(n, p, d, space)
            return sum(shape.width(signal) for signal in signals)

        none = columns(0, 0, 0)
        return none, columns(1, 0, 0) - none, columns(0, 1, 0) - none, columns(0, 0, 1) - none

    return _Places._make(columns_before(SIGNALS[:index]) for index in range(len(SIGNALS) + 1))


def _shape(n: int, p: int, d: int, space: Space) -> TraceShape:
    return TraceShape(n, ("",) * p, (Diagnostic("", "", ""),) * d, space)


def row_layout(
    state: Layout, discrete: Layout, more: Sequence[tuple[Any, ...]], space: Space
) -> Layout:
    """Layout of a row: its state, derived values and signals.

    Args:
        state: Integrated state.
        discrete: Discrete state.
        more: Additional fields for this kind of hand.
        space: Kind of hand.
    """
    shape = replace(_shape(MAX_FINGERS, MAX_UNKNOWNS, MAX_DIAGNOSTICS, space), soft=space.has_pads)
    fields = [
        ("time", np.float64),  # [s]
        ("state", state),
        ("discrete", discrete),
        ("kinetic_energy", np.float64),  # [J]
        ("potential_energy", np.float64),  # [J]
        ("length", np.int64),
        ("values", np.float64, (shape.num_columns,)),
        *more,
    ]
    return np.dtype(fields, align=True)


@compiled
def column_of(model: Record, place: Columns) -> int:
    """First column of a signal."""
    n, p, d = model.num_fingers, model.num_unknowns, model.num_diagnostics
    return place[0] + place[1] * n + place[2] * p + place[3] * d


@compiled
def set_value(model: Record, row: Record, place: Columns, k: int, value: float) -> None:
    """Writes component ``k`` of a signal."""
    row.values[column_of(model, place) + k] = value


@compiled
def finite(value: float) -> float:
    """Limits a magnitude that is infinite for a singular matrix."""
    return value if value < LARGEST else LARGEST


@compiled
def remove_parts(vectors: Floats, length: int, count: int, candidate: int) -> float:
    """Makes a vector orthogonal to ``count`` orthonormal vectors.

    Returns:
        The squared length of the result; 0 if the vector depends on them.
    """
    whole, rest = 0.0, 0.0
    for k in range(length):
        whole += square(vectors[candidate, k])
    for _ in range(2):
        for i in range(count):
            part = 0.0
            for k in range(length):
                part += vectors[i, k] * vectors[candidate, k]
            for k in range(length):
                vectors[candidate, k] -= part * vectors[i, k]
    for k in range(length):
        rest += square(vectors[candidate, k])
    return 0.0 if rest <= square(DEPENDENT) * whole else rest


def make_fill_shared(at: Any, true_value: Callable[..., Any]) -> Any:
    """Creates the function that writes the common signals of a row.

    Args:
        at: Columns of the signals.
        true_value: Returns the true value of an unknown.
    """

    @compiled
    def fill_shared(model: Record, row: Record, supplied: float, dissipated: float) -> None:
        set_value(model, row, at.times, 0, row.time)
        set_value(model, row, at.kinetic_energy, 0, row.kinetic_energy)
        set_value(model, row, at.potential_energy, 0, row.potential_energy)
        set_value(model, row, at.supplied_energy, 0, supplied)
        set_value(model, row, at.dissipated_energy, 0, dissipated)
        for k in range(model.num_unknowns):
            value = true_value(model.truth, model.unknowns, k)
            set_value(model, row, at.true_parameters, k, value)
        for k in range(model.num_diagnostics):
            set_value(model, row, at.diagnostics, k, row.discrete.diagnostics[k])
        row.length = column_of(model, at.end)

    return fill_shared
