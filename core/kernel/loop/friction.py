"""Coulomb friction of a contact, with possibly larger static friction."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record


@compiled
def present_friction(model: Record, discrete: Record, i: int) -> float:
    """Friction coefficient of contact ``i``: static in stick, sliding in slip."""
    truth = model.truth
    return truth.static_friction[i] if discrete.phases[i] == 0 else truth.friction[i]


@compiled
def has_static_excess(model: Record, i: int) -> bool:
    """True if contact ``i`` has larger static than sliding friction."""
    return model.truth.static_friction[i] > model.truth.friction[i]
