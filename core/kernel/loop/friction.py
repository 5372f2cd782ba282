"""Coulomb friction of a contact, where stick may have more of it than slip."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record


@compiled
def present_friction(model: Record, discrete: Record, i: int) -> float:
    """The friction coefficient that bounds, or sets, the force of contact ``i`` in its phase."""
    truth = model.truth
    return truth.static_friction[i] if discrete.phases[i] == 0 else truth.friction[i]


@compiled
def has_static_excess(model: Record, i: int) -> bool:
    """Whether contact ``i`` has more friction in stick than in slip."""
    return model.truth.static_friction[i] > model.truth.friction[i]
