"""Data of the marks of contacts: sizes, scales, estimates, and a state for the scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.scene.rotations import Values
from slipgrasp.web.model.colours import glow
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.layout import FullScale

_USUAL_INNER_RADIUS = 0.05


class MarkSizes(NamedTuple):
    """Sizes of the marks in one view [m]; ``depth`` is their offset towards the viewer."""

    tip_radius: float
    trail_width: float
    cone_length: float
    force_length: float
    speed_length: float
    shaft_radius: float
    line_width: float
    depth: float


class Trail(NamedTuple):
    """Path of a fingertip, in slips along the tangents [m].

    Attributes:
        path: For a spatial hand in order; for a planar one its ends and, between them, the initial
            contact point: shape ``(k, d - 1)``.
    """

    path: Values

    @property
    def extent(self) -> Values:
        """Values that change with the trail."""
        ends = self.path[[0, -1]].ravel()
        return np.append(ends, len(self.path))

    @property
    def segments(self) -> Values:
        """Segments of the path, shape ``(k, 2, d - 1)``."""
        path = self.path if len(self.path) > 1 else self.path[[0, 0]]
        return np.stack([path[:-1], path[1:]], axis=1)

    def divided(self, count: int) -> tuple[Values, NDArray[np.uint8]]:
        """The segments of the path with colours, each divided into equal parts.

        Args:
            count: Number of parts.
        """
        segments, ends = self.segments, np.linspace(0.0, 1.0, count + 1)[:, None, None]
        if count == 1:
            return segments, self.colours
        starts, ways = segments[:, 0], segments[:, 1] - segments[:, 0]
        points = (starts + ends * ways).swapaxes(0, 1)
        parts = np.stack([points[:, :-1], points[:, 1:]], axis=2)
        return parts.reshape(-1, *segments.shape[1:]), np.repeat(self.colours, count, axis=0)

    @property
    def colours(self) -> NDArray[np.uint8]:
        """Colours of the ends of the segments, ``(k, 2, 3)``: by direction for a planar hand."""
        if self.path.shape[1] == 1:
            ways = [ContactPhase.SLIP_BACKWARD, ContactPhase.SLIP_FORWARD]
            return np.array([[glow(PHASES[way])] * 2 for way in ways], dtype=np.uint8)
        pieces = (max(len(self.path) - 1, 1), 2, 1)
        return np.tile(np.array(glow(PHASES[ContactPhase.SLIP]), np.uint8), pieces)


def sizes_on_hand(inner_radius: float, front: float = 0.0) -> MarkSizes:
    """Sizes of the marks on the hand itself.

    Args:
        inner_radius: Smallest distance of faces from the centre [m], which limits the cones.
        front: Distance of the marks in front of a planar hand [m].
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
        depth=front,
    )


@dataclass(frozen=True, slots=True, eq=False)
class RunFacts:
    """Constant data of the marks of a run.

    Attributes:
        full: Quantities with an arrow of full length.
        beliefs: Index of the estimate of each friction coefficient, None if it is known.
    """

    full: FullScale
    beliefs: tuple[int | None, ...]

    def believed(self, sample: Sample, contact: int) -> float | None:
        """The estimate of a friction coefficient, None if the controller knows it."""
        place = self.beliefs[contact]
        return None if place is None else np.maximum(sample.estimates[place], 0.0)


def beliefs_of(result: RunResult) -> tuple[int | None, ...]:
    """Index of the estimate of each contact's friction, None if it is known."""
    unknowns = result.trace.shape.unknowns
    keys = [f"fingers.{i}.friction" for i in range(len(result.scenario.fingers))]
    return tuple(unknowns.index(key) if key in unknowns else None for key in keys)


def push_words(force: float, moment: float) -> str:
    """Describes an external wrench [N, N m], such as ``push 5 N, 0.1 N m``."""
    told = [f"{force:.3g} N"] if force else []
    told += [f"{moment:.3g} N m"] if moment else []
    return "push " + ", ".join(told)
