"""A run as text for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.trying import TriedHint
from slipgrasp.core.run.verdict import describe_run, title_of
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.core.scenario.scenario import FreeScenario
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.phrases import sentence

LABEL_WIDTH = 16


def summarize(result: RunResult, recording: Path | None, tried: TriedHint | None = None) -> str:
    """Name, outcome, slip, errors, estimates and true values, and the file of the recording.

    Args:
        result: The run.
        recording: Its file; None if it could not be written.
        tried: The hint after its suggestions were tried; None if they were not.
    """
    lines = [
        result.name,
        *_title(result),
        "",
        *_sentences(result, tried),
        "",
        *_contacts(result),
        *_errors(result),
        *_estimates(result),
        *_warnings(result),
        _line("recording", "not saved" if recording is None else str(recording)),
    ]
    return "\n".join(lines)


def _title(result: RunResult) -> list[str]:
    """The title, unless the name begins with it, as for a scenario that is not a preset."""
    title = title_of(result)
    return [title] if title and not result.name.startswith(title) else []


def _sentences(result: RunResult, tried: TriedHint | None) -> Iterator[str]:
    """The outcome in the words of the dashboard."""
    words, end = describe_run(result), f"at {result.end_time:.4g} s"
    completed = result.outcome is Outcome.COMPLETED
    is_off = result.outcome is Outcome.LEFT_FACE
    word = "a fingertip left its face" if is_off else result.outcome.value.replace("_", " ")
    yield f"Completed {end}." if completed else f"Ended early {end}: {word}."
    yield f"{words.headline}. {' '.join(words.sentences)}"
    if tried is None or not tried.count:
        yield from [f"What to try: {words.suggestion}"] * bool(words.suggestion)
    elif tried.helpful:
        yield f"What to try: {sentence(str(tried))}"
    else:
        yield f"What was tried: {sentence(str(tried))}"


def _contacts(result: RunResult) -> Iterator[str]:
    metrics = result.metrics
    for i, name in enumerate(_contact_names(result.scenario)):
        changes = sum(change.contact == i for change in result.phase_changes)
        margin = metrics.minimum_friction_margin[i]
        # A contact that begins to slip has no margin, except for rounding.
        least = None if margin is None else round(margin, 6) + 0.0
        reserve = (
            "never in stick"
            if least is None
            else f"in stick at least {least:.3g} N inside the cone"
        )
        turned = f", turned {_thousandths(metrics.spin_path[i])} mrad" if metrics.spin_path else ""
        yield _line(
            name,
            f"slipped {_millimetres(metrics.slip_path[i])}{turned}, {changes} phase "
            f"change{'' if changes == 1 else 's'}, "
            f"up to {metrics.peak_normal_force[i]:.4g} N normal force, {reserve}",
        )


def _contact_names(scenario: Scenario) -> list[str]:
    if isinstance(scenario, FreeScenario):
        return [*scenario.finger_names]
    return [f"contact {i} {finger.face}" for i, finger in enumerate(scenario.fingers)]


def _errors(result: RunResult) -> Iterator[str]:
    if not result.scenario.space.has_control:
        return
    yield _line("error at the end", _pose(result.metrics.final_tracking_error))
    yield _line("error rms", _pose(result.metrics.rms_tracking_error))


def _pose(error: Sequence[float]) -> str:
    if len(error) > 3:
        ways, turns = zip("xyz", error[:3], strict=True), zip("xyz", error[3:], strict=True)
        said = [f"{axis} {_millimetres(value)}" for axis, value in ways]
        said += [f"turn {axis} {_thousandths(value)} mrad" for axis, value in turns]
        return ", ".join(said)
    if len(error) == 1:
        return f"x {_millimetres(error[0])}"
    x, y, theta = error
    return f"x {_millimetres(x)}, y {_millimetres(y)}, theta {_thousandths(theta)} mrad"


def _estimates(result: RunResult) -> Iterator[str]:
    definitions = parameter_definitions(result.scenario)
    truth = result.trace.true_parameters[-1].tolist()
    for (key, estimate), true in zip(result.estimates.items(), truth, strict=True):
        unit = definitions[key].unit
        shown = "" if unit == "1" else f" {unit}"
        yield _line("estimate", f"{key} {estimate:.4g}{shown}, true value {true:.4g}{shown}")


def _warnings(result: RunResult) -> Iterator[str]:
    for warning in result.warnings:
        times = "once" if warning.count == 1 else f"{warning.count} times"
        yield _line("warning", f"{warning.message} ({times}, first at {warning.first_time:.4g} s)")


def _line(label: str, text: str) -> str:
    return f"{label:{LABEL_WIDTH}}  {text}"


def _millimetres(length: float) -> str:
    return f"{_thousandths(length)} mm"


def _thousandths(value: float) -> str:
    """Formats with four digits; values below a millionth of a digit are rounding errors."""
    return f"{round(1e3 * value, 6) + 0.0:.4g}"
