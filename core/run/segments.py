"""The parts of a face along which friction is the same: between the edges of its patches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from slipgrasp.core.scenario import FingerParameters, ObjectParameters, Patch
from slipgrasp.core.scenario.geometry import contact_frame

# On an edge [m]: both fingertips of a symmetric hand cross theirs at one instant.
EDGE_WIDTH = 1e-11


class Segment(NamedTuple):
    """A part of a face without an edge inside.

    Attributes:
        start: Slip of the fingertip at its lower end [m].
        end: The same at its upper end [m].
        factor: What friction is multiplied by there.
    """

    start: float
    end: float
    factor: float


def segments_of(
    body: ObjectParameters, finger: FingerParameters, patches: Sequence[Patch]
) -> tuple[Segment, ...]:
    """The face that a finger touches, cut at the edges of its patches, from its lower end.

    Args:
        body: The object.
        finger: The finger.
        patches: What lies on the object at that time; those on other faces do not count.
    """
    frame = contact_frame(body, finger)
    spans = [_span(patch, finger) for patch in patches if patch.face == finger.face]
    first, last = frame.slip_minimum, frame.slip_maximum
    inner = {edge for start, end, _ in spans for edge in (start, end) if first < edge < last}
    edges = [first, *sorted(inner), last]
    return tuple(Segment(start, end, _factor(start, end, spans)) for start, end in pairwise(edges))


def segment_at(segments: Sequence[Segment], slip: float, velocity: float) -> int:
    """Index of the segment that a fingertip is on, or slides onto.

    At rest on an edge it has the smaller of both frictions.

    Args:
        segments: Of its face.
        slip: Where it is [m].
        velocity: Its slip velocity [m/s].
    """
    touched = [
        k
        for k, segment in enumerate(segments)
        if segment.start - EDGE_WIDTH <= slip <= segment.end + EDGE_WIDTH
    ]
    if not touched:
        return 0 if slip < segments[0].start else len(segments) - 1
    if velocity != 0.0:
        return touched[-1] if velocity > 0.0 else touched[0]
    return min(touched, key=lambda k: segments[k].factor)


def _span(patch: Patch, finger: FingerParameters) -> Segment:
    """A patch in terms of the slip of a finger on its face."""
    middle = patch.centre - finger.contact_offset
    return Segment(middle - patch.half_length, middle + patch.half_length, patch.friction_factor)


def _factor(start: float, end: float, spans: Sequence[Segment]) -> float:
    """The product of what covers a segment, the same however the patches are listed."""
    return math.prod(sorted(s.factor for s in spans if s.start <= start and end <= s.end))
