"""Outcome of a run as text: held or not, cause, slipping contacts, grip force, hints.

The command line, the figures and the dashboard use the same text.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal, NamedTuple

import numpy as np

from slipgrasp.core.run.metrics import HOLD_WINDOW
from slipgrasp.core.run.result import RunResult, RunSummary
from slipgrasp.core.run.slide_outcome import (
    describe_motion,
    describe_slide,
    headline_of_slide,
    slows_down,
)
from slipgrasp.core.run.slip_sentences import (
    describe_causes,
    describe_first_force,
    describe_grip_force,
    describe_slips,
)
from slipgrasp.core.scenario import FingerParameters, ObjectParameters, Scenario
from slipgrasp.core.scenario.custom_laws import law_of
from slipgrasp.core.scenario.loading import all_preset_names, load_scenario
from slipgrasp.core.scenario.scenario import of_hand
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialObject
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, Reason
from slipgrasp.core.words.cures import come_nearer, hold, leave_the_cones, slip_less
from slipgrasp.core.words.endings import describe_circumstances, hint_for
from slipgrasp.core.words.hints import Goal, Hint, Situation, any_of, scenario_at
from slipgrasp.core.words.knowledge_words import describe_knowledge
from slipgrasp.core.words.misbelief import describe_misbelief
from slipgrasp.core.words.options import Option, believe_in_less, only_words, raise_
from slipgrasp.core.words.phrases import length_words, milliseconds, sentence
from slipgrasp.core.words.placement import (
    describe_lasting_error,
    describe_offset,
    is_far_off,
    is_large,
)

Tone = Literal["good", "warning", "bad"]

_ENDED_EARLY = {
    Outcome.SEPARATED: "Lost: a fingertip came off the object",
    Outcome.LEFT_FACE: "Lost: a fingertip slid off its face",
    Outcome.SINGULAR: "Ended: a finger became straight or folded",
    Outcome.CHATTERING: "Chatters between stick and slip",
    Outcome.INCONSISTENT: "Ended: no phase of the contacts is consistent",
    Outcome.DIVERGED: "Ended: the motion cannot be computed any further",
    Outcome.LIMIT: "Cut short: a limit was reached",
    Outcome.STOPPED: "Stopped",
    Outcome.FAILED: "Failed",
    Outcome.RECOVERED: "Recovered from an unfinished recording",
}

_NO_TORQUE = "Ended: the control law can no longer compute torques"
# By the code of the reason.
_ENDED_BY = {
    "joint_limit": "Ended: a joint reached its limit",
    "model_estimate_singular": _NO_TORQUE,
    "nonfinite_torque": _NO_TORQUE,
}

_HELD = "Held"  # with little slip, and close to its target
_ROUNDING = 1e-6
_NO_WAY = 1e-15  # [m]
_MOST = 0.5
_SWITCHINGS = 100  # of one contact, per run and per second
_WATCHED = 0.2  # [s]
_LITTLE_SLIP = 1e-4  # [m]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Outcome of a run as text.

    Attributes:
        tone: ``good``: held, with little slip and near its target; ``bad``: ended early;
            ``warning``: anything else.
        headline: Short form of the outcome.
        sentences: Description.
        hint: Suggestion.
    """

    tone: Tone
    headline: str
    sentences: tuple[str, ...]
    hint: Hint

    @property
    def suggestion(self) -> str:
        """The hint as a sentence, with parameters by their dotted keys."""
        return sentence(str(self.hint))


def describe_run(result: RunResult) -> Verdict:
    """Describes how a run ended, which contacts slipped, and what to try."""
    if not result.scenario.space.has_hand:
        return _describe_slide(result)
    reason, found = result.reason, _find_overestimates(result)
    cause = [sentence(_describe_reason(result, reason))] if reason and reason.message else []
    estimates = map(_describe_estimate, found[:1]) if found else _describe_other_estimate(result)
    facts = (
        describe_slips(result),
        *describe_causes(result),
        *estimates,
        *_describe_lasting_error(result),
        *_describe_switching(result),
        *_describe_pyramid(result),
        *describe_grip_force(result),
        describe_knowledge(result.scenario),
    )
    return Verdict(_tone(result), headline_of(result), (*cause, *facts), _suggest(result, found))


