"""Reads the words about a run and holds each against the facts, sharing no code with the words.

Every sentence and every option of a hint must be one that is known here, so that none can be
added without saying what makes it true.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.verdict import Verdict, headline_of
from slipgrasp.core.scenario import Pulse, Scenario
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.loading import parameter_definitions, with_values
from slipgrasp.core.scenario.world import SpatialPulse
from slipgrasp.core.trace.types import ContactPhase, Outcome
from slipgrasp.core.words.options import Option
from tests.core.reading_knowledge import KNOWLEDGE

LEARNING = {"theorem-3", "theorem-4", "composite"}
GRIPPING_BY_FRICTION = {"theorem-3", "theorem-4", "certainty-equivalence", "composite"}
CONTROLLERS = {
    "theorem-3": {"lyapunov_weight", "adaptation_gain", "grip_safety", "maximum_normal_force"},
    "theorem-4": {"lyapunov_weight", "adaptation_gain", "grip_safety", "maximum_normal_force"},
    "certainty-equivalence": {"grip_safety", "maximum_normal_force"},
    "pd-gravity": {"grip_force"},
    "grip-reflex": {"grip_force", "grip_rate", "maximum_normal_force"},
    "gripper": {"grip_force", "maximum_normal_force", "jaw_stiffness", "jaw_damping"},
    "composite": {
        *("lyapunov_weight", "initial_deviation", "grip_safety", "slip_stop"),
        "maximum_normal_force",
    },
}
"""What each law uses, besides the gains of its feedback and the control period."""
SHARED = {"grasp_force", "distribution", "prediction"}
FEEDBACK = {"position_gain", "velocity_gain", "control_period", "latency"}

HEADLINES = {
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
NUMBER = r"(-?[\d.]+(?:e[+-]?\d+)?)"
KEY = r"([a-z]+(?:\.(?:\w+|\*))+)"
UNITS = {"mm": 1e-3, "µm": 1e-6, "nm": 1e-9, "ms": 1e-3, "s": 1.0}
UNIT = r"(?: (?:N m|N/s|N|kg m²|kg|m/s²|m|1/s²|1/s|s)(?![/²\w]))?"


def check_words(result: RunResult, verdict: Verdict) -> None:
    """Holds headline, sentences and suggestion against the run."""
    check_headline(result, verdict.headline)
    sentences = list(verdict.sentences)
    if result.reason is not None:
        check_cause(result, sentences.pop(0))
    for text in sentences:
        checks = [(m, check) for pattern, check in SENTENCES if (m := re.fullmatch(pattern, text))]
        assert checks, f"a sentence that nothing is known of: {text}"
        for found, check in checks:
            check(result, found)
    paths = result.metrics.slip_path
    assert ("No fingertip slipped" in " ".join(sentences)) == (max(paths) == 0.0)
    check_hint(result, verdict)


def check_headline(result: RunResult, headline: str) -> None:
    if result.outcome is not Outcome.COMPLETED:
        no_torque = "Ended: the control law can no longer compute torques"
        by_reason = {
            "joint_limit": "Ended: a joint reached its limit",
            "model_estimate_singular": no_torque,
            "nonfinite_torque": no_torque,
        }
        assert headline == by_reason.get(result.reason.code, HEADLINES[result.outcome])
        return
    assert result.end_time == result.scenario.simulation.duration
    recent = result.trace.times > result.end_time - 0.5
    slips = result.trace.phase != ContactPhase.STICK
    if slips[-1].any():
        assert headline == "Not held: still slipping at the end"
    elif slips[recent].any():
        assert headline == "Not settled: it has only just stopped slipping"
    elif result.end_time < 0.5:
        assert headline == "At rest, but too short to tell: held means 0.5 s without slip"
    else:
        offset = rf"(?:, (?:{NUMBER} mm)?(?: and )?(?:{NUMBER}°)? from its target)?"
        found = re.fullmatch(rf"Held(?: after {NUMBER} mm of slip)?{offset}", headline)
        assert found, headline
        slipped, *offsets = found.groups()
        corners, path = corners_of(result.scenario), 1e3 * max(result.metrics.slip_path)
        assert (slipped is not None) == (path > 50.0 * smallest_width(corners)), headline
        assert slipped is None or near(slipped, path, 3)
        for told, off in zip(offsets, expected_offset(result), strict=True):
            assert (told is None) == (off is None), (headline, off)
            if told is not None and off is not None:
                assert abs(float(told) - off) <= 0.51 or near(told, off, 2)


def smallest_width(corners: np.ndarray) -> float:
    """The least distance of two parallel lines that hold a polygon between them [m]."""
    angles = np.linspace(0.0, math.pi, 20_001)
    directions = np.stack([np.cos(angles), np.sin(angles)], 1)
    return float(np.ptp(directions @ corners.T, axis=1).min())


def expected_offset(result: RunResult) -> tuple[float | None, float | None]:
    """How far the object is off [mm, degrees], where that is more than a 20th of its width."""
    corners = corners_of(result.scenario)
    x, y, turn = result.trace.tracking_error[-1]
    far, distance = 0.05 * smallest_width(corners), math.hypot(x, y)
    swing = abs(turn) * float(np.hypot(*corners.T).max())
    return (
        1e3 * distance if distance > far else None,
        abs(math.degrees(turn)) if swing > far else None,
    )


def corners_of(scenario: Scenario) -> np.ndarray:
    body = scenario.object
    x, y = body.half_width, body.face_half_length
    return np.array(body.corners or [(-x, -y), (x, -y), (x, y), (-x, y)])


def at(result: RunResult, time: float) -> Scenario:
    """The scenario with the timed changes up to some time."""
    scenario = replace(result.scenario, changes=())
    for change in sorted(result.scenario.changes, key=lambda change: change.time):
        if change.time <= time and change.time < result.scenario.simulation.duration:
            value = list(change.value) if isinstance(change.value, tuple) else change.value
            scenario = with_values(scenario, {change.parameter: value})
    return scenario


def law_of(result: RunResult, time: float) -> str:
    return at(result, time).controller.kind


def near(text: str, value: float, digits: int = 3) -> bool:
    """Whether a number in a text is a value, rounded to some digits."""
    return math.isclose(float(text), value, rel_tol=0.51 * 10.0 ** (1 - digits), abs_tol=1e-12)


def check_cause(result: RunResult, text: str) -> None:
    """The reason of an early end: what happened, then what it may come from."""
    reason = result.reason
    assert reason is not None
    assert text.startswith(f"{reason.message[:1].upper()}{reason.message[1:]}")
    happened, *causes = f"{text[:1].lower()}{text[1:-1]}".split("; ")
    assert len(causes) == len(set(causes))
    outcome, is_so = ENDINGS[reason.code]
    assert result.outcome is outcome and is_so(result, happened), happened
    (time,) = re.findall(rf" at {NUMBER} s$", happened)
    assert near(time, result.end_time, 3)
    names = result.scenario.finger_names
    assert reason.contact is None or f"the {names[reason.contact]} fing" in happened
    for cause in causes:
        check_one_cause(result, cause)


def check_one_cause(result: RunResult, cause: str) -> None:
    last, present = result.trace[-1:], at(result, result.end_time)
    if found := re.fullmatch(rf"a joint reached its limit {KEY}, {NUMBER} N m", cause):
        limit = present.actuation.torque_limit
        assert limit is not None and near(found[2], limit)
        assert np.abs(last.joint_torque[0]).max() >= limit
    elif found := re.fullmatch(DELAYS, cause):
        check_delays(result, found)
    elif found := re.fullmatch(DISTRIBUTION, cause):
        assert present.controller.distribution == "exact"
        assert near(found[1], float(last.normal_force[0].max())) and last.phase[0].any()
    else:
        found = re.fullmatch(MISBELIEF, cause)
        assert found, cause
        k = unknown_called(result.scenario, found[1])
        believed, true = float(last.estimates[0, k]), float(last.true_parameters[0, k])
        assert near(found[2], believed) and near(found[3], true) and is_far(believed, true)
        assert "friction" not in found[1] or present.controller.kind in GRIPPING_BY_FRICTION
        assert "moment" not in found[1] or abs(last.object_velocity[0, 2]) >= 1e-6


def is_far(believed: float, true: float) -> bool:
    return believed <= 0.0 or max(believed / true, true / believed) > 1.29


DELAYS = (
    rf"(?:torques act {NUMBER} ms late \(controller\.latency\))?(?: and )?"
    rf"(?:slip is detected {NUMBER} ms late \(sensing\.slip_delay\))?"
)
DISTRIBUTION = (
    r"the law puts the forces of slipping contacts exactly on their cones "
    rf"\(controller\.distribution\) and presses with {NUMBER} N"
)


MISBELIEF = rf"the controller estimated the (.+) as {NUMBER}{UNIT} instead of {NUMBER}{UNIT}"


def check_delays(result: RunResult, found: re.Match[str]) -> None:
    present = at(result, result.end_time)
    assert present.controller.control_period > 0.0
    if found[1]:
        assert near(found[1], 1e3 * present.controller.latency)
    if found[2]:
        assert near(found[2], 1e3 * present.sensing.slip_delay) and not present.sensing.true_phases


def unknown_called(scenario: Scenario, words: str) -> int:
    """The index of an unknown by what a sentence calls it."""
    names = {
        "mass of the object": "object.mass",
        "moment of inertia of the object": "object.inertia",
    }
    for i, finger in enumerate(scenario.finger_names):
        names[f"friction of the {finger} fingertip"] = f"fingers.{i}.friction"
        for link in range(2):
            name = f"mass of link {link + 1} of the {finger} finger"
            names[name] = f"fingers.{i}.link_masses.{link}"
    return [estimate.parameter for estimate in scenario.estimates].index(names[words])


def finger_called(result: RunResult, name: str) -> int:
    return result.scenario.finger_names.index(name)


def half_length(scenario: Scenario, face: str) -> float:
    if face in ("left", "right"):
        return scenario.object.face_half_length
    if face in ("top", "bottom"):
        return scenario.object.half_width
    corners, k = corners_of(scenario), int(face.removeprefix("edge-"))
    return 0.5 * float(np.hypot(*(corners[(k + 1) % len(corners)] - corners[k])))


def has_separated(result: RunResult, happened: str) -> bool:
    force = float(result.trace.normal_force[-1, result.reason.contact])
    return (abs(force) <= 1e-6) == ("normal force" in happened)


def has_left_its_face(result: RunResult, happened: str) -> bool:
    contact = result.reason.contact
    finger, slip = result.scenario.fingers[contact], float(result.trace.slip[-1, contact])
    end, along = half_length(result.scenario, finger.face), abs(slip + finger.contact_offset)
    return math.isclose(along, end, rel_tol=1e-6) and "slid off the end of its face" in happened


def is_singular(result: RunResult, happened: str) -> bool:
    second = float(result.trace.joint_position[-1, 2 * result.reason.contact + 1])
    shape = "straight" if math.cos(second) > 0.0 else "folded"
    return abs(math.sin(second)) < 0.06 and f"became {shape}" in happened


def has_a_joint_at_its_limit(result: RunResult, happened: str) -> bool:
    contact, reason = result.reason.contact, result.reason
    pattern = rf"joint (\d) of .* its (minimum|maximum), {NUMBER} (?:rad|m) \({KEY}\), at"
    (joint, end, told, key) = re.findall(pattern, happened)[0]
    limit = getattr(result.scenario.fingers[contact].joints[int(joint) - 1], end)
    assert reason.limit == limit and math.isclose(reason.value, limit, abs_tol=1e-9)
    return near(told, limit) and key == f"fingers.{contact}.joints.{int(joint) - 1}.{end}"


def has_chattered(result: RunResult, happened: str) -> bool:
    count, window = re.findall(rf"(\d+) phase changes within {NUMBER} s", happened)[0]
    times = [change.time for change in result.phase_changes]
    return times[-1] - times[-int(count)] <= float(window) * (1.0 + 1e-9)


def is_too_stiff(result: RunResult, happened: str) -> bool:
    (told,) = re.findall(r"condition number ([\d.e+-]+),", happened)
    return near(told, float(result.trace.estimated_inertia_condition[-1]), 2)


def was_cut_short(result: RunResult, _happened: str) -> bool:
    return result.end_time < result.scenario.simulation.duration


def is_so(_result: RunResult, _happened: str) -> bool:
    """Of what the outcome says all."""
    return True


ENDINGS: dict[str, tuple[Outcome, Callable[[RunResult, str], bool]]] = {
    "contact_separation": (Outcome.SEPARATED, has_separated),
    "contact_left_face": (Outcome.LEFT_FACE, has_left_its_face),
    "singular_jacobian": (Outcome.SINGULAR, is_singular),
    "joint_limit": (Outcome.SINGULAR, has_a_joint_at_its_limit),
    "chatter": (Outcome.CHATTERING, has_chattered),
    "no_consistent_phase": (Outcome.INCONSISTENT, is_so),
    "painleve": (Outcome.DIVERGED, is_so),
    # Only these laws invert an estimate of the inertia.
    "model_estimate_singular": (
        Outcome.DIVERGED,
        lambda result, _: law_of(result, result.end_time) in GRIPPING_BY_FRICTION,
    ),
    "nonfinite_torque": (Outcome.DIVERGED, is_so),
    # A law that looks ahead, or measures with noise, is there a little before the object.
    "turned_too_far": (
        Outcome.DIVERGED,
        lambda result, _: math.hypot(*result.trace.tracking_error[-1, 3:]) > 2.5,
    ),
    "step_underflow": (Outcome.DIVERGED, is_so),
    "unbounded_grasp_force": (Outcome.DIVERGED, is_so),
    "stiff_loop": (Outcome.DIVERGED, is_too_stiff),
    "nonfinite_state": (Outcome.DIVERGED, is_so),
    "event_stall": (Outcome.LIMIT, is_so),
    "max_steps": (
        Outcome.LIMIT,
        lambda result, told: f"of {result.scenario.simulation.max_steps} steps was" in told,
    ),
    "stopped": (Outcome.STOPPED, was_cut_short),
    "wall_time": (Outcome.LIMIT, was_cut_short),
}
"""What ended a run, and what is true of it then."""


def check_slips(result: RunResult, found: re.Match[str]) -> None:
    """Every fingertip that slipped is named with its way, and no other."""
    names, paths = result.scenario.finger_names, result.metrics.slip_path
    some = re.fullmatch(r"The (.+) fingertips?", found["who"])
    subjects = re.split(", | and ", some[1]) if some else list(names)
    length = r"([\d.]+|less than 1) (mm|µm|nm)"
    if same := re.fullmatch(f"by {length}", found["lengths"]):
        told = [(name, *same.groups()) for name in subjects]
    else:
        told = re.findall(rf"([a-z0-9 ]+): {length}(?:, |$)", found["lengths"].strip("()"))
    assert [name for name, *_ in told] == subjects
    spins = result.metrics.spin_path or [0.0] * len(names)
    assert set(subjects) == {
        name for name, path, spin in zip(names, paths, spins, strict=True) if path or spin
    }
    for name, value, unit in told:
        path = paths[names.index(name)]
        assert path < 1e-9 if value == "less than 1" else near(value, path / UNITS[unit], 2)
    assert (some is None) == (len(told) == len(names)) or len(names) == 1
    check_pivots(result.metrics.spin_path, found)
    is_told = found["stop"] is not None
    stops = [c.time for c in result.phase_changes if c.to_phase is ContactPhase.STICK]
    assert is_told == bool(stops and not result.metrics.slipping_at_end)
    if is_told:
        value, unit = found["stop"].split()
        assert abs(float(value) * UNITS[unit] - max(stops)) <= (5.1e-4 if unit == "ms" else 5.1e-3)
        slips = Counter(
            c.contact for c in result.phase_changes if c.from_phase is ContactPhase.STICK
        )
        assert (found["last"] is not None) == (max(slips.values()) > 1)


def check_push_at_start(result: RunResult, found: re.Match[str]) -> None:
    """The named fingertips, and no others, left stick at once, as did a push."""
    names = result.scenario.finger_names
    assert any(push.time == 0.0 for push in result.scenario.pulses)
    assert fingertips_in(found["who"], names) == {
        names[c.contact]
        for c in result.phase_changes
        if c.from_phase is ContactPhase.STICK and c.time == 0.0
    }


def check_pivots(spins: tuple[float, ...], found: re.Match[str]) -> None:
    """The sentence has the largest angle if it is at least a degree, and whether all are equal."""
    degrees = [math.degrees(spin) for spin in spins if spin > 0.0]
    assert (found["turned"] is not None) == (max(degrees, default=0.0) >= 1.0)
    if found["turned"]:
        assert found["turned"] == f"{max(degrees):.0f}"
        alike = len({f"{each:.0f}" for each in degrees}) == 1
        assert (found["most"] is None) == alike


def check_push(result: RunResult, found: re.Match[str]) -> None:
    """The named fingertips, and no others, left stick while that push acted, or as it ended."""
    value, unit = found["when"].split()
    rounding = 5.1e-4 if unit == "ms" else 5.1e-3
    pushes = [
        p for p in result.scenario.pulses if abs(p.time - float(value) * UNITS[unit]) <= rounding
    ]
    names = result.scenario.finger_names
    told = fingertips_in(found["who"], names)
    onsets = [c for c in result.phase_changes if c.from_phase is ContactPhase.STICK]

    def agrees(push: Pulse | SpatialPulse) -> bool:
        end = push.time + push.duration
        during = {names[c.contact] for c in onsets if push.time <= c.time < end}
        ended = {names[c.contact] for c in onsets if c.time == end}
        if any(other.time == end for other in result.scenario.pulses):
            ended = set()
        return told == during if found["how"] == "During" else told == ended and not during

    assert any(map(agrees, pushes))


def check_change(result: RunResult, found: re.Match[str]) -> None:
    """The named fingertips, and no others, left stick within 50 ms after that change."""
    value, unit = found["when"].split()
    rounding = 5.1e-4 if unit == "ms" else 5.1e-3
    names = result.scenario.finger_names
    told = fingertips_in(found["who"], names)
    assert any(
        told
        == {
            names[c.contact]
            for c in result.phase_changes
            if c.from_phase is ContactPhase.STICK and 0.0 <= c.time - change.time <= 0.05
        }
        for change in result.scenario.changes
        if change.parameter == found["key"]
        and abs(change.time - float(value) * UNITS[unit]) <= rounding
    )


def fingertips_in(who: str, names: tuple[str, ...]) -> set[str]:
    """Names of the fingers in the words for some fingertips."""
    some = re.fullmatch(r"the (.+) fingertips?", who)
    return set(re.split(", | and ", some[1])) if some else set(names)


def check_least_margin(result: RunResult, found: re.Match[str]) -> None:
    trace = result.trace
    margins = np.where(trace.phase == ContactPhase.STICK, trace.friction_margin, np.inf)[1:]
    assert margins.min() < math.inf
    row, contact = np.unravel_index(np.argmin(margins), margins.shape)
    assert near(found["margin"], float(margins[row, contact]), 1)
    value, unit = found["when"].split()
    name = finger_called(result, found["finger"])
    close = margins[:, name] <= margins.min() + 1e-9 + 1e-9 * abs(margins.min())
    times = trace.times[1:][close]
    assert np.abs(times - float(value) * UNITS[unit]).min() <= 5.1e-3


def first_slip(result: RunResult, contact: int) -> int:
    return int(np.flatnonzero(result.trace.phase[:, contact])[0])


def check_first_belief(result: RunResult, found: re.Match[str]) -> None:
    """A finger that slips from the start, of which the controller believes what is said."""
    scenario, trace = result.scenario, result.trace
    assert scenario.controller.kind in GRIPPING_BY_FRICTION or scenario.changes
    assert scenario.controller.grasp_force == "minimum" or scenario.changes
    fitting = [
        i
        for i in range(len(scenario.fingers))
        for estimate in scenario.estimates
        if estimate.parameter == f"fingers.{i}.friction"
        and near(found["believed"], estimate.initial)
        and trace.phase[:, i].any()
        and trace.times[first_slip(result, i)] == 0.0
        and near(found["true"], float(trace.friction_coefficient[first_slip(result, i), i]))
        and estimate.initial > trace.friction_coefficient[first_slip(result, i), i]
    ]
    if found["finger"] is None:
        assert fitting
    else:
        assert finger_called(result, found["finger"]) in fitting


def check_later_belief(result: RunResult, found: re.Match[str]) -> None:
    i, trace = finger_called(result, found["finger"]), result.trace
    row = first_slip(result, i)
    k = [e.parameter for e in result.scenario.estimates].index(f"fingers.{i}.friction")
    believed, true = float(trace.estimates[row - 1, k]), float(trace.friction_coefficient[row, i])
    assert law_of(result, float(trace.times[row])) in GRIPPING_BY_FRICTION
    assert near(found["believed"], believed) and near(found["true"], true) and believed > true
    value, unit = found["when"].split()
    assert abs(float(value) * UNITS[unit] - trace.times[row]) <= (
        5.1e-4 if unit == "ms" else 5.1e-3
    )


def check_other_belief(result: RunResult, found: re.Match[str]) -> None:
    """A run with slip from the start on, and no belief in too much friction to explain it."""
    trace, k = result.trace, unknown_called(result.scenario, found["what"])
    believed, true = float(trace.estimates[0, k]), float(trace.true_parameters[0, k])
    assert result.reason is None and trace.phase[trace.times == 0.0].any()
    assert "friction" not in found["what"]
    assert near(found["believed"], believed) and near(found["true"], true)
    assert max(believed / true, true / believed) > 1.29
    if found["first"]:
        i = finger_called(result, found["finger"])
        assert result.outcome is Outcome.COMPLETED and not trace.phase[-1].any()
        assert near(found["first"], trace.normal_force[trace.times == 0.0][-1, i])
        least = trace[-1:].tangential_size[0, i] / trace.friction_coefficient[-1, i]
        assert near(found["needed"], least) or result.scenario.has_soft_fingers
        assert float(found["needed"]) > 1.19 * float(found["first"])


def check_squeeze(result: RunResult, found: re.Match[str]) -> None:
    i, trace = finger_called(result, found["finger"]), result.trace
    assert result.outcome is Outcome.COMPLETED and not trace.phase[-1].any()
    least = abs(trace.tangential_force[-1, i]) / trace.friction_coefficient[-1, i]
    assert abs(float(found["normal"]) - trace.normal_force[-1, i]) <= 0.051
    if found["least"]:
        assert abs(float(found["least"]) - least) <= 0.051 and found["least"] != found["normal"]
    else:
        assert abs(trace.normal_force[-1, i] - least) <= 0.0011
    slipping = trace.normal_force[trace.phase[:, i] != 0, i]
    assert (found["most"] is not None) == bool(slipping.size)
    if found["most"]:
        assert abs(float(found["most"]) - max(slipping)) <= 0.051
    used = abs(trace.tangential_force[1:, i]) / np.maximum(trace.friction_coefficient[1:, i], 1e-9)
    if found["needed"]:
        assert 0.0 <= float(found["needed"]) - max(used) < 0.1
    elif not slipping.size:
        assert max(used) <= least + 0.1


def check_lasting_error(result: RunResult, found: re.Match[str]) -> None:
    """Held, the headline does not tell of it, and 0.2 s before it was no more than 1 % larger."""
    errors = np.hypot(*result.trace.tracking_error[:, :2].T)
    earlier = errors[np.searchsorted(result.trace.times, result.end_time - 0.2)]
    assert result.metrics.held and "wanted" not in headline_of(result)
    assert near(found[1], 1e3 * errors[-1], 2) and errors[-1] >= 1e-3
    assert errors[-1] >= 0.99 * earlier


def check_switching(result: RunResult, found: re.Match[str]) -> None:
    assert int(found[1]) == len(result.phase_changes) >= 100 * len(result.scenario.fingers)
    assert found[2] is None or commands_the_edge(at(result, result.end_time))


def commands_the_edge(present: Scenario) -> bool:
    return present.controller.grip_safety == 1.0 and present.controller.control_period > 0.0


SENTENCES: tuple[tuple[str, Callable[[RunResult, re.Match[str]], None]], ...] = (
    (
        r"(?P<who>.+) slipped (?P<lengths>by .+?|\(.+\))"
        r"(?:(?: and|,) pivoted by (?P<most>up to )?(?P<turned>\d+)°)?"
        r"(?: and (?P<last>last )?stopped at t = (?P<stop>[\d.]+ m?s))?\.",
        check_slips,
    ),
    (
        r"(?P<how>During|As) the push (?:that began )?at t = (?P<when>[\d.]+ m?s)(?: ended,)? "
        r"(?P<who>.+) began to slip\.",
        check_push,
    ),
    (
        r"A push acted from the start, when (?P<who>.+) began to slip\.",
        check_push_at_start,
    ),
    (
        r"Within 50 ms after (?P<key>[\w.]+) changed at t = (?P<when>[\d.]+ m?s), "
        r"(?P<who>.+) began to slip\.",
        check_change,
    ),
    (r"No fingertip slipped\.", lambda _result, _found: None),
    (
        rf"No fingertip slipped; the least margin was (?P<margin>{NUMBER}) N, (?P<finger>.+) "
        r"at t = (?P<when>[\d.]+ m?s)\.",
        check_least_margin,
    ),
    (
        r"The controller first estimated the friction(?: of the (?P<finger>.+) fingertip)? as "
        r"(?P<believed>[\d.e-]+); it is "
        r"(?P<true>[\d.e-]+), so the grip force was too small\.",
        check_first_belief,
    ),
    (
        r"When the (?P<finger>.+) fingertip began to slip, at t = (?P<when>[\d.]+ m?s), the "
        r"controller estimated the friction as (?P<believed>[\d.e-]+); it was "
        r"(?P<true>[\d.e-]+), so the grip force was too small\.",
        check_later_belief,
    ),
    (
        rf"At the start the controller estimated the (?P<what>.+) as "
        rf"(?P<believed>{NUMBER}){UNIT} instead of (?P<true>{NUMBER}){UNIT}"
        rf"(?: and pressed the (?P<finger>.+) fingertip with (?P<first>{NUMBER}) N; at the end it "
        rf"needs (?P<needed>{NUMBER}) N)?\.",
        check_other_belief,
    ),
    (
        rf"At the end the object is {NUMBER} mm from its target, and is hardly getting closer\.",
        check_lasting_error,
    ),
    (
        r"The contacts switched between stick and slip (\d+) times(: with controller\.grip_safety "
        r"1 the commanded forces lie on the edges of their cones, where every small error lets a "
        r"contact slip)?\.",
        check_switching,
    ),
    (
        r"At the end the (?P<finger>.+) fingertip presses with (?P<normal>[\d.]+) N and needs "
        r"(?:(?P<least>[\d.]+) N|all of it) to stick; (?:faster motion or a push can require "
        r"more|earlier it slipped while it pressed with up to (?P<most>[\d.]+) N|earlier it needed "
        r"up to (?P<needed>[\d.]+) N)\.",
        check_squeeze,
    ),
    *KNOWLEDGE,
)


def check_hint(result: RunResult, verdict: Verdict) -> None:
    """Every option sets something else than there is, of use to its law, and says what."""
    hint, present = verdict.hint, at(result, result.end_time)
    told = str(hint)
    assert result.reason is None or result.reason.hint == told
    assert verdict.suggestion == f"{told[:1].upper()}{told[1:]}."
    assert hint.purpose in PURPOSES
    for option in (*hint.options, *hint.risky):
        if option.values:
            check_values(result, present, option)
        check_words_of(result, present, option)
    if hint.instead:
        check_words_of(result, present, Option(hint.instead))


def check_values(result: RunResult, present: Scenario, option: Option) -> None:
    values = {key: value for key, value in option.values.items() if key != LAW}
    law = option.values.get(LAW, present.controller.kind)
    assert with_values(present, values) != present or law != present.controller.kind
    used = CONTROLLERS[law] | FEEDBACK | (SHARED if law in GRIPPING_BY_FRICTION else set())
    for key, value in values.items():
        head, _, name = key.partition(".")
        assert head != "controller" or name in used, key
        assert key not in WORTH or WORTH[key](present), key
        if head == "estimates" and name.endswith("initial"):
            check_belief(result, option, int(name.partition(".")[0]), value)
    if "bounds" in option.label:
        bounded = with_values(result.scenario, values).estimates
        for estimate, true in zip(bounded, result.trace.true_parameters[0], strict=True):
            assert estimate.minimum < true < estimate.maximum
        return
    told = re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", option.label)
    for value in values.values():
        is_word = isinstance(value, (str, bool)) and str(value).lower() in option.label
        assert is_word or any(near(text, float(value), 6) for text in told)


def check_belief(result: RunResult, option: Option, k: int, value: float) -> None:
    """It comes nearer to the truth, or below that of a friction that was overestimated."""
    scenario, estimate = result.scenario, result.scenario.estimates[k]
    true = float(parameter_definitions(scenario)[estimate.parameter].value)
    is_of_friction = estimate.parameter.endswith(".friction")
    told = re.findall(rf"estimates\.{k}\.initial (nearer to|below) {NUMBER}", option.words)
    ((way, number),) = told
    assert scenario.changes or not is_of_friction or law_of(result, 0.0) in GRIPPING_BY_FRICTION
    if way == "below":
        assert is_of_friction and value < float(number) < estimate.initial
    else:
        assert near(number, true) and is_far(estimate.initial, true)


def check_words_of(result: RunResult, present: Scenario, option: Option) -> None:
    """What an option says beyond its values, or without any, is so and known here."""
    left = option.words
    for pattern, check in CLAUSES:
        for found in re.finditer(pattern, left):
            assert check(result, present, found), found[0]
        left = re.sub(pattern, "", left)
    assert not re.sub(r"\bset\b|\bor\b|\band\b|[,; ]", "", left), f"{left!r} of {option.words!r}"


Clause = Callable[[RunResult, Scenario, re.Match[str]], bool]


def moves(_result: RunResult, present: Scenario, found: re.Match[str]) -> bool:
    """From its value, which has not reached the end on that side; or a list, or all frictions."""
    verb, key, told = found.groups()
    if key == "fingers.*.friction":
        return any(finger.friction > 0.0 for finger in present.fingers)
    parameter = parameter_definitions(present).get(key)
    if told is None:
        return parameter is None or parameter.value is None
    end = parameter.maximum if verb == "raise" else parameter.minimum
    return near(told, parameter.value, 6) and parameter.value != end


def is_held_well(result: RunResult, present: Scenario, found: re.Match[str]) -> bool:
    """Held, with little slip and no error that the headline tells; from what there is, to less."""
    friction = max(finger.friction for finger in present.fingers)
    assert result.metrics.held and max(result.metrics.slip_path) < 1e-4
    assert headline_of(result) == "Held"
    is_less = found[1] == "fingers.*.friction" and near(found[2], friction, 6)
    return friction == 0.0 or (is_less and float(found[3]) < float(found[2]))


def has_no_such_bounds(_result: RunResult, present: Scenario, found: re.Match[str]) -> bool:
    bounds = re.findall(r"estimates\.(\d+)\.(minimum|maximum)", found[0])
    return present.controller.kind in LEARNING and all(
        getattr(present.estimates[int(place)], bound) is None for place, bound in bounds
    )


def is_length_of_the_face(result: RunResult, _present: Scenario, found: re.Match[str]) -> bool:
    face = result.scenario.fingers[result.reason.contact].face
    expected = "object.half_width" if face in ("top", "bottom") else "object.face_half_length"
    return found[1] == ("object.corners" if face.startswith("edge") else expected)


def is_base_of_the_finger(result: RunResult, _present: Scenario, found: re.Match[str]) -> bool:
    contact = result.reason.contact
    return found.groups() == (result.scenario.finger_names[contact], str(contact))


def is_always_so(_result: RunResult, _present: Scenario, _found: re.Match[str]) -> bool:
    return True


WORTH: dict[str, Callable[[Scenario], bool]] = {
    "controller.grasp_force": lambda now: now.controller.grasp_force == "none",
    "controller.control_period": lambda now: not 0.0 < now.controller.control_period <= 0.001,
    "controller.distribution": lambda now: now.controller.distribution != "hold",
    "controller.prediction": lambda now: now.controller.latency > 0.0,
}
"""Where it is worth setting a parameter, beyond that it has another value."""
CLAUSES: tuple[tuple[str, Clause], ...] = (
    (rf"(raise|lower) {KEY}(?: (?:above|below) {NUMBER}{UNIT})?", moves),
    (
        r"controller\.grip_safety to 1\.05",
        lambda result, present, found: commands_the_edge(present),
    ),
    (rf"{KEY} to (?:{NUMBER}{UNIT}|minimum|hold|true)", is_always_so),
    (r"use the composite law", lambda result, present, _: present.controller.kind != "composite"),
    (
        r"find out how (?:little friction is enough|heavy it may be): slipgrasp margin SCENARIO "
        rf"--over '{KEY}' --from {NUMBER} --to {NUMBER}",
        is_held_well,
    ),
    (r"give the estimates bounds \([^)]*first\)", has_no_such_bounds),
    (rf"estimates\.\d+\.initial (?:nearer to|below) {NUMBER}{UNIT}", is_always_so),
    (r"\(the truth\)", is_always_so),
    (r"use a longer face \((.+?)\)", is_length_of_the_face),
    (r"move the base of the (.+?) finger \(fingers\.(\d)\.base\)", is_base_of_the_finger),
    (
        r"change simulation\.relative_tolerance a little|change the pose|shorten the run"
        r"|choose a motion within its reach \(trajectory\)|raise the limit"
        r"|run it again to see the rest|simulate its scenario again"
        r"|no other setting of this law can help: make the object lighter or its faces rougher",
        is_always_so,
    ),
)
"""What an option may say, and where it is so."""
PURPOSES = {
    *("", "to stop the slip earlier", "to see whether it stays at rest"),
    *("to bring it nearer to its target", "for less slip"),
}
