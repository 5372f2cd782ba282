"""Reasons outside the model for an early end: the user, the law, the process or a time limit."""

from __future__ import annotations

from slipgrasp.core.trace.types import Reason


def describe_stop(t: float) -> Reason:
    """Reason for the end of a run that a user stopped at ``t`` [s]."""
    message = f"stopped on request at {t:.4g} s"
    return _interruption("stopped", message, t, "run it again to see the rest")


def describe_law_failure(kind: str, found: str, t: float) -> Reason:
    """Reason for the end of a run whose law returned no valid command at ``t`` [s].

    Args:
        kind: Name of the law.
        found: Description of the error, with the line of code if known.
        t: Time [s].
    """
    message = f"the law '{kind}' failed at {t:.5g} s: {found}"
    hint = "correct the law; the run up to this time is stored"
    return _interruption("law_failed", message, t, hint)


def describe_wall_limit(t: float, wall_limit: float) -> Reason:
    """Reason for the end of a run that reached its limit of elapsed time [s] at ``t`` [s]."""
    message = f"the limit of {wall_limit:g} s of elapsed time was reached at {t:.4g} s"
    hint = "shorten the run, or raise the limit"
    return _interruption("wall_time", message, t, hint, limit=wall_limit)


def describe_worker_death(told: str) -> Reason:
    """Reason for the end of a run whose worker process died.

    Args:
        told: Description of the death, a sentence.
    """
    return _interruption(
        "worker_died", told, 0.0, "simulate it alone and check its memory and time"
    )


def describe_cut_off(t: float) -> Reason:
    """Reason for the end of a run whose recording cannot be read beyond ``t`` [s]."""
    message = f"the program that simulated it ended, or its file was damaged, after {t:.5g} s"
    return _interruption("worker_died", message, t, "simulate its scenario again")


def describe_disk_failure(error: Exception, t: float) -> Reason:
    """Reason for the end of a run whose recording could not be continued at ``t`` [s]."""
    message = f"the recording could not be continued at {t:.5g} s: {error}"
    hint = "free space on the disk; 'slipgrasp recover' recovers the recorded part"
    return _interruption("disk", message, t, hint)


def describe_damage(finding: str) -> Reason:
    """Reason for the end of a run whose recording cannot be read.

    Args:
        finding: Description of the damage, a sentence.
    """
    return _interruption("damaged_recording", finding, 0.0, "simulate the scenario again")


def _interruption(
    code: str, message: str, t: float, hint: str, limit: float | None = None
) -> Reason:
    """A reason without a contact or a quantity of the model."""
    return Reason(
        code=code, message=message, contact=None, time=t, value=None, limit=limit, hint=hint
    )