def _describe_slide(result: RunResult) -> Verdict:
    """Describes a run on a support or a rail; suggests a longer run if a body slows down."""
    reason = result.reason
    cause = [sentence(reason.message)] if reason and reason.message else []
    has_control = result.scenario.space.has_control
    slides = result.metrics.slipping_at_end and not (has_control or reason)
    longer = slides and slows_down(result.trace)
    options = raise_(result.scenario, "simulation.duration") if longer else ()
    hint = Hint((Option(reason.hint),)) if reason and reason.hint else Hint((*options,))
    completed = result.outcome is Outcome.COMPLETED
    rests = "good" if not result.metrics.slipping_at_end else "warning"
    if has_control:
        sentences = (*cause, *describe_motion(result.metrics, result.trace))
    else:
        sentences = (*cause, *describe_slide(result.trace, result.metrics))
    return Verdict(rests if completed else "bad", headline_of(result), sentences, hint)


def _describe_reason(result: RunResult, reason: Reason) -> str:
    """The reason for an early end, with possible causes in delays and the law."""
    start = of_hand(result.scenario)
    present = of_hand(scenario_at(start, result.end_time))
    more = describe_circumstances(reason, start, present, result.trace[-1:])
    return "; ".join([reason.message, *more])


def headline_of(run: RunResult | RunSummary) -> str:
    """The outcome in a few words."""
    metrics = run.metrics
    if run.outcome is not Outcome.COMPLETED:
        return headline_of_end(run.outcome, run.reason.code if run.reason else "")
    if not run.scenario.space.has_hand:
        return headline_of_slide(run.scenario, metrics)
    if metrics.held:
        body = _body_at_end(run)
        slipped = max(metrics.slip_path)
        after = f" after {length_words(slipped)} of slip" if is_large(body, slipped) else ""
        offset = describe_offset(body, metrics.final_tracking_error)
        return f"{_HELD}{after}, {offset}" if offset else f"{_HELD}{after}"
    return headline_of_hold(metrics.held, slipping=metrics.slipping_at_end)


def headline_of_hold(held: bool | None, *, slipping: bool) -> str:
    """Whether a completed run holds the object, in a few words.

    Args:
        held: The metric of this name; None if the run is too short to decide.
        slipping: Whether a contact slips at the end.
    """
    if held:
        return _HELD
    if held is None:
        return f"At rest, but too short to tell: held means {HOLD_WINDOW:g} s without slip"
    if slipping:
        return "Not held: still slipping at the end"
    return "Not settled: it has only just stopped slipping"


def headline_of_end(outcome: Outcome, code: str) -> str:
    """The outcome of a run that ended early, in a few words.

    Args:
        outcome: Its outcome.
        code: Code of its reason; empty if there is none.
    """
    return _ENDED_BY.get(code, _ENDED_EARLY[outcome])


def title_of(run: RunResult | RunSummary) -> str:
    """Title of a run: its `scenario_title`; empty for a preset that did not complete."""
    is_preset = run.scenario.title in _presets_by_title()
    return scenario_title(run.scenario) if run.outcome is Outcome.COMPLETED or not is_preset else ""


def scenario_title(scenario: Scenario) -> str:
    """Title of a scenario; empty for a scenario that differs from the preset with this title.

    The title of a preset describes its outcome, which modified scenarios may not have.
    """
    return scenario.title if _presets_by_title().get(scenario.title, scenario) == scenario else ""


@cache
def _presets_by_title() -> dict[str, Scenario]:
    return {scenario.title: scenario for scenario in map(load_scenario, all_preset_names())}


def _tone(result: RunResult) -> Tone:
    if result.outcome is not Outcome.COMPLETED:
        return "bad"
    return "good" if headline_of(result) == _HELD else "warning"


def _describe_pyramid(result: RunResult) -> Iterator[str]:
    """Limitation of a run with the friction pyramid of the paper."""
    if result.scenario.friction_cone == "pyramid":
        yield (
            "Friction is the paper's pyramid: a fingertip that slips along one tangent of its face "
            "still sticks along the other. This hides how far it would drift aside on the cone "
            "(Coulomb's law), and whether the object would still be held."
        )


