"""Words for the ways in which physics, the law or a limit ends a run (docs/model.md, Outcomes)."""

from __future__ import annotations

import numpy as np

from core.kernel.jump import (
    CHATTERING,
    EVENT_STALL,
    INCONSISTENT,
    LEFT_FACE,
    MAX_STEPS,
    MODEL_SINGULAR,
    NOT_FINITE,
    PAINLEVE,
    SEPARATED,
    SINGULAR,
    STEP_UNDERFLOW,
    STIFF,
)
from core.misbelief import describe_misbelief
from core.scenario import Scenario
from core.trace import Trace
from core.types import Outcome, Reason

__all__ = ["describe_end", "describe_stop", "describe_wall_limit"]

_SINGULAR_ESTIMATE = 1e6
_NO_FORCE = 1e-6


def describe_end(
    status: int, contact: int, scenario: Scenario, last: Trace, t: float
) -> tuple[Outcome, Reason]:
    """Outcome and reason for a status in which the kernel ended.

    Args:
        status: Status of the kernel other than running or reached.
        contact: Contact or finger concerned, -1 if none.
        scenario: Parameters at that time.
        last: Trace of the last row.
        t: Simulation time [s].
    """
    if status == STEP_UNDERFLOW and last.estimated_inertia_condition[0] > _SINGULAR_ESTIMATE:
        status = MODEL_SINGULAR
    outcome, code, hint = _ENDINGS[status]
    message, value, limit = _explain(status, contact, scenario, last)
    message = f"{message} at {t:.5g} s"
    if status in _OF_TORQUES:
        causes = _describe_weakness(scenario, last), describe_misbelief(scenario, last)
        message = "; ".join([message, *filter(None, causes)])
    if scenario.controller.kind == "composite":
        hint = _HINTS_OF_COMPOSITE.get(status, hint)
    reason = Reason(
        code=code,
        message=message,
        contact=contact if contact >= 0 and status in _OF_ONE_CONTACT else None,
        time=t,
        value=value,
        limit=limit,
        hint=hint,
    )
    return outcome, reason


_OF_ONE_CONTACT = (SEPARATED, LEFT_FACE, SINGULAR)
_OF_TORQUES = (
    SEPARATED,
    LEFT_FACE,
    CHATTERING,
    INCONSISTENT,
    MODEL_SINGULAR,
    STEP_UNDERFLOW,
    STIFF,
)

_ENDINGS = {
    SEPARATED: (
        Outcome.SEPARATED,
        "contact_separation",
        "squeeze harder (grip_safety), use the composite law, or start from estimates nearer to "
        "the truth",
    ),
    LEFT_FACE: (
        Outcome.LEFT_FACE,
        "contact_left_face",
        "stop the slip earlier (composite law, higher lyapunov_weight or grip_safety), or use a "
        "longer face",
    ),
    SINGULAR: (
        Outcome.SINGULAR,
        "singular_jacobian",
        "move the base of the finger or choose a trajectory within its reach",
    ),
    CHATTERING: (
        Outcome.CHATTERING,
        "chatter",
        "use grasp_force 'minimum', a grip_safety above 1, or sampled control",
    ),
    INCONSISTENT: (
        Outcome.INCONSISTENT,
        "no_consistent_phase",
        "use sampled control, or change the pose, the friction or the estimates",
    ),
    PAINLEVE: (
        Outcome.DIVERGED,
        "painleve",
        "lower the friction coefficient or change the pose",
    ),
    MODEL_SINGULAR: (
        Outcome.DIVERGED,
        "model_estimate_singular",
        "give the estimates bounds (minimum, maximum), or lower adaptation_gain or lyapunov_weight",
    ),
    STEP_UNDERFLOW: (
        Outcome.DIVERGED,
        "step_underflow",
        "lower the gains, or use sampled control",
    ),
    STIFF: (
        Outcome.DIVERGED,
        "stiff_loop",
        "lower the gains, or use sampled control",
    ),
    NOT_FINITE: (
        Outcome.DIVERGED,
        "nonfinite_state",
        "lower the gains, or give the estimates bounds (minimum, maximum)",
    ),
    MAX_STEPS: (
        Outcome.LIMIT,
        "max_steps",
        "raise simulation.max_steps or shorten the run",
    ),
    EVENT_STALL: (
        Outcome.LIMIT,
        "event_stall",
        "change a tolerance of the integration a little, or use sampled control",
    ),
}

