"""Labels of the axes and panels of a map: key, symbol and unit."""

from __future__ import annotations

import json
import re
from typing import Any

from slipgrasp.core.scenario.space import PLANAR
from slipgrasp.core.study.definition import Study
from slipgrasp.recordings.study.map_axes import parameter_of

_SYMBOLS = {
    "object.mass": r"$m_o$",
    "object.inertia": r"$I_o$",
    "fingers.*.friction": r"$\mu$",
    "controller.lyapunov_weight": r"$Q$",
    "controller.position_gain": r"$K_p$",
    "controller.velocity_gain": r"$K_v$",
    "controller.adaptation_gain": r"$\Gamma$",
    "simulation.gravity": r"$g$",
}
_FRICTION = re.compile(r"fingers\.(\d+)\.friction")
_LINK_MASS = re.compile(r"fingers\.(\d+)\.link_masses\.(\d+)")
_INDEX = re.compile(r"\.(\d+|\*)(?=\.|$)")


def axis_label(study: Study, key: str) -> str:
    """Symbol, key and unit of an axis."""
    unit = _unit(study, key)
    parts = [_symbol(key), _plain(key), f"[{unit or '–'}]"]
    return "  ".join(part for part in parts if part)


def panel_title(study: Study, values: dict[str, Any]) -> str:
    """The crossed values of a panel, such as ``Q = 20``."""
    return ",  ".join(_equation(study, key, value) for key, value in values.items())


def _equation(study: Study, key: str, value: Any) -> str:
    unit = _unit(study, key)
    name = _symbol(key) or _plain(key)
    return f"{name} = {spelled(value)}{f' {unit}' if unit else ''}"


def spelled(value: Any) -> str:
    """Formats a value for people."""
    if isinstance(value, bool) or value is None:
        return json.dumps(value)
    if isinstance(value, (int, float)):
        return f"{value:g}"
    return _plain(value if isinstance(value, str) else json.dumps(value))


def same_quantity(x: str, y: str) -> bool:
    """Whether two keys set the same quantity of two fingers."""
    return x != y and _INDEX.sub(".*", x) == _INDEX.sub(".*", y)


def equality_words(x: str, y: str) -> str:
    """Equality of both, in symbols if available."""
    one, other = _symbol(x), _symbol(y)
    return f"{one} = {other}" if one and other else "both equal"


def projection_note(study: Study, shown: tuple[str, ...]) -> str:
    """Varied parameters that the map does not show; empty if it shows all."""
    hidden = [key for key in study.keys if key not in shown]
    if not hidden:
        return ""
    words = [f"{_plain(key)}{_range(study, key)}" for key in hidden]
    return f"Projected: also varied {'was' if len(words) == 1 else 'were'} {', '.join(words)}."


def _range(study: Study, key: str) -> str:
    axis = next((axis for axis in study.axes if axis.key == key), None)
    if axis is None or not axis.is_range:
        return ""
    unit = _unit(study, key)
    return f" ({axis.minimum:g} … {axis.maximum:g}{f' {unit}' if unit else ''})"


def _symbol(key: str) -> str:
    if match := _FRICTION.fullmatch(key):
        return rf"$\mu_{{{int(match[1]) + 1}}}$"
    if match := _LINK_MASS.fullmatch(key):
        return rf"$m_{{{PLANAR.joints_per_finger * int(match[1]) + int(match[2]) + 1}}}$"
    return _SYMBOLS.get(key, "")


def _unit(study: Study, key: str) -> str:
    """The unit in print, empty for a pure number."""
    parameter = parameter_of(study, key)
    return "" if parameter is None or parameter.unit == "1" else parameter.unit


def _plain(text: str) -> str:
    return text.replace("$", r"\$")
