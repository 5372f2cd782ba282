"""Grip reflex: PD control with a grip that increases while any contact is detected to slip."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record


@compiled
def squeeze_harder(model: Record, discrete: Record) -> None:
    """Increases the grip for one control period of slip."""
    for i in range(model.num_fingers):
        if discrete.beliefs[i] != 0:
            discrete.added_grip += model.law.grip_rate * model.law.period
            break
    most = max(model.law.maximum_normal_force - model.law.grip_force, 0.0)
    discrete.added_grip = min(discrete.added_grip, most)
