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
from typing import Any

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.verdict import Verdict, headline_of
from slipgrasp.core.scenario import Pulse, Scenario
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.loading import parameter_definitions, with_values
from slipgrasp.core.scenario.spatial import SpatialPulse
from slipgrasp.core.trace.types import ContactPhase, Outcome
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
KIND = re.compile(
    r"fingers\.(\d+)\.friction|object\.(mass|inertia)|fingers\.(\d+)\.link_masses\.(\d)"
)


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
    check_hint(result, verdict.suggestion)
    check_trials(result, verdict)


def check_trials(result: RunResult, verdict: Verdict) -> None:
    """Every trial sets something anew that the scenario may have, and says its value."""
    present = at(result, result.end_time)
    assert result.reason is None or str(verdict.hint) == result.reason.hint
    for trial in verdict.hint.trials:
        keyed = {key: value for key, value in trial.values.items() if key != LAW}
        assert with_values(present, keyed) != present or LAW in trial.values
        if trial.label == "physical bounds for all estimates":
            bounded = with_values(result.scenario, keyed)
            for estimate, true in zip(
                bounded.estimates, result.trace.true_parameters[0], strict=True
            ):
                assert estimate.minimum < true < estimate.maximum
            continue
        told = re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", trial.label)
        for value in keyed.values():
            is_word = isinstance(value, (str, bool)) and str(value).lower() in trial.label
            assert is_word or any(near(text, float(value), 6) for text in told)


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
        assert (slipped is not None) == (path > 100.0 * smallest_width(corners)), headline
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
    """How far the object is off [mm, degrees], where that is more than a tenth of its width."""
    corners = corners_of(result.scenario)
    x, y, turn = result.trace.tracking_error[-1]
    far, distance = 0.1 * smallest_width(corners), math.hypot(x, y)
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
    reason, last = result.reason, result.trace[-1:]
    assert reason is not None
    assert text.startswith(f"{reason.message[:1].upper()}{reason.message[1:]}")
    happened, *causes = f"{text[:1].lower()}{text[1:-1]}".split("; ")
    assert len(causes) == len(set(causes))
    pattern, check = CAUSES[reason.code]
    found = re.fullmatch(pattern, happened)
    assert found, happened
    check(result, found)
    law = law_of(result, reason.time)
    for cause in causes:
        if found := re.fullmatch(rf"a joint reached its limit {KEY}, {NUMBER} N m", cause):
            limit = at(result, reason.time).actuation.torque_limit
            assert limit is not None and near(found[2], limit)
            assert np.abs(last.joint_torque[0]).max() >= limit
            continue
        if found := re.fullmatch(DELAYS, cause):
            check_delays(result, found)
            continue
        if found := re.fullmatch(DISTRIBUTION, cause):
            assert at(result, reason.time).controller.distribution == "exact"
            assert near(found[1], float(last.normal_force[0].max())) and last.phase[0].any()
            continue
        pattern = rf"the controller estimated the (.+) as {NUMBER}{UNIT} instead of {NUMBER}{UNIT}"
        found = re.fullmatch(pattern, cause)
        assert found, cause
        k = unknown_called(result.scenario, found[1])
        believed, true = float(last.estimates[0, k]), float(last.true_parameters[0, k])
        assert near(found[2], believed) and near(found[3], true)
        assert believed <= 0.0 or max(believed / true, true / believed) > 1.29
        assert "friction" not in found[1] or law in GRIPPING_BY_FRICTION
        assert "moment" not in found[1] or abs(last.object_velocity[0, 2]) >= 1e-6


DELAYS = (
    rf"(?:torques act {NUMBER} ms late \(controller\.latency\))?(?: and )?"
    rf"(?:slip is detected {NUMBER} ms late \(sensing\.slip_delay\))?"
)
DISTRIBUTION = (
    r"the law puts the forces of slipping contacts exactly on their cones "
    rf"\(controller\.distribution\) and presses with {NUMBER} N"
)


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


def check_at(result: RunResult, time: str) -> None:
    assert near(time, result.end_time, 4)


