"""Text about the early end of a run of a body on a support or a rail."""

from __future__ import annotations

from slipgrasp.core.kernel.loop.status import (
    CHATTERING,
    EVENT_STALL,
    INCONSISTENT,
    LEFT_FACE,
    MAX_STEPS,
    NOT_FINITE,
    PAINLEVE,
    SEPARATED,
    SINGULAR,
    STEP_UNDERFLOW,
    STIFF,
)
from slipgrasp.core.scenario.scenario import FreeScenario
from slipgrasp.core.trace.types import Reason

_OTHER_TOLERANCE = "change simulation.relative_tolerance a little"
_HINTS = {
    MAX_STEPS: "raise simulation.max_steps or lower simulation.duration",
    SEPARATED: "raise controller.minimum_normal_force, or move less abruptly",
    LEFT_FACE: "raise controller.grip_force, or move less abruptly",
    SINGULAR: "move finger.base",
    INCONSISTENT: "lower the friction",
    PAINLEVE: "lower the friction",
}


def _explain(status: int, scenario: FreeScenario, contact: int) -> tuple[str, str]:
    """Description of an early end, and a suggestion.

    Args:
        status: Status of the kernel.
        scenario: The scenario at that time.
        contact: Contact concerned, -1 if none.
    """
    lifts = "the object lifted off the rail"
    simulation = scenario.simulation
    message = {
        CHATTERING: f"the contact chattered: {simulation.chatter_changes} phase changes within "
        f"{simulation.chatter_window:g} s",
        EVENT_STALL: "stops repeat at one instant without progress in time",
        MAX_STEPS: f"the limit of {simulation.max_steps} steps was reached",
        INCONSISTENT: "no phases of fingertip and rail are consistent",
        LEFT_FACE: "the fingertip slid off its face",
        NOT_FINITE: "a quantity is no longer finite",
        PAINLEVE: "friction prevents a solution for the accelerations (Painlevé's paradox)",
        SEPARATED: lifts if contact > 0 else "the fingertip came off the object",
        SINGULAR: "the finger became straight or folded",
        STEP_UNDERFLOW: "no step of the integration is small enough",
        STIFF: "the equations are too stiff: the average step became too short",
    }[status]
    return message, _HINTS.get(status, _OTHER_TOLERANCE)


def reason_of_slide(
    status: int, code: str, scenario: FreeScenario, t: float, contact: int = -1
) -> Reason:
    """The reason for an early end.

    Args:
        status: Status of the kernel.
        code: Code of the reason.
        scenario: The scenario at that time.
        t: Simulation time [s].
        contact: Contact concerned, -1 if none.
    """
    message, hint = _explain(status, scenario, contact)
    return Reason(
        code=code,
        message=f"{message} at {t:.5g} s",
        contact=contact if status in (SEPARATED, LEFT_FACE, SINGULAR) else None,
        time=t,
        value=None,
        limit=None,
        hint=hint,
    )