def _describe_switching(result: RunResult) -> Iterator[str]:
    """Frequent switching between stick and slip, with the cause if known."""
    count, contacts = result.metrics.phase_change_count, len(result.scenario.fingers)
    if count < _SWITCHINGS * contacts or count < _SWITCHINGS * contacts * result.end_time:
        return
    start = of_hand(result.scenario)
    last = of_hand(scenario_at(start, result.end_time))
    at_end = Situation(start=start, scenario=last, last=result.trace[-1:])
    why = (
        ": with controller.grip_safety 1 the commanded forces lie on the edges of their cones, "
        "where every small error lets a contact slip"
    )
    yield (
        f"The contacts switched between stick and slip {count} times"
        f"{why * any(True for _ in leave_the_cones(at_end))}."
    )


def _describe_lasting_error(result: RunResult) -> Iterator[str]:
    """Distance of a held object from its target, unless the headline contains it."""
    words = _lasting_error(result)
    if words and not describe_offset(_body_at_end(result), result.metrics.final_tracking_error):
        yield f"At the end the object is {words} from its target, and is hardly getting closer."


def _lasting_error(result: RunResult) -> str:
    """Distance of a held object from its target; empty if small or decreasing."""
    if not result.metrics.held:
        return ""
    trace = result.trace
    earlier = trace.tracking_error[np.searchsorted(trace.times, result.end_time - _WATCHED)]
    return describe_lasting_error(result.metrics.final_tracking_error, earlier.tolist())


def _body_at_end(run: RunResult | RunSummary) -> ObjectParameters | SpatialObject:
    return of_hand(scenario_at(run.scenario, run.end_time)).object


class _Overestimate(NamedTuple):
    """An estimate of friction that was too large at the onset of slip.

    Attributes:
        finger: Name of the finger.
        is_alone: Whether other fingers have another friction.
        share: Fraction of the total slip up to the next stick, 0 to 1.
        estimate: Index of the estimate.
        time: Onset of the slip [s].
        estimated: Estimated friction.
        true: True friction.
    """

    finger: str
    is_alone: bool
    share: float
    estimate: int
    time: float
    estimated: float
    true: float


def _find_overestimates(result: RunResult) -> list[_Overestimate]:
    """First slips that were caused by an overestimated friction, in order.

    Of simultaneous ones, the largest overestimate is first.
    """
    onsets = (_overestimate_at_onset(result, k) for k in range(len(result.scenario.estimates)))
    return sorted(
        (found for found in onsets if found),
        key=lambda found: (found.time, found.true / found.estimated),
    )


def _overestimate_at_onset(result: RunResult, index: int) -> _Overestimate | None:
    """The overestimate of friction at the first slip of a contact, if any."""
    scenario, trace = result.scenario, result.trace
    keys = [f"fingers.{i}.friction" for i in range(len(scenario.fingers))]
    key = scenario.estimates[index].parameter
    rows = np.flatnonzero(trace.phase[:, keys.index(key)]) if key in keys else []
    if len(rows) == 0 or rows[0] == 0:
        return None
    contact, row = keys.index(key), int(rows[0])
    time = float(trace.times[row])
    present = of_hand(scenario_at(scenario, time + _ROUNDING))
    controller = present.controller
    if not law_of(controller.kind).uses_friction or controller.grasp_force != "minimum":
        return None
    estimated = float(trace.estimates[row - 1, index])
    true = float(trace.friction_coefficient[row, contact])
    sticking = true * _static_over_kinetic(present.fingers[contact])
    most = controller.maximum_normal_force
    is_bounded = most is not None and trace.normal_force[row, contact] >= most * (1.0 - _ROUNDING)
    if is_bounded or estimated <= controller.grip_safety * sticking * (1.0 + _ROUNDING):
        return None
    share = _share_of_first_slip(trace, contact, row)
    is_alone = len({finger.friction for finger in present.fingers}) > 1
    name = scenario.finger_names[contact]
    return _Overestimate(name, is_alone, share, index, time, estimated, true)


def _share_of_first_slip(trace: Trace, contact: int, row: int) -> float:
    """Fraction of the total slip of a fingertip from a row until it sticks."""
    ways = np.diff(trace.slid_way[:, contact])
    rests = np.flatnonzero(trace.phase[row:, contact] == ContactPhase.STICK)
    first = ways[: row + int(rests[0])] if len(rests) else ways
    return float(first.sum() / max(ways.sum(), _NO_WAY))


