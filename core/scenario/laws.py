"""Facts about the control laws: purpose, knowledge, effects and requirements, in one table.

Validation, text, dashboard and kernel use the table; the laws that use a parameter are declared
with the parameter (`slipgrasp.core.scenario.controller`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from slipgrasp.core.scenario.space import HANDS, Space


@dataclass(frozen=True, slots=True, kw_only=True)
class LawSetting:
    """A setting of a law: a parameter and its suitable values.

    Attributes:
        key: Dotted key.
        value: Suitable value, which replaces unsuitable ones.
        above: Values greater than this are suitable too; None: only ``value`` is suitable.
        when_sampled: Whether it matters only with sampled control.
    """

    key: str
    value: float | str | bool
    above: float | None = None
    when_sampled: bool = False

    def suits(self, present: float | str | bool) -> bool:
        """Whether a value of the parameter is suitable."""
        if self.above is None:
            return present == self.value
        return not isinstance(present, str) and present > self.above


SAMPLED_CONTROL = LawSetting(key="controller.control_period", above=0.0, value=0.001)
# A torque that is held for a period with a force on the edge of its cone lets the contact slip.
_INSIDE_CONES = LawSetting(key="controller.grip_safety", above=1.0, value=1.05, when_sampled=True)
# Without it, slip velocity only decays.
_FINITE_TIME = LawSetting(key="controller.slip_stop", above=0.0, value=1.0)
# Their torque is that of Eq. 23 / 27, which puts the force of a slipping contact on its cone.
_EXACT = LawSetting(key="controller.distribution", value="exact")
# Late or false detection of slip then causes slip but does not lose the object.
_HOLDING = LawSetting(key="controller.distribution", value="hold")


def read_for(*hands: Space, default: bool = False) -> Any:
    """A fact that distinguishes laws in kernels.

    Args:
        hands: Kinds of hands whose kernel uses it; others reject laws with other values.
        default: Value for laws that do not state it.
    """
    return field(default=default, metadata={"hands": hands})


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlLaw:
    """Facts about a control law that are independent of the scenario.

    Requirements and recommendations differ: validation rejects a law without its required settings;
    without its recommended settings the law runs, but not at its best
    (`slipgrasp.core.scenario.law_choice`).

    Attributes:
        kind: Name, the value of ``controller.kind``.
        summary: Description in a sentence.
        sampled: Whether it needs sampled control, because it acts at ticks only.
        learns: Whether it changes its estimates during a run.
        has_memory: Whether it uses least squares with a memory between ticks.
        pulls_back: Whether it pulls large estimates back (Eq. 28-29).
        uses_friction: Whether its grip depends on the assumed friction; otherwise on
            ``controller.grip_force``.
        reacts_to_slip: Whether its grip increases when a contact slips.
        holds_tips: Whether it holds the positions of its fingertips and closes with a given force.
        is_own: Whether it is a custom law (docs/laws.md).
        stops_slip_with: Keys of the parameters whose larger values end slip sooner.
        learns_with: Keys of the parameters whose larger values make estimates change faster.
        settings: Recommended parameters.
        bounded: Whether physical bounds are recommended for its estimates.
        firm: Whether a ``controller.grip_force`` that supports the object is recommended.
    """

    kind: str
    summary: str
    sampled: bool = False
    learns: bool = read_for(*HANDS)
    has_memory: bool = read_for(*HANDS)
    pulls_back: bool = read_for(*HANDS)
    uses_friction: bool = read_for(*HANDS, default=True)
    reacts_to_slip: bool = read_for(*HANDS)
    holds_tips: bool = read_for(*HANDS)
    is_own: bool = read_for(*HANDS)
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
    def follows_gradient(self) -> bool:
        """Whether its estimates follow a gradient, at ``controller.adaptation_gain``."""
        return self.learns and not self.has_memory

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
            summary="The paper's law for unknown masses and friction; large estimates are pulled "
            "back.",
            learns=True,
            pulls_back=True,
            stops_slip_with=("controller.lyapunov_weight",),
            learns_with=_GRADIENT,
            settings=(_INSIDE_CONES, _EXACT),
        ),
        ControlLaw(
            kind="certainty-equivalence",
            summary="The torque of the paper's laws with the initial estimates, without "
            "adaptation.",
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
            summary="Adaptation by least squares from tracking and prediction errors.",
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
"""Aliases of built-in laws, accepted wherever a law is named; files contain ``kind``."""


def law_kind(name: Any) -> Any:
    """Returns the ``kind`` of an alias; other text is returned unchanged."""
    return LAW_ALIASES.get(name, name) if isinstance(name, str) else name


def law_alias(kind: str) -> str:
    """The alias of a law; its ``kind`` if it has none."""
    return next((alias for alias, known in LAW_ALIASES.items() if known == kind), kind)


def law_label(kind: str) -> str:
    """Label of a law: its alias, if any, and its ``kind``."""
    alias = law_alias(kind)
    return kind if alias == kind else f"{alias} ({kind})"


def facts_read_for(hand: Space) -> tuple[str, ...]:
    """Names of the facts that the kernel of a kind of hand uses."""
    return tuple(each.name for each in fields(ControlLaw) if hand in each.metadata.get("hands", ()))


def is_computed_for(law: ControlLaw, hand: Space) -> bool:
    """Whether the kernel of a kind of hand supports a law: unused facts have their defaults."""
    return all(
        getattr(law, each.name) == each.default
        for each in fields(law)
        if hand not in each.metadata.get("hands", (hand,))
    )
