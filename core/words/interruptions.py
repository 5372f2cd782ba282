"""Why a run ended early for a reason outside the model: somebody, its law, its process, or time."""

from __future__ import annotations

from slipgrasp.core.trace.types import Reason


def describe_stop(t: float) -> Reason:
    """The reason of a run that somebody stopped at ``t`` [s]."""
    message = f"stopped on request at {t:.4g} s"
    return _interruption("stopped", message, t, "run it again to see the rest")


def describe_law_failure(kind: str, found: str, t: float) -> Reason:
    """The reason of a run whose law gave no answer at ``t`` [s].

    Args:
        kind: Name of the law.
        found: What was wrong, with the line of its code where that is known.
        t: When.
    """
    message = f"the law '{kind}' failed at {t:.5g} s: {found}"
    hint = "mend the law; what was simulated until then is kept"
    return _interruption("law_failed", message, t, hint)


def describe_wall_limit(t: float, wall_limit: float) -> Reason:
    """The reason of a run that reached its limit of computing time [s] at ``t`` [s]."""
    message = f"the computing time limit of {wall_limit:g} s was reached at {t:.4g} s"
    hint = "shorten the run, or raise the limit"
    return _interruption("wall_time", message, t, hint, limit=wall_limit)


def describe_worker_death(told: str) -> Reason:
    """The reason of a run whose worker process ended before it.

    Args:
        told: How the process ended, a sentence.
    """
    return _interruption(
        "worker_died", told, 0.0, "simulate it alone and look at its memory and time"
    )


def describe_cut_off(t: float) -> Reason:
    """The reason of a run of whose recording nothing can be read beyond ``t`` [s]."""
    message = f"the program that simulated it ended, or its file was damaged, after {t:.5g} s"
    return _interruption("worker_died", message, t, "simulate its scenario again")


def describe_disk_failure(error: Exception, t: float) -> Reason:
    """The reason of a run whose recording could not be written on at ``t`` [s]."""
    message = f"the recording could not be written on at {t:.5g} s: {error}"
    hint = "free space on the disk; 'slipgrasp recover' keeps what was written until then"
    return _interruption("disk", message, t, hint)


def describe_damage(finding: str) -> Reason:
    """The reason of a run whose recording cannot be read.

    Args:
        finding: What is wrong with it, a sentence.
    """
    return _interruption("damaged_recording", finding, 0.0, "simulate the scenario again")


def _interruption(
    code: str, message: str, t: float, hint: str, limit: float | None = None
) -> Reason:
    """A reason that no contact and no quantity of the model has part in."""
    return Reason(
        code=code, message=message, contact=None, time=t, value=None, limit=limit, hint=hint
    )