def _static_over_kinetic(finger: FingerParameters | SpatialFinger) -> float:
    """Ratio of static to sliding friction of a contact, which patches do not change."""
    static = finger.static_friction
    return static / finger.friction if static is not None and finger.friction > 0.0 else 1.0


def _describe_estimate(found: _Overestimate) -> str:
    """Describes the estimate of friction that led to insufficient grip force and slip."""
    if found.time == 0.0:
        whose = f" of the {found.finger} fingertip" if found.is_alone else ""
        return (
            f"The controller first estimated the friction{whose} as {found.estimated:.3g}; it is "
            f"{found.true:.3g}, so the grip force was too small."
        )
    return (
        f"When the {found.finger} fingertip began to slip, at t = {milliseconds(found.time)}, the "
        f"controller estimated the friction as {found.estimated:.3g}; it was {found.true:.3g}, "
        "so the grip force was too small."
    )


def _describe_other_estimate(result: RunResult) -> Iterator[str]:
    """Describes the worst other estimate, if a fingertip slipped from the start.

    Early ends already have a cause.
    """
    trace = result.trace
    if result.reason is None and trace.phase[trace.times == 0.0].any():
        misbelief = describe_misbelief(result.scenario, trace[:1], of_friction=False)
        if misbelief:
            yield sentence(f"at the start {misbelief}{describe_first_force(result)}")


def _suggest(result: RunResult, found: Sequence[_Overestimate]) -> Hint:
    """Suggestions after a run."""
    start, last, metrics = of_hand(result.scenario), result.trace[-1:], result.metrics
    present = of_hand(scenario_at(start, result.end_time))
    if result.reason is not None:
        return hint_for(result.reason, start, present, last)
    at_end = Situation(start=start, scenario=present, last=last)
    if metrics.slipping_at_end:
        return any_of(hold(at_end))
    longer = list(raise_(present, "simulation.duration"))
    if longer and not metrics.held:
        return any_of(longer, purpose="to see whether it stays at rest", risky=hold(at_end))
    if _is_off(result):
        return _suggest_to_come_nearer(at_end, found)
    if max(metrics.slip_path) < _LITTLE_SLIP:
        return _ask_for_the_margin(present)
    return _suggest_less_slip(at_end, found)


def _is_off(result: RunResult) -> bool:
    """True if a held object is far from its target, or hardly getting closer."""
    final = result.metrics.final_tracking_error
    return is_far_off(_body_at_end(result), final) or bool(_lasting_error(result))


def _ask_for_the_margin(scenario: Scenario) -> Hint:
    """Suggests measuring the margin of a well-held object."""
    friction = max(finger.friction for finger in scenario.fingers)
    question, key, start, stop = "little friction is enough", "fingers.*.friction", friction, 0.1
    if friction == 0.0:
        question, key, start, stop = "heavy it may be", "object.mass", scenario.object.mass, 10.0
    span = f"--from {start:.6g} --to {stop * start:.6g}"
    command = f"slipgrasp margin SCENARIO --over '{key}' {span}"
    return any_of(only_words(f"find out how {question}: {command}"), goal=Goal.MARGIN)


def _suggest_to_come_nearer(situation: Situation, found: Sequence[_Overestimate]) -> Hint:
    """Suggestions for a held object that is not at its target or still moves."""
    return any_of(
        _estimate_less_friction(situation.start, found),
        purpose="to bring it nearer to its target",
        goal=Goal.NEARER,
        risky=come_nearer(situation),
    )


def _suggest_less_slip(situation: Situation, found: Sequence[_Overestimate]) -> Hint:
    """Suggestions for less slip before the grasp holds."""
    return any_of(
        _estimate_less_friction(situation.start, found),
        purpose="for less slip",
        goal=Goal.LESS_SLIP,
        risky=slip_less(situation),
    )


def _estimate_less_friction(start: Scenario, found: Sequence[_Overestimate]) -> Iterator[Option]:
    """Lower estimates, if the initial ones led to most of the slip and their bounds allow it."""
    at_once = [one for one in found if one.time == 0.0 and one.share >= _MOST]
    lowest = [start.estimates[one.estimate].minimum for one in at_once]
    if not any(
        low is not None and low >= one.true for low, one in zip(lowest, at_once, strict=True)
    ):
        yield from believe_in_less(start, {one.estimate: one.true for one in at_once})
