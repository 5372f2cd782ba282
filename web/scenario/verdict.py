"""How a run went, in words: held or not, why, who slipped, how hard it squeezed, what to try."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from core.result import RunResult
from core.types import ContactPhase, Outcome
from web.words import joined, milliseconds, sentence

__all__ = ["Verdict", "describe_outcome"]

Tone = Literal["good", "warning", "bad"]

_HEADLINES = {
    Outcome.SEPARATED: "Dropped: a contact came apart",
    Outcome.LEFT_FACE: "Lost: a fingertip slid off its face",
    Outcome.SINGULAR: "Ended: a finger ran out of reach",
    Outcome.CHATTERING: "Never settles: stick and slip alternate without end",
    Outcome.INCONSISTENT: "Ended: no phase of the contacts is consistent",
    Outcome.DIVERGED: "Ended: the numbers ran away",
    Outcome.LIMIT: "Cut short: the run reached a limit",
    Outcome.STOPPED: "Stopped",
    Outcome.FAILED: "Failed",
    Outcome.RECOVERED: "Recovered from an unfinished recording",
}

_SAFE_GRIP = 1.2
_LEAST_FORCE = 1e-3
# What a law has to stop a slip with, to hold with, and to learn with, where it is not the usual.
_KNOBS = {
    "pd-gravity": "the grip force",
    "grip-reflex": "the grip force or the grip rate",
    "composite": "the slip stop or the grip safety",
    "certainty-equivalence": "the grip safety",
}
_GRIPS = {"pd-gravity": "the grip force", "grip-reflex": "the grip force"}
_LEARNERS = {"composite": "the slip stop", "certainty-equivalence": "the control law"}


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a run went.

    Attributes:
        tone: Whether that is good news.
        headline: It in a few words.
        sentences: What happened.
        suggestion: What to try next.
    """

    tone: Tone
    headline: str
    sentences: tuple[str, ...]
    suggestion: str = ""


def describe_outcome(result: RunResult) -> Verdict:
    """Says in words how a run ended, what slipped, and what to try."""
    tone, headline = _headline(result)
    reason = result.reason
    cause = (sentence(reason.message),) if reason is not None and reason.message else ()
    facts = (_describe_slips(result), *_describe_belief(result), *_describe_squeeze(result))
    return Verdict(tone, headline, (*cause, *facts), _suggest(result))


def _headline(result: RunResult) -> tuple[Tone, str]:
    if result.outcome is not Outcome.COMPLETED:
        return "bad", _HEADLINES[result.outcome]
    if result.metrics.held:
        return "good", "Held"
    if result.metrics.slipping_at_end:
        return "warning", "Not held: still slipping at the end"
    return "warning", "Not settled: it slipped in the last half second"


def _describe_slips(result: RunResult) -> str:
    """Who slipped how far, and until when; else how near it came to that."""
    names, paths = result.scenario.finger_names, result.metrics.slip_path
    slipped = [i for i, path in enumerate(paths) if path > 0.0]
    if not slipped:
        return f"No fingertip slipped{_describe_least_margin(result)}."
    lengths = joined([f"{1e3 * paths[i]:.3g} mm {names[i]}" for i in slipped])
    who = _fingertips([names[i] for i in slipped], len(names))
    return f"{who} slipped, {lengths}{_describe_end_of_slip(result)}."


def _fingertips(names: Sequence[str], total: int) -> str:
    """Some of the fingertips, as the subject of a sentence."""
    if len(names) == 1:
        return f"The {names[0]} fingertip"
    if len(names) == total:
        return "Both fingertips" if total == 2 else "All fingertips"
    return f"The {joined(names)} fingertips"


def _describe_end_of_slip(result: RunResult) -> str:
    last = result.metrics.last_slip_time
    if last is None or result.metrics.slipping_at_end:
        return ""
    return f", and stopped at t = {milliseconds(last)}"


def _describe_least_margin(result: RunResult) -> str:
    """How much more tangential force would have made a fingertip slip, where and when."""
    margins = [
        (margin, contact)
        for contact, margin in enumerate(result.metrics.minimum_friction_margin)
        if margin is not None
    ]
    if not margins:
        return ""
    least, contact = min(margins)
    trace = result.trace
    # In the first row the forces of the first control update do not act yet.
    row = 1 + int(np.argmin(trace.friction_margin[1:, contact]))
    where = result.scenario.finger_names[contact]
    when = milliseconds(float(trace.times[row]))
    return f"; the least margin was {least:.2g} N, {where} at t = {when}"


def _describe_belief(result: RunResult) -> Iterator[str]:
    """Where the controller began with more friction than there is, and that let it slip."""
    found = _overestimated_friction(result)
    if found is not None:
        believed, true = found
        yield (
            f"The controller began by believing in friction {believed:.3g} where there is "
            f"{true:.3g}, so it squeezed too little."
        )


def _overestimated_friction(result: RunResult) -> tuple[float, float] | None:
    """The first belief about friction and its true value, of a fingertip that slipped by it."""
    for i, finger in enumerate(result.scenario.fingers):
        for estimate in result.scenario.estimates:
            is_its_own = estimate.parameter == f"fingers.{i}.friction"
            slipped = result.metrics.slip_path[i] > 0.0
            if is_its_own and slipped and estimate.initial > finger.friction:
                return estimate.initial, finger.friction
    return None


def _describe_squeeze(result: RunResult) -> Iterator[str]:
    """How hard the tightest contact squeezes at the end, against the least that holds."""
    trace = result.trace
    friction, normal = trace.friction_coefficient[-1], trace.normal_force[-1]
    tangential = np.abs(trace.tangential_force[-1])
    sticks = (trace.phase[-1] == ContactPhase.STICK).all() and (friction > 0.0).all()
    if result.outcome is not Outcome.COMPLETED or not sticks or tangential.max() < _LEAST_FORCE:
        return
    needed = tangential / np.where(friction > 0.0, friction, 1.0)
    i = int(np.argmin(normal - needed))
    yield (
        f"At the end it squeezes with {normal[i]:.1f} N; {needed[i]:.1f} N would just hold the "
        "object still."
    )


def _suggest(result: RunResult) -> str:
    """What to try next, from what happened."""
    if result.reason is not None and result.reason.hint:
        return sentence(result.reason.hint)
    controller = result.scenario.controller
    knobs = _KNOBS.get(controller.kind, "the lyapunov weight (Q) or the grip safety")
    if result.metrics.slipping_at_end:
        return f"Raise {knobs}, to stop the slip earlier."
    if not any(path > 0.0 for path in result.metrics.slip_path):
        grip = _GRIPS.get(controller.kind, "the grip safety")
        return f"Lower the friction or {grip} until a fingertip slips."
    if controller.kind in _GRIPS:
        return f"Raise {knobs}, and see the slip change."
    found = _overestimated_friction(result)
    if found is not None:
        return (
            f"Let the controller believe in friction below {found[1]:.3g} at first, or change "
            f"{_LEARNERS.get(controller.kind, 'the lyapunov weight (Q)')}, and see the slip change."
        )
    if controller.grip_safety < _SAFE_GRIP and controller.grasp_force == "minimum":
        return (
            f"Raise the grip safety above {controller.grip_safety:g}: then the commanded force "
            "stays inside the friction cones."
        )
    return "Compare the estimates with the truth: a wrong mass lets the squeeze be too weak."
