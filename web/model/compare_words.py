"""Names of columns and metrics of runs, and their values with units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from slipgrasp.core.run.metrics import METRICS
from slipgrasp.core.scenario.laws import law_alias
from slipgrasp.core.scenario.space import PLANAR, space_of_errors
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.words.parameter_words import key_words, unit_words
from slipgrasp.recordings.compare.differences import SignalDifference

MISSING = "–"

_SIGNALS = {signal.name: signal for signal in SIGNALS}
_SIGNAL_WORDS = {"object_pose": "object", "estimates": "estimate of", "true_parameters": "true"}
_METRIC_WORDS = {
    "outcome": "outcome",
    "end_time": "ended at",
    "last_slip_time": "last slip ends",
    "minimum_friction_margin": "least friction margin in stick",
    "rms_tracking_error": "error of the object, rms",
    "final_tracking_error": "error of the object, at the end",
    "phase_change_count": "phase changes",
}
_METRIC_UNITS = {"end_time": "s", **{metric.name: metric.unit for metric in METRICS}}
_COORDINATES: dict[str, str] = dict(zip(PLANAR.coordinates, ("x", "y", "θ"), strict=True))
_IN_THOUSANDTHS = ("m", "m/s", "m/s²", "rad", "rad/s", "rad/s²")
_WHOLE_FROM, _WHOLE_TO = 100.0, 1e6
_NEGLIGIBLE = 1e-9
METRIC_ACCURACY = 1e-6
"""Metrics below this, in the unit shown, are errors of the integration."""


class Scale(NamedTuple):
    """Format of a quantity: factor and unit."""

    factor: float
    unit: str


def scale_of(unit: str, values: Iterable[float] = ()) -> Scale:
    """The format of values of one quantity: lengths and angles in thousandths.

    Args:
        unit: Its SI unit; "1" or "" for pure numbers.
        values: The values; times are in ms if all are shorter than a second.
    """
    is_short = unit == "s" and 0.0 < max(map(abs, values), default=0.0) < 1.0
    if unit in _IN_THOUSANDTHS or is_short:
        return Scale(1e3, f"m{unit_words(unit).strip(' []')}")
    return Scale(1.0, unit_words(unit).strip(" []"))


def number(value: float, *, signed: bool = False, padded: bool = False) -> str:
    """A number with three digits, or more if it is large: ``2.59``, ``5991``.

    Numbers that are negligible in any unit, such as rounding errors, are ``≈ 0``.

    Args:
        value: The number.
        signed: Whether to include a plus sign.
        padded: Whether to keep trailing zeros, so that numbers of a column align.
    """
    if 0.0 < abs(value) < _NEGLIGIBLE:
        return "≈ 0"
    sign, digits = "+" if signed and value else "", "#.3g" if padded else ".3g"
    is_whole = _WHOLE_FROM <= abs(value) < _WHOLE_TO
    return (f"{value:{sign}.0f}" if is_whole else f"{value:{sign}{digits}}").replace("-", "−")


def scaled(scale: Scale, value: float, *, signed: bool = False) -> str:
    """A number in the unit of a scale; counts are integers."""
    is_count = isinstance(value, int)
    return number(value if is_count else scale.factor * value, signed=signed, padded=not is_count)


def scaled_metric(scale: Scale, value: float, *, signed: bool = False) -> str:
    """A metric in the unit of a scale; errors of the integration are ``≈ 0``."""
    is_zero = 0.0 < abs(scale.factor * value) < METRIC_ACCURACY
    return "≈ 0" if is_zero else scaled(scale, value, signed=signed)


def amount(value: float, unit: str, *, signed: bool = False) -> str:
    """A number with its unit: ``2.59 mm``.

    Args:
        value: The number.
        unit: Its SI unit; "1" or "" for pure numbers.
        signed: Whether to include a plus sign.
    """
    factor, shown = scale_of(unit, [value])
    return f"{number(factor * value, signed=signed)} {shown}".strip()


def time_words(time: float) -> str:
    """A simulation time [s]."""
    return amount(time, "s")


def value_words(value: Any) -> str:
    """A value of a parameter (12 digits); a dash if missing."""
    if value is None:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (tuple, list)):
        return ", ".join(map(value_words, value))
    if isinstance(value, (int, float)):
        return f"{value:.12g}"
    return law_alias(str(value)).replace("_", " ")


def metric_words(name: str) -> tuple[str, str]:
    """The name of a metric, and its SI unit; not for metrics per coordinate.

    Args:
        name: Field of `slipgrasp.core.run.metrics.Metrics`, ``outcome`` or ``end_time``.
    """
    return _METRIC_WORDS.get(name, name.replace("_", " ")), _METRIC_UNITS.get(name, "")


def coordinate_words(name: str, count: int) -> list[tuple[str, str]]:
    """The letters and units of a metric with one value per coordinate.

    Args:
        name: Name of the metric.
        count: Number of coordinates: 1 (rail), 3 (planar) or 6 (spatial).
    """
    units, space = _METRIC_UNITS[name].split(", "), space_of_errors(count)
    letters = [_COORDINATES.get(key, key.replace("_", " ")) for key in space.errors]
    angles = count - space.num_positions
    return list(zip(letters, units[:1] * space.num_positions + units[-1:] * angles, strict=True))


def column_words(column: SignalDifference, names: Sequence[str]) -> str:
    """The name of a column: ``slip velocity left``, ``estimate of object mass``.

    Args:
        column: The column.
        names: Names of the fingers.
    """
    words = _SIGNAL_WORDS.get(column.signal, column.signal.replace("_", " "))
    return f"{words} {_label(column, names)}".strip()


def _label(column: SignalDifference, names: Sequence[str]) -> str:
    signal, parts = _SIGNALS[column.signal], column.name.split("_")
    per = signal.per
    if per in ("pose", "coordinate"):
        turn = "turn " if "turn" in parts else ""
        return turn + _COORDINATES.get(parts[-1], parts[-1])
    if per in ("contact", "tangent", "path", "pad"):
        axis = f" {parts[-2]}" if parts[-2] in ("x", "y") else ""
        return names[int(parts[-1])] + axis
    if per == "joint":
        return f"{names[int(parts[-2])]} {int(parts[-1]) + 1}"
    if per == "unknown":
        return key_words(column.name.removeprefix(f"{signal.prefix}_"), names)
    return ""
