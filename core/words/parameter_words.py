"""Names, units and values of parameters as text, consistent everywhere."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from slipgrasp.core.scenario.space import PLANAR, SPATIAL, Space

_WITH_COORDINATES = ("base", "start", "acceleration", "amplitude", "force", "moment", "pose")
_ESTIMATES = {
    "initial": "initial",
    "minimum": "least",
    "maximum": "largest",
}
# Names and symbols that differ from the key.
_SPELLED = {
    "lyapunov_weight": "Lyapunov weight Q",
    "lyapunov_matrix": "Lyapunov matrix Q",
    "slip_position_gain": "position gain of slips Kₚ₂",
    "adaptation_gain": "adaptation gain Γ",
    "position_gain": "position gain Kₚ",
    "velocity_gain": "velocity gain Kᵥ",
}


def key_words(key: str, names: Sequence[str], space: Space = PLANAR) -> str:
    """Returns the name of a dotted key: ``left link mass 2`` for ``fingers.0.link_masses.1``.

    Args:
        key: The key.
        names: Names of the fingers.
        space: Kind of hand of the scenario.
    """
    parts = key.split(".")
    words: list[str] = []
    for i, part in enumerate(parts):
        following_is_index = i + 1 < len(parts) and parts[i + 1].isdigit()
        if not part.isdigit():
            word = _singular(part) if following_is_index else part
            words += [] if part == "fingers" else [_SPELLED.get(part, word)]
        elif parts[i - 1] == "fingers":
            words.append(names[int(part)])
        elif parts[i - 1] in _WITH_COORDINATES:
            words.append(_coordinate(parts[i - 1], int(part), space))
        else:
            words.append(str(int(part) + 1))
    text = " ".join(words).replace("_", " ")
    return text.replace("controller kind", "control law").replace("controller parameters", "law")


def _coordinate(name: str, index: int, space: Space) -> str:
    # Only a pose has an angle third; longer lists belong to spatial hands.
    is_planar = name not in ("base", "force", "moment") and index < len(space.coordinates)
    of = space if is_planar else SPATIAL
    return (of.pose if name == "start" else of.coordinates)[index].replace("_", " ")


def estimate_words(field: str, unknown: str) -> str:
    """Name of a field of an estimate, such as ``initial estimate of mass``.

    Args:
        field: Field of the estimate.
        unknown: Name of the unknown.
    """
    return f"{_ESTIMATES.get(field, field)} estimate of {unknown}"


def unit_words(unit: str) -> str:
    """A unit for a label, such as `` [kg m²]``; empty for pure numbers."""
    return f" [{unit}]" if _is_unit(unit) else ""


def unit_after(unit: str) -> str:
    """A unit to follow a number, such as `` kg m²``; empty for pure numbers."""
    return f" {unit}" if _is_unit(unit) else ""


def value_words(value: Any, unit: str = "") -> str:
    """A value with its unit as text: ``1.4 kg``, ``(0, -5) N``, ``none``."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (list, tuple)):
        return f"({', '.join(map(value_words, value))}){unit_after(unit)}"
    if isinstance(value, (int, float)):
        return f"{value + 0.0:g}{unit_after(unit)}"  # without the sign of -0
    return f"{value}{unit_after(unit)}"


def _is_unit(unit: str) -> bool:
    return unit not in ("", "1")


def _singular(word: str) -> str:
    if word.endswith(("sses", "ches")):
        return word.removesuffix("es")
    return word if word.endswith("bias") else word.removesuffix("s")
