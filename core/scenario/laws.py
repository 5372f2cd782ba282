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
        stops_slip_with: Keys of the parameters that end a slip sooner where they are larger.
        learns_with: Keys of the parameters that make its estimates change faster where they are
            larger.
    """

    kind: str
    sampled: bool = False
    learns: bool = False
    uses_friction: bool = True
    reacts_to_slip: bool = False
    stops_slip_with: tuple[str, ...] = ()
    learns_with: tuple[str, ...] = ()

    @property
    def holds_with(self) -> str:
        """Key of the parameter that makes it squeeze harder where it is larger."""
        return "controller.grip_safety" if self.uses_friction else "controller.grip_force"


_GRADIENT = ("controller.lyapunov_weight", "controller.adaptation_gain")

CONTROL_LAWS = {
    law.kind: law
    for law in (
        ControlLaw(
            kind="theorem-3",
            learns=True,
            stops_slip_with=("controller.lyapunov_weight",),
            learns_with=_GRADIENT,
        ),
        ControlLaw(
            kind="theorem-4",
            learns=True,
            stops_slip_with=("controller.lyapunov_weight",),
            learns_with=_GRADIENT,
        ),
        ControlLaw(kind="certainty-equivalence"),
        ControlLaw(kind="pd-gravity", uses_friction=False),
        ControlLaw(
            kind="grip-reflex",
            sampled=True,
            uses_friction=False,
            reacts_to_slip=True,
            stops_slip_with=("controller.grip_rate",),
        ),
        ControlLaw(
            kind="composite",
            sampled=True,
            learns=True,
            stops_slip_with=("controller.slip_stop",),
            learns_with=("controller.lyapunov_weight", "controller.initial_deviation"),
        ),
    )
}
