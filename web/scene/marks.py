"""Where the marks of a contact stand: fingertip, slip trail, force, slip velocity, cones.

All of it is plain geometry in the axes of the object, so that a node that moves with the object
carries them along. The same marks are drawn twice: small, on the hand, and magnified in a lens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.geometry import ContactFrame
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.layout import SceneLayout, nice_at_least
from slipgrasp.web.scene.shapes import arc

Points = NDArray[np.float64]

_DASHES = 8
_USUAL_INNER_RADIUS = 0.05
_LEAST_FULL_FORCE = 1.0
_LEAST_FULL_SPEED = 1e-3


class MarkSizes(NamedTuple):
    """Sizes of the marks in one picture [m]; ``depth`` is how near the eye they are drawn."""

    tip_radius: float
    trail_width: float
    cone_length: float
    force_length: float
    speed_length: float
    shaft_radius: float
    line_width: float
    depth: float


class FullScale(NamedTuple):
    """What an arrow of full length stands for: a force [N], a slip velocity [m/s]."""

    force: float
    speed: float


class ContactMarks(NamedTuple):
    """The marks of one contact, in the axes of the object [m].

    Attributes:
        tip: Where the fingertip touches, seen from the spot touched first.
        trail: From that spot to the farthest one backward, and forward, shape ``(2, 2, 2)``;
            it lies inside the face.
        force: The arrow of the force on the object, seen from the fingertip.
        motion: The arrow of the slip velocity beside the fingertip, seen from there,
            shape ``(2, 2)``.
    """

    tip: Points
    trail: Points
    force: Points
    motion: Points


def sizes_on_hand(inner_radius: float) -> MarkSizes:
    """Sizes of the marks on the hand itself.

    Args:
        inner_radius: How near its centre the object's faces come [m]; cones must not meet there.
    """
    share = min(max(inner_radius / _USUAL_INNER_RADIUS, 0.4), 1.4)
    return MarkSizes(
        tip_radius=0.011 * share,
        trail_width=0.008 * share,
        cone_length=0.9 * inner_radius,
        force_length=0.08 * share,
        speed_length=0.1 * share,
        shaft_radius=0.003 * share,
        line_width=0.002 * share,
        depth=0.06,
    )


def sizes_in_lens(radius: float) -> MarkSizes:
    """Sizes of the marks in a lens of a radius [m]."""
    return MarkSizes(
        tip_radius=0.085 * radius,
        trail_width=0.1 * radius,
        cone_length=0.58 * radius,
        force_length=0.65 * radius,
        speed_length=0.5 * radius,
        shaft_radius=0.02 * radius,
        line_width=0.012 * radius,
        depth=0.07,
    )


def contact_marks(
    sample: Sample,
    index: int,
    frame: ContactFrame,
    magnification: float,
    sizes: MarkSizes,
    full: FullScale,
) -> ContactMarks:
    """Where the marks of one contact stand.

    Args:
        sample: The instant shown.
        index: The contact.
        frame: Its anchor, tangent and normal in the object frame.
        magnification: How much larger than life slip is drawn.
        sizes: Sizes of the marks.
        full: What an arrow of full length stands for.
    """
    tangent, normal = np.asarray(frame.tangent), np.asarray(frame.normal)
    beside = -3.6 * sizes.tip_radius * normal
    half_speed = 0.5 * sizes.speed_length / full.speed * sample.slip_velocity[index] * tangent
    visited = np.zeros((2, 2, 2))
    visited[:, 1] = magnification * sample.slip_reach[index][:, None] * tangent
    force = sample.normal_force[index] * normal - sample.tangential_force[index] * tangent
    return ContactMarks(
        tip=magnification * sample.slip[index] * tangent,
        trail=visited + 0.5 * sizes.trail_width * normal,
        force=sizes.force_length / full.force * force,
        motion=np.array([beside - half_speed, beside + half_speed]),
    )


def cone_edges(friction: float, frame: ContactFrame, length: float) -> Points:
    """Ends of both edges of a friction cone, seen from the fingertip, shape ``(2, 2)`` [m]."""
    tangent, normal = np.asarray(frame.tangent), np.asarray(frame.normal)
    edges = np.array([normal + friction * tangent, normal - friction * tangent])
    return length / math.hypot(1.0, friction) * edges


def cone_outline(friction: float, frame: ContactFrame, length: float) -> Points:
    """A friction cone as a slice of a disc about the fingertip, shape ``(k, 2)`` [m]."""
    middle = math.atan2(frame.normal[1], frame.normal[0])
    half = math.atan(friction)
    rim = arc(length, middle - half, middle + half, 16)
    return np.concatenate([np.zeros((1, 2)), rim])


def dashed(ends: Points) -> Points:
    """Dashes from the fingertip to each of some ends, shape ``(dashes, 2, 2)`` [m]."""
    steps = np.linspace(0.0, 1.0, 2 * _DASHES).reshape(1, _DASHES, 2, 1)
    return (steps * ends[:, None, None, :]).reshape(-1, 2, 2)


@dataclass(frozen=True, slots=True, eq=False)
class RunFacts:
    """What the marks of a run need besides its instants.

    Attributes:
        full: What an arrow of full length stands for.
        beliefs: Where the estimate of each friction coefficient stands, None if it is known.
        magnification: How much larger than life the lenses show slip.
    """

    full: FullScale
    beliefs: tuple[int | None, ...]
    magnification: float

    def believed(self, sample: Sample, contact: int) -> float | None:
        """What the controller believes a friction coefficient to be, None if it knows it."""
        place = self.beliefs[contact]
        return None if place is None else max(float(sample.estimates[place]), 0.0)


def run_facts(result: RunResult, layout: SceneLayout, force_scale: float) -> RunFacts:
    """What the marks of a run need.

    Args:
        result: The run.
        layout: Where everything is.
        force_scale: How much longer than usual the user wants the arrows of forces.
    """
    full = full_scale(result)
    return RunFacts(
        full=full._replace(force=full.force / force_scale),
        beliefs=beliefs_of(result),
        magnification=layout.magnification,
    )


def beliefs_of(result: RunResult) -> tuple[int | None, ...]:
    """Where the estimate of each contact's friction stands, None where it is known."""
    unknowns = result.trace.shape.unknowns
    keys = [f"fingers.{i}.friction" for i in range(len(result.scenario.fingers))]
    return tuple(unknowns.index(key) if key in unknowns else None for key in keys)


def push_words(force: float, moment: float) -> str:
    """What pushes the object [N, N m], such as ``push 5 N, 0.1 N m``."""
    told = [f"{force:.3g} N"] if force else []
    told += [f"{moment:.3g} N m"] if moment else []
    return "push " + ", ".join(told)


def full_scale(result: RunResult) -> FullScale:
    """What arrows of full length stand for.

    Round numbers, so that arrows of similar runs compare; a short peak may be longer.
    """
    forces = np.abs(result.trace.normal_force)
    usual = max(float(np.median(forces, axis=0).max()), 0.4 * float(forces.max()))
    speed = float(np.abs(result.trace.slip_velocity).max())
    return FullScale(
        nice_at_least(max(usual, _LEAST_FULL_FORCE)), nice_at_least(max(speed, _LEAST_FULL_SPEED))
    )
