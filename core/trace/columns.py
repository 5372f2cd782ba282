"""The signals of a trace as named columns with one number or phase per row.

This is the only definition of the names, units and order of columns: tables in all formats, the
REST interface and comparisons use it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from slipgrasp.core.scenario.field_errors import template_key, template_keys
from slipgrasp.core.trace.signals import SIGNALS, Floats, Phases, Samples, Signal, TraceShape
from slipgrasp.core.trace.types import ContactPhase

_SHORT = (
    ("times",),
    ("object_pose",),
    ("tracking_error",),
    ("slip", "slip_velocity", "phase", "normal_force", "tangential_force"),
    ("spin", "spin_velocity", "torsional_moment"),
    ("joint_torque", "joint_position"),
    ("estimates",),
    ("diagnostics",),
)
"""The signals of the short table; those of one group are interleaved."""

_PHASE_LABELS = {phase.value: phase.label for phase in ContactPhase}


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One number or phase over time.

    Attributes:
        name: Name: ``slip_0``, ``error_x``, ``torque_0_1``, ``estimate_object.mass``.
        signal: The signal of the trace that contains it.
        unit: SI unit, "1" for pure numbers, "" for phases.
        values: One value per row of the trace, shape ``(rows,)``.
    """

    name: str
    signal: str
    unit: str
    values: Floats | Phases

    @property
    def holds_phases(self) -> bool:
        """Whether its values are those of `slipgrasp.core.trace.types.ContactPhase`."""
        return np.issubdtype(self.values.dtype, np.integer)

    def phase_labels(self) -> list[str]:
        """The phases as words; only for columns of phases."""
        return [_PHASE_LABELS[value] for value in self.values.tolist()]


def columns_of(trace: Samples) -> list[Column]:
    """All columns of a trace in the order of `SIGNALS`; the first is the time."""
    there = (signal for signal in _signals_of(trace.shape) if signal.name not in trace.absent)
    return [column for signal in there for column in _columns_of(trace, signal)]


def short_columns(trace: Samples) -> list[Column]:
    """The columns of the short table (CSV): the most important signals, contact by contact."""
    by_name = {signal.name: signal for signal in SIGNALS if trace.shape.has(signal)}
    groups = [
        [list(_columns_of(trace, by_name[name])) for name in group if name in by_name]
        for group in _SHORT
    ]
    return [column for group in groups for column in _alternate(group)]


def _alternate(signals: list[list[Column]]) -> Iterator[Column]:
    """Columns of several signals interleaved by item; several per item for longer signals."""
    count = min(map(len, signals), default=0)
    for k in range(count):
        for columns in signals:
            each = len(columns) // count
            yield from columns[each * k : each * (k + 1)]


def labels_of(signal: Signal, shape: TraceShape) -> tuple[str, ...]:
    """Names of the components of a signal, one per column; "" for a single number."""
    contacts = range(shape.num_contacts)
    if signal.per == "pose":
        return shape.space.pose
    if signal.per == "coordinate":
        return shape.coordinates
    if signal.per == "tangent":
        named = (f"{axis}_{i}" for i in contacts for axis in shape.space.tangents)
        return tuple(name.lstrip("_") for name in named)
    if signal.per in ("contact", "path", "pad"):
        return tuple(str(contact) for contact in contacts[: shape.width(signal)])
    if signal.per == "joint":
        joints, fingers = range(shape.joints_per_finger), contacts[: shape.num_jointed]
        return tuple(f"{finger}_{joint}" for finger in fingers for joint in joints)
    if signal.per == "diagnostic":
        return tuple(diagnostic.name for diagnostic in shape.diagnostics)
    return shape.unknowns if signal.per == "unknown" else ("",)


def units_of(signal: Signal, shape: TraceShape) -> list[str]:
    """SI units of the components of a signal, one per column."""
    if signal.per == "unknown":
        definitions, space = template_keys(shape.space), shape.space
        return [definitions[template_key(key, space)].unit for key in shape.unknowns]
    if signal.per == "diagnostic":
        return [diagnostic.unit for diagnostic in shape.diagnostics]
    if shape.width(signal) == 0:
        return []
    if signal.per == "joint":
        joints = range(shape.width_of_joints)
        return [signal.slides_unit if k in shape.slides else signal.unit for k in joints]
    units = signal.unit_in(shape.space).split(", ")
    # One common unit, one each, or one for x and y and one for the angle, which a rail lacks.
    units = units[: shape.width(signal)]
    return [*units[:1] * (shape.width(signal) - len(units)), *units]


@lru_cache(maxsize=64)
def _signals_of(shape: TraceShape) -> tuple[Signal, ...]:
    return tuple(filter(shape.has, SIGNALS))


@lru_cache(maxsize=1024)
def _heads(signal: Signal, shape: TraceShape) -> tuple[tuple[str, str], ...]:
    """Name and unit of each column of a signal."""
    labels, units = labels_of(signal, shape), units_of(signal, shape)
    names = ("_".join(part for part in (signal.prefix, label) if part) for label in labels)
    return tuple(zip(names, units, strict=True))


def _columns_of(trace: Samples, signal: Signal) -> Iterator[Column]:
    values, heads = getattr(trace, signal.name), _heads(signal, trace.shape)
    table = values.reshape(len(values), len(heads))
    for (name, unit), column in zip(heads, table.T, strict=True):
        yield Column(name, signal.name, unit, column)
