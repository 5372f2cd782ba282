"""Units of measured columns, and the sizes from which a value without a unit is doubted."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache

from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.core.scenario.field_types import MAX_FINGERS
from slipgrasp.core.scenario.space import PLANAR, SPATIAL
from slipgrasp.core.trace.columns import labels_of, units_of
from slipgrasp.core.trace.signals import SIGNALS, TraceShape
from slipgrasp.recordings.exceptions import RecordingError

_PREFIXES = {"": 1.0, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "k": 1e3}
_ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": 3.141592653589793 / 180.0}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6}
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9}
_PER_SECOND = {"m/s": _LENGTHS, "rad/s": _ANGLES}
_PER_SECOND_SQUARED = {"m/s²": _LENGTHS, "rad/s²": _ANGLES}

_LARGEST = {"m": 5.0, "rad": 12.6, "N": 1e4, "N m": 1e3, "m/s": 50.0}
"""Sizes beyond which a value without a unit is doubted, by SI unit."""

_LARGEST_SLIP = 0.5
"""The same of slips [m]."""

LONGEST_INTERVAL = 1.0
"""Longest usual time between samples [s]; times in ms have longer ones."""

_SMALLER = {"m": "mm", "rad": "deg", "N": "mN", "N m": "mN m", "m/s": "mm/s", "s": "ms"}
_MEASURABLE = ("object", "contacts", "joints")


class ImportDataError(RecordingError):
    """Measured data that cannot be imported; the sentence names field, value, limit and remedy."""


@cache
def factors_of(unit: str) -> dict[str, float]:
    """Spellings of a unit, and what a value in each is multiplied by to be in the SI unit.

    Args:
        unit: The SI unit.
    """
    if unit == "s":
        return _TIMES
    if unit == "m":
        return _LENGTHS
    if unit == "rad":
        return _ANGLES
    if unit in _PER_SECOND:
        return {f"{name}/s": factor for name, factor in _PER_SECOND[unit].items()}
    if unit in _PER_SECOND_SQUARED:
        per = _PER_SECOND_SQUARED[unit].items()
        return {f"{name}/{power}": factor for name, factor in per for power in ("s²", "s2", "s^2")}
    if unit in ("N", "N m"):
        spellings = dict.fromkeys((unit, unit.replace(" ", "")))
        return {f"{p}{s}": factor for p, factor in _PREFIXES.items() for s in spellings}
    return {unit: 1.0}


def unit_of_header(header: str, units: Iterable[str]) -> str:
    """The spelling of a unit at the end of a header, as in ``x_mm``, ``wz_rad_s`` or ``F [N]``.

    Args:
        header: The name of a column of a table.
        units: SI units that it may have.

    Returns:
        The spelling as `factors_of` has it, empty if the header has none.
    """
    bracketed = re.search(r"[\[(]([^\])]+)[\])]\s*$", header)
    for unit in units:
        for spelling in sorted(factors_of(unit), key=len, reverse=True):
            suffix = spelling.replace("/", "_").replace(" ", "_")
            if bracketed is not None and bracketed[1].strip() == spelling:
                return spelling
            if len(unit) and bracketed is None and header.endswith(f"_{suffix}"):
                return spelling
    return ""


def units_of_signal(name: str) -> tuple[str, ...]:
    """SI units that a measured signal may have; slides measure in m where links do in rad.

    Args:
        name: Name of a column of runs, such as ``slip_0`` or ``joint_position_1_0``.

    Raises:
        ImportDataError: If no run has such a column.
    """
    known = _measurable()
    if name not in known:
        message = (
            f"--map: '{name[:60]}' is no signal{nearest(name, known)}; signals are named like "
            "x, y, theta, slip_0, normal_force_0, joint_position_0_1, torque_0_1 (docs/fit.md)"
        )
        raise ImportDataError(message)
    return known[name]


@cache
def _measurable() -> dict[str, tuple[str, ...]]:
    known: dict[str, tuple[str, ...]] = {}
    for space in (SPATIAL, PLANAR):
        shape = TraceShape(MAX_FINGERS, (), space=space, soft=True)
        for signal in SIGNALS:
            if signal.topic not in _MEASURABLE or signal.holds_phases or not shape.has(signal):
                continue
            labels, units = labels_of(signal, shape), units_of(signal, shape)
            for label, unit in zip(labels, units, strict=True):
                name = "_".join(part for part in (signal.prefix, label) if part)
                known[name] = (unit, signal.slides_unit) if signal.slides_unit else (unit,)
    return known


def check_size(name: str, header: str, unit: str, largest: float) -> None:
    """Doubts a column without a stated unit whose values are too large for its SI unit.

    Args:
        name: The signal, or ``t`` for the longest interval between samples.
        header: The column of the table.
        unit: Its SI unit.
        largest: Its largest absolute value, in that unit if it is right.

    Raises:
        ImportDataError: If it is likely to be in another unit.
    """
    limit = LONGEST_INTERVAL if name == "t" else _LARGEST.get(unit)
    if unit == "m" and name.startswith("slip"):
        limit = _LARGEST_SLIP
    if limit is None or largest <= limit:
        return
    smaller = _SMALLER[unit]
    what = "its samples are" if name == "t" else "it reaches"
    apart = " apart" if name == "t" else ""
    raise ImportDataError(
        f"column '{header}' ({name}) states no unit, and {what} {largest:.6g} {unit}{apart}, more "
        f"than {limit:g} {unit}: it looks like {smaller}; write --map '{name}={header}:{smaller}', "
        f"or '{name}={header}:{unit}' if it is right"
    )
