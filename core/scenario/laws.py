"""The control laws: what each one is, knows, does and needs, stated once for all that ask.

Validation, words, page and kernel read the table; which parameters only some laws use stands
beside the parameters (`slipgrasp.core.scenario.controller`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from slipgrasp.core.scenario.space import SPACES, Space


@dataclass(frozen=True, slots=True, kw_only=True)
class LawSetting:
    """A parameter of the controller, and from where on its value suits a law.

    Attributes:
        key: Dotted key.
        value: What suits where the present value does not.
        above: Greater values suit as they are; None: nothing but ``value`` suits.
        when_sampled: Whether it matters in sampled control only.
    """

    key: str
    value: float | str | bool
    above: float | None = None
    when_sampled: bool = False

    def suits(self, present: float | str | bool) -> bool:
        """Whether a value of the parameter suits as it is."""
        if self.above is None:
            return present == self.value
        return not isinstance(present, str) and present > self.above


SAMPLED_CONTROL = LawSetting(key="controller.control_period", above=0.0, value=0.001)
# Torques that put a force on the edge of its cone, held for a period, let the contact slip.
_INSIDE_CONES = LawSetting(key="controller.grip_safety", above=1.0, value=1.05, when_sampled=True)
# Without it the slip velocity only decays.
_FINITE_TIME = LawSetting(key="controller.slip_stop", above=0.0, value=1.0)
# Their torque is Eq. 23 / 27, which puts the force of a slipping contact on its cone.
_EXACT = LawSetting(key="controller.distribution", value="exact")
# A late or false detection of slip then costs slip path, not the object.
_HOLDING = LawSetting(key="controller.distribution", value="hold")


def read_for(*hands: Space, default: bool = False) -> Any:
    """A fact by which kernels distinguish laws.

    Args:
        hands: Those whose kernel reads it; others refuse the laws that differ from the default.
        default: What is true of a law that says nothing.
    """
    return field(default=default, metadata={"hands": hands})


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlLaw:
    """Facts about a control law that do not depend on a scenario.

    What it needs and what it is meant for differ: validation refuses a law without the one, and
    without the other the law runs, but does not show what it can do
    (`slipgrasp.core.scenario.law_choice`).

    Attributes:
        kind: Its name, the value of ``controller.kind``.
        summary: What it does, in a sentence.
        sampled: Whether it needs sampled control, because it works at its ticks only.
        learns: Whether it changes its estimates while it runs.
        has_memory: Whether it learns by least squares, with a memory from tick to tick.
        pulls_back: Whether it pulls large estimates back (Eq. 28-29).
        uses_friction: Whether its grip follows from the friction that it assumes; otherwise
            from ``controller.grip_force``.
        reacts_to_slip: Whether its grip grows because a contact slips.
        holds_tips: Whether it holds the places of its fingertips, and closes with a force.
        is_own: Whether it is none of the program's, but a user's (docs/laws.md).
        stops_slip_with: Keys of the parameters that end a slip sooner where they are larger.
        learns_with: Keys of the parameters that make its estimates change faster where they are
            larger.
        settings: The parameters that it is meant for.
        bounded: Whether it is meant for estimates within physical bounds.
        firm: Whether it is meant for a ``controller.grip_force`` that carries the object.
    """

    kind: str
    summary: str
    sampled: bool = False
    learns: bool = read_for(*SPACES)
    has_memory: bool = read_for(*SPACES)
    pulls_back: bool = read_for(*SPACES)
    uses_friction: bool = read_for(*SPACES, default=True)
    reacts_to_slip: bool = read_for(*SPACES)
    holds_tips: bool = read_for(*SPACES)
    is_own: bool = read_for(*SPACES)
    stops_slip_with: tuple[str, ...] = ()
    learns_with: tuple[str, ...] = ()
    settings: tuple[LawSetting, ...] = ()
    bounded: bool = False
    firm: bool = False

    @property
    def gains(self) -> tuple[str, str]:
        """Keys of the stiffness and the damping of its feedback."""
        if self.holds_tips:
            return "controller.jaw_stiffness", "controller.jaw_damping"
        return "controller.position_gain", "controller.velocity_gain"

    @property
    def holds_with(self) -> str:
        """Key of the parameter whose larger values increase its grip force."""
        return "controller.grip_safety" if self.uses_friction else "controller.grip_force"


_GRADIENT = ("controller.lyapunov_weight", "controller.adaptation_gain")

CONTROL_LAWS = {
    law.kind: law
    for law in (
        ControlLaw(
            kind="theorem-3",
            summary="The paper's law for unknown masses; the tracking error changes the estimates.",
            learns=True,
            stops_slip_with=("controller.lyapunov_weight",),
            learns_with=_GRADIENT,
            settings=(_INSIDE_CONES, _EXACT),
        ),
        ControlLaw(
            kind="theorem-4",
            summary="The paper's law for unknown friction too; large estimates are pulled back.",
            learns=True,
            pulls_back=True,
            stops_slip_with=("controller.lyapunov_weight",),
            learns_with=_GRADIENT,
            settings=(_INSIDE_CONES, _EXACT),
        ),
        ControlLaw(
            kind="certainty-equivalence",
            summary="The torque of the paper's laws from the first estimates, without learning.",
            settings=(_INSIDE_CONES, _EXACT),
        ),
        ControlLaw(
            kind="pd-gravity",
            summary="Feedback, the estimated weight, and a fixed grip.",
            uses_friction=False,
            firm=True,
        ),
        ControlLaw(
            kind="grip-reflex",
            summary="Feedback, the estimated weight, and a grip that grows while a contact slips.",
            sampled=True,
            uses_friction=False,
            reacts_to_slip=True,
            stops_slip_with=("controller.grip_rate",),
        ),
        ControlLaw(
            kind="gripper",
            summary="Jaws that close with a force and hold their lateral positions while the arm "
            "moves as desired, like a commercial gripper; the law knows its jaws, but not the "
            "object.",
            sampled=True,
            uses_friction=False,
            holds_tips=True,
            firm=True,
        ),
        ControlLaw(
            kind="composite",
            summary="Learning by least squares from tracking and prediction errors.",
            sampled=True,
            learns=True,
            has_memory=True,
            stops_slip_with=("controller.slip_stop",),
            learns_with=("controller.lyapunov_weight", "controller.initial_deviation"),
            settings=(_INSIDE_CONES, _FINITE_TIME, _HOLDING),
            bounded=True,
        ),
    )
}

LAW_ALIASES = {"adaptive-mass": "theorem-3", "adaptive-friction": "theorem-4"}
"""Plainer names of built-in laws, accepted wherever a law is named; files keep ``kind``."""


def law_kind(name: Any) -> Any:
    """The ``kind`` that an alias stands for; anything else as it is."""
    return LAW_ALIASES.get(name, name) if isinstance(name, str) else name


def law_label(kind: str) -> str:
    """A law by its alias, if it has one, and by its ``kind``."""
    aliases = {known: alias for alias, known in LAW_ALIASES.items()}
    return f"{aliases[kind]} ({kind})" if kind in aliases else kind


def facts_read_for(hand: Space) -> tuple[str, ...]:
    """Names of the facts that the kernel of a kind of hands reads."""
    return tuple(each.name for each in fields(ControlLaw) if hand in each.metadata.get("hands", ()))


def is_computed_for(law: ControlLaw, hand: Space) -> bool:
    """Whether the kernel of a kind of hands reads all facts of a law."""
    return all(
        getattr(law, each.name) == each.default
        for each in fields(law)
        if hand not in each.metadata.get("hands", (hand,))
    )
