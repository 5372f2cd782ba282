"""Text for the endings of a run by physics, the law or a limit (docs/model.md, Outcomes)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from slipgrasp.core.kernel.loop.status import (
    CHATTERING,
    EVENT_STALL,
    INCONSISTENT,
    JOINT_LIMIT,
    LARGEST_TILT,
    LEFT_FACE,
    MAX_STEPS,
    MODEL_SINGULAR,
    NOT_FINITE,
    PAINLEVE,
    SEPARATED,
    SINGULAR,
    STEP_UNDERFLOW,
    STIFF,
    TORQUE_NOT_FINITE,
    TURNED_TOO_FAR,
    UNBOUNDED_FORCE,
)
from slipgrasp.core.scenario import HandScenario, Scenario
from slipgrasp.core.scenario.chain import margins, range_of
from slipgrasp.core.scenario.numerics import Simulation
from slipgrasp.core.scenario.scenario import FreeScenario, of_hand
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome, Reason
from slipgrasp.core.words import ending_hints as suggest
from slipgrasp.core.words.ending_hints import End, nearest_edge
from slipgrasp.core.words.hints import Hint
from slipgrasp.core.words.misbelief import describe_misbelief
from slipgrasp.core.words.options import Option
from slipgrasp.core.words.phrases import joined
from slipgrasp.core.words.sliding import reason_of_slide

_SINGULAR_ESTIMATE = 1e6
_NO_FORCE = 1e-6
_LATE = 0.002  # [s]
_HUGE = 100.0  # multiple of the weight of the object
_GRAVITY = 9.81
_PITCHES = 2  # joints of a finger that turn in one plane; the other one is at its base
_STRAIGHT = 2e-3  # sine of the last joint of a finger that is nearly straight or folded


class _Finding(NamedTuple):
    """Description of an ending, with the offending quantity and its limit, if any, in SI units."""

    message: str
    value: float | None = None
    limit: float | None = None


@dataclass(frozen=True, slots=True)
class _Ending:
    """Text for a status of the kernel that ends a run.

    Attributes:
        outcome: Its outcome.
        code: Code of its reason.
        explain: Description: a sentence with placeholders (`end_blanks`), or a function if the text
            depends on more.
        hint: Returns the suggestion.
        of_one_contact: Whether a single contact or finger is responsible.
        by_the_torque: Whether other torques could have prevented it; the reason then mentions
            saturated joints and the worst estimate.
    """

    outcome: Outcome
    code: str
    explain: str | Callable[[End], _Finding]
    hint: Callable[[End], Hint]
    of_one_contact: bool = False
    by_the_torque: bool = True


def describe_end(
    status: int, contact: int, start: Scenario, present: Scenario, last: Trace, t: float
) -> tuple[Outcome, Reason]:
    """Outcome and reason for a final status of the kernel.

    Args:
        status: Status of the kernel other than running or reached.
        contact: Contact or finger responsible, -1 if none.
        start: Initial parameters.
        present: Parameters at that time.
        last: Last row of the trace.
        t: Simulation time [s].
    """
    if isinstance(present, FreeScenario):
        known = _ENDINGS[status]
        return known.outcome, reason_of_slide(status, known.code, present, t, contact)
    end = End(start=of_hand(start), scenario=present, last=last, contact=contact)
    if status == STEP_UNDERFLOW and _has_singular_model(end):
        status = MODEL_SINGULAR
    ending = _ENDINGS[status]
    found = _explain(ending, end)
    causes = (_describe_weakness(end), describe_misbelief(present, last))
    message = f"{found.message} at {t:.5g} s"
    reason = Reason(
        code=ending.code,
        message="; ".join([message, *filter(None, causes * ending.by_the_torque)]),
        contact=contact if contact >= 0 and ending.of_one_contact else None,
        time=t,
        value=found.value,
        limit=found.limit,
        hint=str(ending.hint(end)),
    )
    return ending.outcome, reason


class EndWords(NamedTuple):
    """Text for a status of the kernel where Python is not available.

    Attributes:
        outcome: Its outcome.
        code: Code of its reason.
        sentence: Description with the placeholders ``{finger}``, ``{changes}``, ``{window}`` and
            ``{most_steps}``; empty if it depends on more.
    """

    outcome: str
    code: str
    sentence: str


def end_words() -> dict[int, EndWords]:
    """Text for every status by which physics, the law or a limit ends a run."""
    return {
        status: EndWords(
            ending.outcome.value,
            ending.code,
            ending.explain if isinstance(ending.explain, str) else "",
        )
        for status, ending in _ENDINGS.items()
    }


def end_blanks(scenario: Scenario) -> dict[str, str]:
    """Values of the placeholders of `EndWords`, except for the name of the finger."""
    simulation, period = scenario.simulation, scenario.controller.control_period
    # With sampled control, phase changes are counted within one period at most.
    window = min(simulation.chatter_window, period or simulation.chatter_window)
    return {
        "changes": str(simulation.chatter_changes),
        "window": f"{window:g}",
        "most_steps": str(simulation.max_steps),
    }


def hint_for(reason: Reason, start: HandScenario, present: HandScenario, last: Trace) -> Hint:
    """The hint for a reason, with its options; only its text if the reason has an unknown code.

    Args:
        reason: Reason for an early end.
        start: Initial parameters.
        present: Final parameters.
        last: Last row of the trace; empty if a run ended before its first one.
    """
    end, endings = _end_of(reason, start, present, last)
    same = (hint for hint in (each.hint(end) for each in endings) if str(hint) == reason.hint)
    return next(same, Hint((Option(reason.hint),)))


def describe_circumstances(
    reason: Reason, start: HandScenario, present: HandScenario, last: Trace
) -> list[str]:
    """Further causes of an ending that the controller could not prevent, as clauses.

    Args:
        reason: Reason for an early end; its message in a recording does not change.
        start: Initial parameters.
        present: Final parameters.
        last: Last row of the trace; empty if a run ended before its first one.
    """
    end, endings = _end_of(reason, start, present, last)
    if not any(each.by_the_torque for each in endings):
        return []
    return [words for words in (_describe_delay(end), _describe_distribution(end)) if words]


def _end_of(
    reason: Reason, start: HandScenario, present: HandScenario, last: Trace
) -> tuple[End, list[_Ending]]:
    """The end of a run, and the known endings with its code; none without a last row."""
    contact = -1 if reason.contact is None else reason.contact
    end = End(start=start, scenario=present, last=last, contact=contact)
    return end, [each for each in _ENDINGS.values() if each.code == reason.code and len(last)]


def _has_singular_model(end: End) -> bool:
    """Whether the law inverts an estimate of the reduced inertia that is singular."""
    return end.law.uses_friction and bool(
        end.last.estimated_inertia_condition[0] > _SINGULAR_ESTIMATE
    )


def _describe_weakness(end: End) -> str:
    """A clause about a saturated joint; empty if there is none."""
    if end.exhausted is None:
        return ""
    joint, key, limit = end.exhausted
    unit = "N" if joint in end.scenario.sliding_joints else "N m"
    return f"a joint reached its limit {key}, {limit:g} {unit}"


def _describe_delay(end: End) -> str:
    """A clause about the delay of torques; empty if it is short."""
    scenario = of_hand(end.scenario)
    controller, sensing = scenario.controller, scenario.sensing
    if controller.control_period == 0.0:
        return ""
    late = []
    if controller.latency >= _LATE:
        late.append(f"torques act {1e3 * controller.latency:.3g} ms late (controller.latency)")
    if not sensing.true_phases and sensing.slip_delay >= _LATE and end.last.phase.any():
        found = f"slip is detected {1e3 * sensing.slip_delay:.3g} ms late (sensing.slip_delay)"
        late.append(found)
    return joined(late)


def _describe_distribution(end: End) -> str:
    """A clause about the large force of a law near a singularity of its distribution."""
    if not end.law.uses_friction or of_hand(end.scenario).controller.distribution != "exact":
        return ""
    force = float(end.last.normal_force[0].max())
    if not end.last.phase.any() or force < _HUGE * end.scenario.object.mass * _GRAVITY:
        return ""
    return (
        "the law puts the forces of slipping contacts exactly on their cones "
        f"(controller.distribution) and presses with {force:.3g} N"
    )


def _explain(ending: _Ending, end: End) -> _Finding:
    """Description of the ending."""
    if not isinstance(ending.explain, str):
        return ending.explain(end)
    finger = end.finger_name if end.contact >= 0 else ""
    message = ending.explain.format(finger=finger, **end_blanks(end.scenario))
    if ending.code == "painleve":
        return _Finding(message, None, 0.0)
    reached = _REACHED.get(ending.code)
    limit = float(reached(end.scenario.simulation)) if reached else None
    return _Finding(message, limit, limit)


def _explain_separation(end: End) -> _Finding:
    """A normal force that falls to zero, or a contact that the torque can only separate."""
    force = float(end.last.normal_force[0, end.contact]) if end.contact >= 0 else 0.0
    name = f"the {end.finger_name} fingertip" if end.contact >= 0 else "a fingertip"
    if abs(force) > _NO_FORCE:
        message = f"the torque separated {name} from the object"
        return _Finding(message, None, 0.0)
    message = f"the normal force of {name} fell to zero: it separated from the object"
    return _Finding(message, force, 0.0)


def _explain_left_face(end: End) -> _Finding:
    if isinstance(end.scenario, SpatialScenario):
        return _explain_left_edge(end, end.scenario)
    slip = float(end.last.slip[0, end.contact])
    message = f"the {end.finger_name} fingertip slid off the end of its face"
    return _Finding(message, slip, abs(slip))


def _explain_left_edge(end: End, scenario: SpatialScenario) -> _Finding:
    number, distance, _ = nearest_edge(end, scenario)
    face, shape = scenario.fingers[end.contact].face, scenario.object.shape
    where = f"edge {number} of {face}"
    if shape == "sphere":
        where = "the sphere, nearly to the point opposite its start"
    elif shape == "cylinder":
        where = "the end of the cylinder" if face.startswith("side") else f"the rim of {face}"
    return _Finding(f"the {end.finger_name} fingertip slid over {where}", distance, 0.0)


def _explain_singular(end: End) -> _Finding:
    if end.scenario.fingers[end.contact].kind == "chain":
        message = f"the {end.finger_name} finger became singular, or cannot reach its contact"
        return _Finding(message, None, None)
    joints = end.last.shape.joints_per_finger
    angle = float(end.last.joint_position[0, joints * end.contact + joints - 1])
    if joints > _PITCHES and abs(math.sin(angle)) > _STRAIGHT:
        message = f"the tip of the {end.finger_name} finger reached the axis of its base"
        return _Finding(message, None, None)
    became = "straight" if math.cos(angle) > 0.0 else "folded"
    return _Finding(f"the {end.finger_name} finger became {became}", angle, 0.0)


def _explain_joint_limit(end: End) -> _Finding:
    joints = of_hand(end.scenario).fingers[end.contact].chain.joints
    count = end.last.shape.joints_per_finger
    moved = end.last.joint_position[0, count * end.contact : count * (end.contact + 1)]
    left = margins(joints, moved)
    joint, side = divmod(int(left.argmin()), 2)
    limit, end_name = range_of(joints[joint])[side], ("minimum", "maximum")[side]
    unit = "m" if joints[joint].kind == "prismatic" else "rad"
    message = (
        f"joint {joint + 1} of the {end.finger_name} finger reached its {end_name}, "
        f"{limit:g} {unit} (fingers.{end.contact}.joints.{joint}.{end_name}),"
    )
    beyond = float(left[joint, side])
    return _Finding(message, limit - beyond if side else limit + beyond, limit)


# Limit that was reached by endings whose text is a sentence with placeholders.
_REACHED: dict[str, Callable[[Simulation], float]] = {
    "chatter": lambda simulation: simulation.chatter_changes,
    "max_steps": lambda simulation: simulation.max_steps,
}


def _explain_singular_model(end: End) -> _Finding:
    condition = float(end.last.estimated_inertia_condition[0])
    return _Finding("the controller's estimate of the reduced inertia became singular", condition)


def _explain_turn(end: End) -> _Finding:
    tilt = math.hypot(*end.last.tracking_error[0, 3:].tolist())
    message = (
        f"the object turned away from its desired attitude by {LARGEST_TILT:g} rad, where the "
        "coordinates of the control law are singular,"
    )
    return _Finding(message, tilt, LARGEST_TILT)


def _explain_stiffness(end: End) -> _Finding:
    condition = float(end.last.estimated_inertia_condition[0])
    message = (
        "the closed loop is too stiff: its average step became too short, "
        "while the controller's estimate of the reduced inertia has the condition "
        f"number {condition:.2g},"
    )
    return _Finding(message, condition)


_ENDINGS = {
    SEPARATED: _Ending(
        Outcome.SEPARATED,
        "contact_separation",
        _explain_separation,
        suggest.hold_better,
        of_one_contact=True,
    ),
    LEFT_FACE: _Ending(
        Outcome.LEFT_FACE,
        "contact_left_face",
        _explain_left_face,
        suggest.stop_before_the_edge,
        of_one_contact=True,
    ),
    SINGULAR: _Ending(
        Outcome.SINGULAR,
        "singular_jacobian",
        _explain_singular,
        suggest.stay_within_reach,
        of_one_contact=True,
        by_the_torque=False,
    ),
    JOINT_LIMIT: _Ending(
        Outcome.SINGULAR,
        "joint_limit",
        _explain_joint_limit,
        suggest.stay_within_reach,
        of_one_contact=True,
        by_the_torque=False,
    ),
    CHATTERING: _Ending(
        Outcome.CHATTERING,
        "chatter",
        "the contacts chattered: {changes} phase changes within {window} s",
        suggest.avoid_chatter,
    ),
    INCONSISTENT: _Ending(
        Outcome.INCONSISTENT,
        "no_consistent_phase",
        "no combination of stick and slip is consistent with the torque",
        suggest.allow_a_solution,
    ),
    PAINLEVE: _Ending(
        Outcome.DIVERGED,
        "painleve",
        "the reduced inertia is singular: friction is too high for this pose (Painlevé)",
        suggest.leave_painleve,
        by_the_torque=False,
    ),
    MODEL_SINGULAR: _Ending(
        Outcome.DIVERGED,
        "model_estimate_singular",
        _explain_singular_model,
        suggest.keep_the_model_regular,
    ),
    TORQUE_NOT_FINITE: _Ending(
        Outcome.DIVERGED,
        "nonfinite_torque",
        "the torque that the control law commands is not finite",
        suggest.keep_the_model_regular,
    ),
    TURNED_TOO_FAR: _Ending(Outcome.DIVERGED, "turned_too_far", _explain_turn, suggest.hold_better),
    STEP_UNDERFLOW: _Ending(
        Outcome.DIVERGED,
        "step_underflow",
        "no step of the integration is small enough: the closed loop diverges",
        suggest.calm_the_loop,
    ),
    UNBOUNDED_FORCE: _Ending(
        Outcome.DIVERGED,
        "unbounded_grasp_force",
        (
            "the control law commands grasp forces that grow without bound, at the limit where its "
            "friction cones become or cease to be satisfiable,"
        ),
        suggest.calm_the_loop,
    ),
    STIFF: _Ending(Outcome.DIVERGED, "stiff_loop", _explain_stiffness, suggest.calm_the_loop),
    NOT_FINITE: _Ending(
        Outcome.DIVERGED,
        "nonfinite_state",
        "the closed loop diverges: a quantity is no longer finite",
        suggest.calm_the_loop,
        by_the_torque=False,
    ),
    EVENT_STALL: _Ending(
        Outcome.LIMIT,
        "event_stall",
        "events repeat at one instant without progress in time",
        suggest.pass_the_instant,
        by_the_torque=False,
    ),
    MAX_STEPS: _Ending(
        Outcome.LIMIT,
        "max_steps",
        "the limit of {most_steps} steps was reached",
        suggest.take_fewer_steps,
        by_the_torque=False,
    ),
}
