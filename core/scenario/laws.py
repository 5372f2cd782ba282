"""The control laws: what each one is, knows and does, stated once for everything that asks."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["CONTROL_LAWS", "ControlLaw"]


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlLaw:
    """Facts about a control law that do not depend on a scenario.

    Attributes:
        kind: Its name, the value of ``controller.kind``.
        sampled: Whether it works at the ticks of sampled control only.
        learns: Whether it changes its estimates while it runs.
        uses_friction: Whether its grip follows from the friction that it believes in; otherwise
            from ``controller.grip_force``.
        reacts_to_slip: Whether its grip grows because a contact slips.
    """

    kind: str
    sampled: bool = False
    learns: bool = False
    uses_friction: bool = True
    reacts_to_slip: bool = False


CONTROL_LAWS = {
    law.kind: law
    for law in (
        ControlLaw(kind="theorem-3", learns=True),
        ControlLaw(kind="theorem-4", learns=True),
        ControlLaw(kind="certainty-equivalence"),
        ControlLaw(kind="pd-gravity", uses_friction=False),
        ControlLaw(kind="grip-reflex", sampled=True, uses_friction=False, reacts_to_slip=True),
        ControlLaw(kind="composite", sampled=True, learns=True),
    )
}