def is_separated(result: RunResult, found: re.Match[str]) -> None:
    contact = finger_called(result, found["finger"])
    assert result.outcome is Outcome.SEPARATED and result.reason.contact == contact
    zero = abs(float(result.trace.normal_force[-1, contact])) <= 1e-6
    assert zero == ("normal force" in found[0])
    check_at(result, found["time"])


def has_left(result: RunResult, found: re.Match[str]) -> None:
    contact = finger_called(result, found["finger"])
    assert result.outcome is Outcome.LEFT_FACE and result.reason.contact == contact
    finger, slip = result.scenario.fingers[contact], float(result.trace.slip[-1, contact])
    along = abs(slip + finger.contact_offset)
    assert math.isclose(along, half_length(result.scenario, finger.face), rel_tol=1e-6)
    check_at(result, found["time"])


def half_length(scenario: Scenario, face: str) -> float:
    if face in ("left", "right"):
        return scenario.object.face_half_length
    if face in ("top", "bottom"):
        return scenario.object.half_width
    corners, k = corners_of(scenario), int(face.removeprefix("edge-"))
    return 0.5 * float(np.hypot(*(corners[(k + 1) % len(corners)] - corners[k])))


def is_singular(result: RunResult, found: re.Match[str]) -> None:
    contact = finger_called(result, found["finger"])
    assert result.outcome is Outcome.SINGULAR and result.reason.contact == contact
    second = float(result.trace.joint_position[-1, 2 * contact + 1])
    assert abs(math.sin(second)) < 0.06
    assert (math.cos(second) > 0.0) == (found["shape"] == "straight")
    check_at(result, found["time"])


def has_a_joint_at_its_limit(result: RunResult, found: re.Match[str]) -> None:
    contact, joint = finger_called(result, found["finger"]), int(found["joint"]) - 1
    assert result.outcome is Outcome.SINGULAR and result.reason.contact == contact
    given = result.scenario.fingers[contact].joints[joint]
    limit = given.minimum if found["end"] == "minimum" else given.maximum
    assert result.reason.limit == limit and near(found[4], limit)
    assert found[5] == f"fingers.{contact}.joints.{joint}.{found['end']}"
    assert math.isclose(result.reason.value, limit, abs_tol=1e-9)
    check_at(result, found["time"])


def has_chattered(result: RunResult, found: re.Match[str]) -> None:
    assert result.outcome is Outcome.CHATTERING
    changes = [change.time for change in result.phase_changes]
    assert int(found["count"]) <= len(changes)
    span = changes[-1] - changes[-int(found["count"])]
    assert span <= float(found["window"]) * (1.0 + 1e-9)


def outcome_is(outcome: Outcome) -> Callable[[RunResult, re.Match[str]], None]:
    def check(result: RunResult, found: re.Match[str]) -> None:
        assert result.outcome is outcome
        check_at(result, found["time"])

    return check


def has_singular_model(result: RunResult, found: re.Match[str]) -> None:
    outcome_is(Outcome.DIVERGED)(result, found)
    # Only these invert an estimate of the inertia.
    assert law_of(result, result.end_time) in GRIPPING_BY_FRICTION


def has_turned_too_far(result: RunResult, found: re.Match[str]) -> None:
    outcome_is(Outcome.DIVERGED)(result, found)
    # A law that looks ahead, or measures with noise, is there a little before the object.
    assert math.hypot(*result.trace.tracking_error[-1, 3:]) > 2.5


def is_too_stiff(result: RunResult, found: re.Match[str]) -> None:
    outcome_is(Outcome.DIVERGED)(result, found)
    assert near(found["condition"], float(result.trace.estimated_inertia_condition[-1]), 2)


def has_spent_its_steps(result: RunResult, found: re.Match[str]) -> None:
    outcome_is(Outcome.LIMIT)(result, found)
    assert int(found["count"]) == result.scenario.simulation.max_steps


def was_stopped(result: RunResult, found: re.Match[str]) -> None:
    assert result.end_time < result.scenario.simulation.duration
    assert near(found["time"], result.end_time, 3)


