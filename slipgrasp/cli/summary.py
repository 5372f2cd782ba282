"""A run in words, for a person at a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from core.loading import parameter_definitions
from core.result import RunResult
from core.types import Outcome

__all__ = ["summarize"]

LABEL_WIDTH = 16


def summarize(result: RunResult, recording: Path | None) -> str:
    """Name, outcome, slip, errors, estimates against the truth, and where the recording is.

    Args:
        result: The run.
        recording: Its file; None if it could not be written.
    """
    lines = [
        result.name,
        "",
        _outcome(result),
        *_reason(result),
        "",
        *_contacts(result),
        *_errors(result),
        *_estimates(result),
        *_warnings(result),
        _line("recording", "not saved" if recording is None else str(recording)),
    ]
    return "\n".join(lines)


def _outcome(result: RunResult) -> str:
    metrics = result.metrics
    end = f"at {result.end_time:.4g} s"
    if result.outcome is not Outcome.COMPLETED:
        return f"Ended early {end}: {result.outcome.value.replace('_', ' ')}."
    if metrics.slipping_at_end:
        return f"Completed {end}: the object still slips."
    if metrics.last_slip_time is None:
        return f"Completed {end}: the object was held all the time and never slipped."
    stopped = f"the last slip ended at {metrics.last_slip_time:.4g} s"
    held = "the object is held" if metrics.held else "the object has only just stopped slipping"
    return f"Completed {end}: {held}; {stopped}."


def _reason(result: RunResult) -> list[str]:
    if result.reason is None:
        return []
    message = result.reason.message
    return [f"{message[:1].upper()}{message[1:]}. What to try: {result.reason.hint}."]


def _contacts(result: RunResult) -> Iterator[str]:
    metrics = result.metrics
    for i, finger in enumerate(result.scenario.fingers):
        changes = sum(change.contact == i for change in result.phase_changes)
        margin = metrics.minimum_friction_margin[i]
        reserve = "never in stick" if margin is None else f"at least {margin:.3g} N inside the cone"
        yield _line(
            f"contact {i} {finger.face}",
            f"slipped {_millimetres(metrics.slip_path[i])}, {changes} phase changes, "
            f"up to {metrics.peak_normal_force[i]:.4g} N normal force, {reserve}",
        )


def _errors(result: RunResult) -> Iterator[str]:
    yield _line("error at the end", _pose(result.metrics.final_tracking_error))
    yield _line("error rms", _pose(result.metrics.rms_tracking_error))


def _pose(error: Sequence[float]) -> str:
    x, y, theta = error
    return f"x {_millimetres(x)}, y {_millimetres(y)}, theta {theta * 1e3:.4g} mrad"


def _estimates(result: RunResult) -> Iterator[str]:
    definitions = parameter_definitions(result.scenario)
    truth = result.trace.true_parameters[-1].tolist()
    for (key, estimate), true in zip(result.estimates.items(), truth, strict=True):
        unit = definitions[key].unit
        shown = "" if unit == "1" else f" {unit}"
        yield _line("estimate", f"{key} {estimate:.4g}{shown}, in truth {true:.4g}{shown}")


def _warnings(result: RunResult) -> Iterator[str]:
    for warning in result.warnings:
        times = "once" if warning.count == 1 else f"{warning.count} times"
        yield _line("warning", f"{warning.message} ({times}, first at {warning.first_time:.4g} s)")


def _line(label: str, text: str) -> str:
    return f"{label:{LABEL_WIDTH}}  {text}"


def _millimetres(length: float) -> str:
    return f"{length * 1e3:.4g} mm"
