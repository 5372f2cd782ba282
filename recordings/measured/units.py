"""Units of measured columns, and plausibility limits of values without units."""

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
"""Values above which a missing unit is suspicious, by SI unit."""

_LARGEST_SLIP = 0.5
"""Slip above which a missing unit is suspicious [m]."""

LONGEST_INTERVAL = 1.0
"""Longest plausible time between samples [s]; times in ms exceed it."""

_SMALLER = {"m": "mm", "rad": "deg", "N": "mN", "N m": "mN m", "m/s": "mm/s", "s": "ms"}
_MEASURABLE = ("object", "contacts", "joints")


class ImportDataError(RecordingError):
    """Measured data that cannot be imported; the message names field, value, limit and remedy."""


@cache
def factors_of(unit: str) -> dict[str, float]:
    """Spellings of a unit, with their factors to the SI unit.

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
    """The spelling of a unit at the end of a header: ``x_mm``, ``w_rad_s``, ``a mm``, ``F [N]``.

    Args:
        header: The name of a column of a table.
        units: Possible SI units.

    Returns:
        The spelling as in `factors_of`, empty if the header has no unit.
    """
    bracketed = re.search(r"[\[(]([^\])]+)[\])]\s*$", header)
    for unit in units:
        for spelling in sorted(factors_of(unit), key=len, reverse=True):
            endings = (spelling, spelling.replace("/", "_").replace(" ", "_"))
            if bracketed is not None and bracketed[1].strip() == spelling:
                return spelling
            parted = tuple(f"{mark}{ending}" for ending in endings for mark in "_ .-")
            if len(unit) and bracketed is None and header.endswith(parted):
                return spelling
    return ""


def units_of_signal(name: str) -> tuple[str, ...]:
    """Possible SI units of a measured signal; prismatic joints use m, revolute joints rad.

    Args:
        name: Name of a column of runs, such as ``slip_0`` or ``joint_position_1_0``.

    Raises:
        ImportDataError: If runs have no such column.
    """
    known = _measurable()
    if name not in known:
        message = (
            f"--map: '{name[:60]}' is not a signal{nearest(name, known)}; signals are named like "
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
    """Rejects a column without a unit whose values are implausibly large in its SI unit.

    Args:
        name: The signal, or ``t`` for the longest interval between samples.
        header: The column of the table.
        unit: Its SI unit.
        largest: Largest absolute value, if that unit is correct.

    Raises:
        ImportDataError: If another unit is likely.
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
        f"column '{header}' ({name}) has no unit, and {what} {largest:.6g} {unit}{apart}, more "
        f"than {limit:g} {unit}: it may be in {smaller}; write --map '{name}={header}:{smaller}', "
        f"or '{name}={header}:{unit}' if it is correct"
    )