TIME = r"at (?P<time>[\d.e-]+) s"
CAUSES: dict[str, tuple[str, Callable[[RunResult, re.Match[str]], None]]] = {
    "contact_separation": (
        rf"the (?:torque separated|normal force of) the (?P<finger>.+) fingertip "
        rf"(?:fell to zero: it separated )?from the object {TIME}",
        is_separated,
    ),
    "contact_left_face": (
        rf"the (?P<finger>.+) fingertip slid off the end of its face {TIME}",
        has_left,
    ),
    "singular_jacobian": (
        rf"the (?P<finger>.+) finger became (?P<shape>straight|folded) {TIME}",
        is_singular,
    ),
    "joint_limit": (
        rf"joint (?P<joint>\d) of the (?P<finger>.+) finger reached its (?P<end>minimum|maximum), "
        rf"{NUMBER} (?:rad|m) \({KEY}\), {TIME}",
        has_a_joint_at_its_limit,
    ),
    "chatter": (
        r"the contacts chattered: (?P<count>\d+) phase changes within (?P<window>[\d.e-]+) s "
        rf"{TIME}",
        has_chattered,
    ),
    "no_consistent_phase": (
        rf"no combination of .+ is consistent with the torque {TIME}",
        outcome_is(Outcome.INCONSISTENT),
    ),
    "painleve": (
        rf"the reduced inertia is singular: friction is too high for this pose \(Painlevé\) {TIME}",
        outcome_is(Outcome.DIVERGED),
    ),
    "model_estimate_singular": (
        rf"the controller's estimate of the reduced inertia became singular {TIME}",
        has_singular_model,
    ),
    "nonfinite_torque": (
        rf"the torque that the control law commands is not finite {TIME}",
        outcome_is(Outcome.DIVERGED),
    ),
    "turned_too_far": (
        r"the object turned away from its desired attitude by 3.1 rad, where the coordinates of "
        rf"the control law are singular, {TIME}",
        has_turned_too_far,
    ),
    "step_underflow": (
        rf"no step of the integration is small enough: the closed loop diverges {TIME}",
        outcome_is(Outcome.DIVERGED),
    ),
    "unbounded_grasp_force": (
        r"the control law commands grasp forces that grow without bound, at the limit where .+, "
        rf"{TIME}",
        outcome_is(Outcome.DIVERGED),
    ),
    "stiff_loop": (
        r"the closed loop is too stiff: .+ condition number (?P<condition>[\d.e+-]+), "
        rf"{TIME}",
        is_too_stiff,
    ),
    "nonfinite_state": (
        rf"the closed loop diverges: a quantity is no longer finite {TIME}",
        outcome_is(Outcome.DIVERGED),
    ),
    "event_stall": (
        rf"events repeat at one instant without progress in time {TIME}",
        outcome_is(Outcome.LIMIT),
    ),
    "max_steps": (rf"the limit of (?P<count>\d+) steps was reached {TIME}", has_spent_its_steps),
    "stopped": (rf"stopped on request {TIME}", was_stopped),
    "wall_time": (rf"the computing time limit of [\d.]+ s was reached {TIME}", was_stopped),
}


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


def check_lasting_error(result: RunResult, found: re.Match[str]) -> None:
    """Held, the headline does not tell of it, and 0.2 s before it was no more than 1 % larger."""
    errors = np.hypot(*result.trace.tracking_error[:, :2].T)
    earlier = errors[np.searchsorted(result.trace.times, result.end_time - 0.2)]
    assert result.metrics.held and "wanted" not in headline_of(result)
    assert near(found[1], 1e3 * errors[-1], 2) and errors[-1] >= 1e-3
    assert errors[-1] >= 0.99 * earlier


def check_switching(result: RunResult, found: re.Match[str]) -> None:
    assert int(found[1]) == len(result.phase_changes) >= 100 * len(result.scenario.fingers)
    if found[2]:
        commands_the_edge(result, found)


SENTENCES: tuple[tuple[str, Callable[[RunResult, re.Match[str]], None]], ...] = (
    (
        r"(?P<who>.+) slipped (?P<lengths>by .+?|\(.+\))"
        r"(?:(?: and|,) pivoted by (?P<most>up to )?(?P<turned>\d+)°)?"
        r"(?: and (?P<last>last )?stopped at t = (?P<stop>[\d.]+ m?s))?\.",
        check_slips,
    ),
    (
        r"(?P<how>During|As) the push at t = (?P<when>[\d.]+ m?s)(?: ended,)? "
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
        rf"(?P<believed>{NUMBER}){UNIT} instead of (?P<true>{NUMBER}){UNIT}\.",
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
        r"At the end the (?P<finger>.+) fingertip presses with (?P<normal>[\d.]+) N; with (?:less "
        r"than (?P<least>[\d.]+) N|any less) it would slip in this state, and (?:faster motion or "
        r"a push can require more|earlier it slipped at up to (?P<most>[\d.]+) N)\.",
        check_squeeze,
    ),
    *KNOWLEDGE,
)


