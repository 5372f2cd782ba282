"""What holds when: a run is a sequence of stretches in which its constants do not change.

A stretch ends at an instant known beforehand (a timed change, a pulse or a patch that
comes or goes) or where a fingertip slides over the edge of a patch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.kernel.model import pack_model
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.run.segments import Segment, segment_at, segments_of
from slipgrasp.core.scenario import Change, Patch, Pulse, Scenario
from slipgrasp.core.scenario.loading import with_values

Floats = NDArray[np.float64]


class Schedule:
    """The stretches of a run, one after another.

    Args:
        scenario: What is simulated.

    Attributes:
        present: The scenario with the timed changes so far, and without those to come.
    """

    def __init__(self, scenario: Scenario) -> None:
        n, duration = len(scenario.fingers), scenario.simulation.duration
        self.present = replace(scenario, changes=())
        self._changes = sorted(scenario.changes, key=lambda change: change.time)
        self._ends = [*sorted({t for t in _instants(scenario) if 0.0 < t < duration}), duration]
        self._begin = 0.0
        self._faces: list[tuple[Segment, ...]] = [()] * n
        self._places = [0] * n
        self._lay_patches(np.zeros(n), np.zeros(n))

    @property
    def stretch_end(self) -> float:
        """When the present stretch ends at the latest [s]."""
        return self._ends[0]

    @property
    def is_last(self) -> bool:
        """Whether the run ends with the present stretch."""
        return len(self._ends) == 1

    def pack(self) -> Record:
        """The constants of the present stretch, for the kernel."""
        model = pack_model(self.present)
        for pulse in self.present.pulses:
            if _is_acting(pulse, self._begin):
                model["load"] += [*pulse.force, pulse.moment]
        hand, truth = model["hand"], model["truth"]
        for i, (face, place) in enumerate(zip(self._faces, self._places, strict=True)):
            start, end, factor = face[place]
            hand["slip_minimum"][i], hand["slip_maximum"][i] = start, end
            truth["friction"][i] *= factor
            truth["static_friction"][i] *= factor
        return model

    def pass_instant(self, slips: Floats, velocities: Floats) -> list[Change]:
        """Goes over to the stretch that begins where the present one ends.

        Args:
            slips: Where the fingertips are, shape ``(n,)`` [m].
            velocities: Their slip velocities, shape ``(n,)`` [m/s].

        Returns:
            The timed changes that take place.
        """
        self._begin = self._ends.pop(0)
        due = list(takewhile(lambda change: change.time == self._begin, self._changes))
        if due:
            self._changes = self._changes[len(due) :]
            values = {change.parameter: _plain(change) for change in due}
            self.present = with_values(self.present, values)
        self._lay_patches(slips, velocities)
        return due

    def cross_edge(self, contact: int, slips: Floats, velocities: Floats) -> bool:
        """Goes over to the stretch in which a fingertip is on the other side of an edge.

        All that slide over an edge at this instant do so together.

        Args:
            contact: Which has reached the end of its segment.
            slips: Where the fingertips are, shape ``(n,)`` [m].
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
        """Cuts the faces at the patches of now, and finds every fingertip on its own."""
        body = self.present.object
        patches = [patch for patch in self.present.patches if _is_there(patch, self._begin)]
        for i, finger in enumerate(self.present.fingers):
            before, self._faces[i] = self._faces[i], segments_of(body, finger, patches)
            if _edges(before) != _edges(self._faces[i]):
                self._places[i] = segment_at(self._faces[i], slips[i], velocities[i])


def _edges(face: Sequence[Segment]) -> list[float]:
    return [segment.start for segment in face]


def _instants(scenario: Scenario) -> Iterator[float]:
    """When something changes."""
    for change in scenario.changes:
        yield change.time
    for pulse in scenario.pulses:
        yield from (pulse.time, pulse.time + pulse.duration)
    for patch in scenario.patches:
        yield patch.start_time
        if patch.end_time is not None:
            yield patch.end_time


def _is_acting(pulse: Pulse, t: float) -> bool:
    return pulse.time <= t < pulse.time + pulse.duration


def _is_there(patch: Patch, t: float) -> bool:
    return patch.start_time <= t and (patch.end_time is None or t < patch.end_time)


def _plain(change: Change) -> object:
    return list(change.value) if isinstance(change.value, tuple) else change.value
