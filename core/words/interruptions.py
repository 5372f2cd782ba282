"""Why a run ended early for a reason outside the model: somebody, its law, its process, or time."""

from __future__ import annotations

from slipgrasp.core.trace.types import Reason


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


def describe_law_failure(kind: str, found: str, t: float) -> Reason:
    """The reason of a run whose law gave no answer at ``t`` [s].

    Args:
        kind: Name of the law.
        found: What was wrong, with the line of its code where that is known.
        t: When.
    """
    return Reason(
        code="law_failed",
        message=f"the law '{kind}' failed at {t:.5g} s: {found}",
        contact=None,
        time=t,
        value=None,
        limit=None,
        hint="mend the law; what was simulated until then is kept",
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


def describe_worker_death(told: str) -> Reason:
    """The reason of a run whose worker process ended before it.

    Args:
        told: How the process ended, a sentence.
    """
    return Reason(
        code="worker_died",
        message=told,
        contact=None,
        time=0.0,
        value=None,
        limit=None,
        hint="simulate it alone and look at its memory and time",
    )