def check_hint(result: RunResult, hint: str) -> None:
    """Every option can be followed: it exists, its law uses it, and it is not so already."""
    assert hint.endswith(".")
    left = hint[:1].lower() + hint[1:-1]
    for pattern, check in OPTIONS:
        for found in re.finditer(pattern, left):
            check(result, found)
        left = re.sub(pattern, "", left)
    for phrase in PHRASES:
        left = left.replace(phrase, "")
    assert not re.sub(r"\bor\b|\band\b|[,; ]", "", left), f"{left!r} of {hint!r}"


def definition(result: RunResult, key: str) -> Any:
    present = at(result, result.end_time)
    defined = parameter_definitions(present)
    assert key in defined or f"{key}.0" in defined, key
    head, _, name = key.partition(".")
    if head == "controller":
        assert name in CONTROLLERS[present.controller.kind] | FEEDBACK, key
    return defined.get(key)


def can_be_raised(result: RunResult, found: re.Match[str]) -> None:
    parameter = definition(result, found[1])
    assert near(found[2], parameter.value, 6)
    assert parameter.maximum is None or parameter.value < parameter.maximum


def can_be_lowered(result: RunResult, found: re.Match[str]) -> None:
    parameter = definition(result, found[1])
    assert near(found[2], parameter.value, 6)
    assert parameter.minimum is None or parameter.value > parameter.minimum


def is_a_list(result: RunResult, found: re.Match[str]) -> None:
    parameter = definition(result, found[1])
    assert parameter is None or parameter.value is None


def grasps_with_any_force(result: RunResult, found: re.Match[str]) -> None:
    controller = at(result, result.end_time).controller
    comes_with_a_law = "use the composite law" in found.string[: found.start()]
    assert controller.grasp_force == "none"
    assert comes_with_a_law or controller.kind in GRIPPING_BY_FRICTION


def is_continuous(result: RunResult, _found: re.Match[str]) -> None:
    period = at(result, result.end_time).controller.control_period
    assert period == 0.0 or period > 0.001


def puts_forces_on_cones(result: RunResult, _found: re.Match[str]) -> None:
    controller = at(result, result.end_time).controller
    assert controller.distribution != "hold" and controller.kind in GRIPPING_BY_FRICTION


def is_late(result: RunResult, _found: re.Match[str]) -> None:
    controller = at(result, result.end_time).controller
    assert controller.latency > 0.0 and not controller.prediction


def commands_the_edge(result: RunResult, _found: re.Match[str]) -> None:
    controller = at(result, result.end_time).controller
    assert controller.grip_safety == 1.0 and controller.control_period > 0.0


def is_set_otherwise(result: RunResult, found: re.Match[str]) -> None:
    assert getattr(at(result, result.end_time).controller, found[1]) != float(found[2])


def is_held_well(result: RunResult, found: re.Match[str]) -> None:
    """Held, with little slip and no error that the headline tells; from what there is, to less."""
    frictions = [finger.friction for finger in at(result, result.end_time).fingers]
    assert result.metrics.held and max(result.metrics.slip_path) < 1e-4
    assert headline_of(result) == "Held"
    if max(frictions) > 0.0:
        assert found[1] == "fingers.*.friction" and near(found[2], max(frictions), 6)
        assert float(found[3]) < float(found[2])


def has_another_law(result: RunResult, _found: re.Match[str]) -> None:
    assert law_of(result, result.end_time) != "composite"


def has_no_such_bounds(result: RunResult, found: re.Match[str]) -> None:
    present = at(result, result.end_time)
    assert present.controller.kind in LEARNING
    for place, bound in re.findall(r"estimates\.(\d+)\.(minimum|maximum)", found[0]):
        assert getattr(present.estimates[int(place)], bound) is None


