"""Schedules: sequences of segments with constant parameters.

A segment ends at a given instant (a timed change, or the start or end of a pulse or patch) or when
a fingertip crosses the edge of a patch: friction is constant along a face between the edges of its
patches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise, takewhile
from typing import Generic, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.scenario import (
    Change,
    FingerParameters,
    ObjectParameters,
    Patch,
    PlanarScenario,
    Scenario,
)
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.scenario import AnyScenario, is_acting, is_there

Floats = NDArray[np.float64]

# Distance that counts as zero [m]: the fingertips of a symmetric hand cross edges together.
EDGE_WIDTH = 1e-11


class Timetable(Generic[AnyScenario]):
    """The successive segments of a run, for any hand.

    Args:
        scenario: Simulated scenario.

    Attributes:
        present: The scenario with the timed changes so far, and without later ones.
    """

    def __init__(self, scenario: AnyScenario) -> None:
        duration = scenario.simulation.duration
        self.present = replace(scenario, changes=()) if scenario.changes else scenario
        self.begin = 0.0
        self._changes = sorted(scenario.changes, key=lambda change: change.time)
        self._ends = [*sorted({t for t in _instants(scenario) if 0.0 < t < duration}), duration]

    @property
    def stretch_end(self) -> float:
        """Latest end of the current segment [s]."""
        return self._ends[0]

    @property
    def is_last(self) -> bool:
        """True if the current segment is the last."""
        return len(self._ends) == 1

    def end_stretch(self) -> list[Change]:
        """Switches to the next segment.

        Returns:
            The timed changes at its start.
        """
        self.begin = self._ends.pop(0)
        due = list(takewhile(lambda change: change.time == self.begin, self._changes))
        if due:
            self._changes = self._changes[len(due) :]
            values = {change.parameter: _plain(change) for change in due}
            self.present = with_values(self.present, values, with_law=False)
        return due


class Schedule(Timetable[PlanarScenario]):
    """The segments of a run of a planar hand, whose fingertips may cross edges of patches.

    Attributes:
        table: The current scenario as a table of numbers.
    """

    def __init__(self, scenario: PlanarScenario) -> None:
        super().__init__(scenario)
        n = len(scenario.fingers)
        self.table = make_table(self.present)
        self._faces: list[tuple[Segment, ...]] = [()] * n
        self._places = [0] * n
        self._lay_patches(np.zeros(n), np.zeros(n))

    def pack(self) -> Record:
        """The constants of the current segment, for the kernel."""
        stretch = whole_faces()
        stretch.load += self.load()
        if self.present.patches:
            segments = [face[k] for face, k in zip(self._faces, self._places, strict=True)]
            ends = stretch.slip_minimum, stretch.slip_maximum, stretch.friction_factor
            for values, array in zip(zip(*segments, strict=True), ends, strict=True):
                array[: len(segments)] = values
        return pack_model(self.table, stretch)

    def load(self) -> Floats:
        """Force and moment of the active pulses in the current segment [N, N, N m]."""
        load = np.zeros(3)
        for pulse in self.present.pulses:
            if is_acting(pulse, self.begin):
                load += [*pulse.force, pulse.moment]
        return load

    def pass_instant(self, slips: Floats, velocities: Floats) -> list[Change]:
        """Switches to the next segment.

        Args:
            slips: Slips of the fingertips, shape ``(n,)`` [m].
            velocities: Their slip velocities, shape ``(n,)`` [m/s].

        Returns:
            The timed changes at its start.
        """
        due = self.end_stretch()
        if due:
            self.table = make_table(self.present)
        self._lay_patches(slips, velocities)
        return due

    def cross_edge(self, contact: int, slips: Floats, velocities: Floats) -> bool:
        """Switches to the segment in which a fingertip has crossed an edge.

        All fingertips that cross an edge at this instant are included.

        Args:
            contact: Contact at the end of its segment.
            slips: Slips of the fingertips, shape ``(n,)`` [m].
            velocities: Their slip velocities, shape ``(n,)`` [m/s].

        Returns:
            False if the face ends there.
        """
        start, end, _ = self._faces[contact][self._places[contact]]
        beyond = self._places[contact] + (1 if slips[contact] > 0.5 * (start + end) else -1)
        if not 0 <= beyond < len(self._faces[contact]):
            return False
        for i, face in enumerate(self._faces):
            if velocities[i] != 0.0:
                self._places[i] = segment_at(face, slips[i], velocities[i])
        self._places[contact] = beyond
        return True

    def _lay_patches(self, slips: Floats, velocities: Floats) -> None:
        """Divides the faces at the current patches, and locates every fingertip."""
        body = self.present.object
        patches = [patch for patch in self.present.patches if is_there(patch, self.begin)]
        for i, finger in enumerate(self.present.fingers):
            before, self._faces[i] = self._faces[i], segments_of(body, finger, patches)
            if _edges(before) != _edges(self._faces[i]):
                self._places[i] = segment_at(self._faces[i], slips[i], velocities[i])


def _edges(face: Sequence[Segment]) -> list[float]:
    return [segment.start for segment in face]


def _instants(scenario: Scenario) -> Iterator[float]:
    """Times at which parameters change."""
    for change in scenario.changes:
        yield change.time
    for pulse in scenario.pulses:
        yield from (pulse.time, pulse.time + pulse.duration)
    for patch in scenario.patches:
        yield patch.start_time
        if patch.end_time is not None:
            yield patch.end_time


def _plain(change: Change) -> object:
    return list(change.value) if isinstance(change.value, tuple) else change.value


class Segment(NamedTuple):
    """A part of a face with constant friction.

    Attributes:
        start: Slip of the fingertip at its lower end [m].
        end: Slip of the fingertip at its upper end [m].
        factor: Friction factor.
    """

    start: float
    end: float
    factor: float


def segments_of(
    body: ObjectParameters, finger: FingerParameters, patches: Sequence[Patch]
) -> tuple[Segment, ...]:
    """Returns the segments of a face between the edges of its patches, from its lower end.

    Args:
        body: The object.
        finger: The finger.
        patches: The current patches; those on other faces are ignored.
    """
    frame = contact_frame(body, finger)
    spans = [_span(patch, finger) for patch in patches if patch.face == finger.face]
    first, last = frame.slip_minimum, frame.slip_maximum
    inner = {edge for start, end, _ in spans for edge in (start, end) if first < edge < last}
    edges = [first, *sorted(inner), last]
    return tuple(Segment(start, end, _factor(start, end, spans)) for start, end in pairwise(edges))


def segment_at(segments: Sequence[Segment], slip: float, velocity: float) -> int:
    """Index of the segment that a fingertip is on, or slides onto.

    At rest on an edge, the smaller friction applies.

    Args:
        segments: Segments of its face.
        slip: Slip of the fingertip [m].
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
    """Range of slip in which a fingertip is on a patch."""
    middle = patch.centre - finger.contact_offset
    return Segment(middle - patch.half_length, middle + patch.half_length, patch.friction_factor)


def _factor(start: float, end: float, spans: Sequence[Segment]) -> float:
    """Product of the factors of the covering patches, independent of their order."""
    return math.prod(sorted(s.factor for s in spans if s.start <= start and end <= s.end))