# What to try where the law is already the one that others are told to use.
_HINTS_OF_COMPOSITE = {
    SEPARATED: "squeeze harder (grip_safety), or start from estimates nearer to the truth",
    LEFT_FACE: (
        "stop the slip earlier (higher slip_stop or grip_safety, estimates nearer to the truth), "
        "or use a longer face"
    ),
}


def _describe_weakness(scenario: Scenario, last: Trace) -> str:
    """That a joint cannot give more; empty if all can."""
    limit = scenario.actuation.torque_limit
    if limit is None or np.abs(last.joint_torque[0]).max() < limit:
        return ""
    return f"a joint gave all that its torque_limit allows, {limit:g} N m"


def _explain(
    status: int, contact: int, scenario: Scenario, last: Trace
) -> tuple[str, float | None, float | None]:
    """Message, offending value and its limit."""
    simulation = scenario.simulation
    if status == SEPARATED:
        return _explain_separation(contact, scenario, last)
    if status == LEFT_FACE:
        slip = float(last.slip[0, contact])
        return (
            f"the {scenario.finger_names[contact]} fingertip slid off the end of its face",
            slip,
            abs(slip),
        )
    if status == SINGULAR:
        angle = float(last.joint_position[0, 2 * contact + 1])
        return f"the {scenario.finger_names[contact]} finger became straight or folded", angle, 0.0
    if status == CHATTERING:
        changes, window = simulation.chatter_changes, _chatter_window(scenario)
        return (
            f"the contacts chattered: {changes} phase changes within {window:g} s",
            float(changes),
            float(changes),
        )
    if status == INCONSISTENT:
        return "no combination of stick and slip is consistent with the torque", None, None
    if status == PAINLEVE:
        return (
            "the reduced inertia is singular: friction is too high for this pose (Painleve)",
            None,
            0.0,
        )
    if status == MODEL_SINGULAR:
        value = float(last.estimated_inertia_condition[0])
        return "the controller's estimate of the reduced inertia became singular", value, None
    if status == STIFF:
        value = float(last.estimated_inertia_condition[0])
        return (
            "the closed loop is too stiff to follow: its steps became shorter than 1 microsecond "
            "on the average, where the controller's estimate of the reduced inertia has the "
            f"condition number {value:.2g},",
            value,
            None,
        )
    if status == NOT_FINITE:
        return "the closed loop diverges: a quantity is not finite any more", None, None
    if status == EVENT_STALL:
        return "one instant repeats its events without progress in time", None, None
    if status == MAX_STEPS:
        return (
            f"the limit of {simulation.max_steps} steps was reached",
            float(simulation.max_steps),
            float(simulation.max_steps),
        )
    return "no step of the integration is small enough: the closed loop diverges", None, None


def _chatter_window(scenario: Scenario) -> float:
    """In which time phase changes are counted [s]: with sampled control in one period at most."""
    window, period = scenario.simulation.chatter_window, scenario.controller.control_period
    return min(window, period) if period > 0.0 else window


def _explain_separation(
    contact: int, scenario: Scenario, last: Trace
) -> tuple[str, float | None, float | None]:
    """A normal force that falls to zero, or one that would have to pull after a torque jump."""
    force = float(last.normal_force[0, contact]) if contact >= 0 else 0.0
    name = f"the {scenario.finger_names[contact]} fingertip" if contact >= 0 else "a fingertip"
    if force > _NO_FORCE:
        message = f"{name} separated from the object: under the torque it can only leave it"
        return message, None, 0.0
    message = f"{name} separated from the object: its normal force fell to zero"
    return message, force, 0.0


def describe_stop(t: float) -> Reason:
    """The reason of a run that somebody stopped at ``t`` [s]."""
    return Reason(
        code="stopped",
        message=f"stopped on request at {t:.4g} s",
        contact=None,
        time=t,
        value=None,
        limit=None,
        hint="run it again to see the rest",
    )


def describe_wall_limit(t: float, wall_limit: float) -> Reason:
    """The reason of a run that reached its limit of computing time [s] at ``t`` [s]."""
    return Reason(
        code="wall_time",
        message=f"the computing time limit of {wall_limit:g} s was reached at {t:.4g} s",
        contact=None,
        time=t,
        value=None,
        limit=wall_limit,
        hint="shorten the run, or raise the limit",
    )
