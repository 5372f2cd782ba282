"""Text about the early end of a run of a body on a support."""

from __future__ import annotations

from slipgrasp.core.kernel.loop.status import (
    CHATTERING,
    EVENT_STALL,
    MAX_STEPS,
    NOT_FINITE,
    STEP_UNDERFLOW,
    STIFF,
)
from slipgrasp.core.scenario import SupportScenario
from slipgrasp.core.trace.types import Reason

_OTHER_TOLERANCE = "change simulation.relative_tolerance a little"
_FEWER_STEPS = "raise simulation.max_steps or lower simulation.duration"


def _explain(status: int, scenario: SupportScenario) -> tuple[str, str]:
    """Description of an early end, and a suggestion.

    Args:
        status: Status of the kernel.
        scenario: The scenario at that time.
    """
    simulation = scenario.simulation
    message = {
        CHATTERING: f"the contact chattered: {simulation.chatter_changes} phase changes within "
        f"{simulation.chatter_window:g} s",
        EVENT_STALL: "stops repeat at one instant without progress in time",
        MAX_STEPS: f"the limit of {simulation.max_steps} steps was reached",
        NOT_FINITE: "a quantity is no longer finite",
        STEP_UNDERFLOW: "no step of the integration is small enough",
        STIFF: "the average step became shorter than 1 nanosecond",
    }[status]
    return message, _FEWER_STEPS if status == MAX_STEPS else _OTHER_TOLERANCE


def reason_of_slide(status: int, code: str, scenario: SupportScenario, t: float) -> Reason:
    """The reason of an early end.

    Args:
        status: Status of the kernel.
        code: Code of the reason.
        scenario: The scenario at that time.
        t: Simulation time [s].
    """
    message, hint = _explain(status, scenario)
    return Reason(
        code=code,
        message=f"{message} at {t:.5g} s",
        contact=None,
        time=t,
        value=None,
        limit=None,
        hint=hint,
    )