def is_far_from_the_truth(result: RunResult, found: re.Match[str]) -> None:
    scenario, law = result.scenario, law_of(result, result.end_time)
    for place, told in re.findall(rf"estimates\.(\d+)\.initial nearer to {NUMBER}", found[0]):
        estimate = scenario.estimates[int(place)]
        true = float(parameter_definitions(scenario)[estimate.parameter].value)
        assert near(told, true)
        assert (
            estimate.initial <= 0.0 or max(estimate.initial / true, true / estimate.initial) > 1.29
        )
        assert "friction" not in estimate.parameter or law in GRIPPING_BY_FRICTION


def believes_in_more(result: RunResult, found: re.Match[str]) -> None:
    assert result.scenario.controller.kind in GRIPPING_BY_FRICTION or result.scenario.changes
    for place, told in re.findall(rf"estimates\.(\d+)\.initial below {NUMBER}", found[0]):
        estimate = result.scenario.estimates[int(place)]
        assert KIND.fullmatch(estimate.parameter)[1], "only of friction can be believed too much"
        assert estimate.initial > float(told)
        assert estimate.minimum is None or estimate.minimum < float(told)


def some_friction_is_left(result: RunResult, _found: re.Match[str]) -> None:
    assert any(finger.friction > 0.0 for finger in result.scenario.fingers)


def is_length_of_the_face(result: RunResult, found: re.Match[str]) -> None:
    face = result.scenario.fingers[result.reason.contact].face
    expected = "object.half_width" if face in ("top", "bottom") else "object.face_half_length"
    assert found[1] == ("object.corners" if face.startswith("edge") else expected)


def is_base_of_the_finger(result: RunResult, found: re.Match[str]) -> None:
    contact = result.reason.contact
    assert found[1] == result.scenario.finger_names[contact]
    assert int(found[2]) == contact


OPTIONS: tuple[tuple[str, Callable[[RunResult, re.Match[str]], None]], ...] = (
    (rf"raise {KEY} above {NUMBER}{UNIT}", can_be_raised),
    (rf"lower {KEY} below {NUMBER}{UNIT}", can_be_lowered),
    (r"lower fingers\.\*\.friction", some_friction_is_left),
    (rf"(?:raise|lower) {KEY}", is_a_list),
    (r"set controller\.grasp_force to minimum", grasps_with_any_force),
    (r"set controller\.control_period to 0\.001 s", is_continuous),
    (r"use the composite law", has_another_law),
    (r"set controller\.distribution to hold", puts_forces_on_cones),
    (r"set controller\.prediction to true", is_late),
    (r"set controller\.grip_safety to 1\.05", commands_the_edge),
    (rf"set controller\.(position_gain|velocity_gain) to {NUMBER}{UNIT}", is_set_otherwise),
    (
        r"find out how (?:little friction is enough|heavy it may be): slipgrasp margin SCENARIO "
        rf"--over '{KEY}' --from {NUMBER} --to {NUMBER}",
        is_held_well,
    ),
    (r"change simulation\.relative_tolerance a little", lambda _result, _found: None),
    (r"give the estimates bounds \([^)]*first\)", has_no_such_bounds),
    (
        rf"set (?:(?:, | and )?estimates\.\d+\.initial nearer to {NUMBER}{UNIT})+ \(the truth\)",
        is_far_from_the_truth,
    ),
    (rf"set (?:(?:, | and )?estimates\.\d+\.initial below {NUMBER})+", believes_in_more),
    (r"use a longer face \((.+?)\)", is_length_of_the_face),
    (
        r"move the base of the (.+?) finger \(fingers\.(\d)\.base\)",
        is_base_of_the_finger,
    ),
)
"""Options of a hint, each with what makes it worth trying."""
PHRASES = (
    "to stop the slip earlier",
    "choose a motion within its reach (trajectory)",
    "change the pose",
    "no other setting of this law can help: make the object lighter or its faces rougher",
    "to see whether it stays at rest",
    "to bring it nearer to its target",
    "which can also make it worse",
    "for less slip",
    "run it again to see the rest",
    "shorten the run",
    "raise the limit",
    "simulate its scenario again",
)
