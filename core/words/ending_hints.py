"""Suggestions after the end of a run by physics, the law or a limit."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import edges_of, spatial_contact
from slipgrasp.core.words.cures import bound_estimates, hold, sample_control
from slipgrasp.core.words.hints import Hint, Situation, any_of
from slipgrasp.core.words.options import lower, lower_all_friction, only_words, raise_
from slipgrasp.core.words.placement import is_far_off


@dataclass(frozen=True, slots=True, kw_only=True)
class End(Situation):
    """An end of a run: its state, and the contact or finger responsible, -1 if none."""

    contact: int

    @property
    def finger_name(self) -> str:
        """Name of the finger responsible."""
        return self.scenario.finger_names[self.contact]


def nearest_edge(end: End, scenario: SpatialScenario) -> tuple[int, float, bool]:
    """Number of the nearest edge, its distance [m], and whether it lies along the first tangent.

    The first tangent of a side points up: such an edge bounds its width, others bound its height.
    """
    at = 2 * end.contact
    slip = (float(end.last.slip[0, at]), float(end.last.slip[0, at + 1]))
    edges = edges_of(spatial_contact(scenario.object, scenario.fingers[end.contact]).outline)
    distances = [a * slip[0] + b * slip[1] + c for a, b, c in edges]
    number = distances.index(min(distances))
    return number, distances[number], abs(edges[number][0]) < abs(edges[number][1])


def hold_better(end: End, instead: str = "") -> Hint:
    """Options that hold the object better; ``instead`` is a change outside the controller."""
    return any_of(hold(end), instead=instead)


def stop_before_the_edge(end: End) -> Hint:
    """Options that end the slip earlier, or a longer face."""
    return any_of(
        hold(end),
        purpose="to stop the slip earlier",
        instead=f"use a longer face ({_length_of_face(end)})",
    )


def _length_of_face(end: End) -> str:
    """The parameter that extends the face at the end where the fingertip left it."""
    scenario, face = end.scenario, end.scenario.fingers[end.contact].face
    if not isinstance(scenario, SpatialScenario):
        return "object.corners" if face.startswith("edge") else _LENGTH_OF_FACE[face]
    is_side, shape = face.startswith("side"), scenario.object.shape
    if shape == "sphere" or (shape == "cylinder" and not is_side):
        return "object.radius"
    _, _, bounds_width = nearest_edge(end, scenario)
    if is_side and not bounds_width:
        return "object.height"
    if scenario.object.corners:
        return "object.corners"
    along_y = face in ("side-1", "side-3") or (not is_side and bounds_width)
    return "object.half_depth" if along_y else "object.half_width"


_LENGTH_OF_FACE = {
    "left": "object.face_half_length",
    "right": "object.face_half_length",
    "bottom": "object.half_width",
    "top": "object.half_width",
}


def stay_within_reach(end: End) -> Hint:
    """Another base or motion; a better grip if the object is far from its desired pose."""
    reach = f"move the base of the {end.finger_name} finger (fingers.{end.contact}.base)"
    if is_far_off(end.scenario.object, end.last.tracking_error[0].tolist()):
        return hold_better(end, instead=reach)
    words = only_words(reach, "choose a motion within its reach (trajectory)")
    return any_of(words, risky=hold(end))


def avoid_chatter(end: End) -> Hint:
    """Sampled control, or a better grip."""
    return any_of(sample_control(end), hold(end))


def allow_a_solution(end: End) -> Hint:
    """Options with which some combination of phases is consistent."""
    friction = lower_all_friction(end.scenario)
    return any_of(sample_control(end), hold(end), friction, only_words("change the pose"))


def leave_painleve(end: End) -> Hint:
    """Options with which the reduced inertia is regular."""
    return any_of(lower_all_friction(end.scenario), hold(end), only_words("change the pose"))


def keep_the_model_regular(end: End) -> Hint:
    """Bounds and slower learning, in addition to general suggestions for holding."""
    slower = [hint for key in end.law.learns_with for hint in lower(end.scenario, key)]
    return any_of(hold(end), bound_estimates(end), slower, otherwise="change the pose")


def calm_the_loop(end: End) -> Hint:
    """Lower gains, or sampled control."""
    smaller = (lower(end.scenario, key) for key in end.law.gains)
    return any_of(*smaller, sample_control(end), hold(end))


def pass_the_instant(end: End) -> Hint:
    """Options that move the steps of the integration."""
    return any_of(only_words("change simulation.relative_tolerance a little"), sample_control(end))


def take_fewer_steps(end: End) -> Hint:
    """A larger limit, or a shorter run."""
    return any_of(
        raise_(end.scenario, "simulation.max_steps"), lower(end.scenario, "simulation.duration")
    )
