"""An instant of a run, sampled from its trace, for the scene and the read-outs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import Trace
from slipgrasp.scene.states import States, states_of

Values = NDArray[np.float64]

_POINTS_OF_A_PATH = 160
# Signals that are interpolated; the others that are drawn are constant between rows.
_MOVING = (
    "times",
    "object_pose",
    "tracking_error",
    "slip",
    "slip_velocity",
    "tangential_force",
    "normal_force",
    "joint_position",
    "estimates",
    "spin",
    "torsional_moment",
)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """An instant of a run.

    Attributes:
        states: Hand, object and contacts, a single state.
        external_wrench: Force and moment of pushes on the object, world axes [N, N m].
        trails: Path of each fingertip in slips, ``(points, tangents)`` each [m]: for a spatial hand
            in order; for a planar one its ends and, between them, the initial contact point.
        estimates: Estimates of the unknown parameters.
    """

    states: States
    external_wrench: Values
    trails: tuple[Values, ...]
    estimates: Values

    @property
    def time(self) -> float:
        """Simulation time [s]."""
        return self.states.times[0]


class Spot(NamedTuple):
    """A position between two rows: ``weight`` of the way from ``row`` to ``following``."""

    row: int
    following: int
    weight: float

    def read(self, values: Values) -> Any:
        """Interpolates an array over time; exact at a row.

        Args:
            values: One value per row, of any shape.
        """
        return self.read_row(values)[0]

    def read_row(self, values: Values) -> Values:
        """The same as an array with one row."""
        row = values[self.row : self.row + 1]
        if self.weight == 0.0:
            return row
        return row + self.weight * (values[self.following : self.following + 1] - row)


def locate(times: Values, time: float) -> Spot:
    """The position of a time between the rows of a trace.

    Two rows at one time are the two sides of an event; at that time the side after it is used, so
    that no interpolation crosses an event.

    Args:
        times: Times of the rows [s].
        time: Simulation time [s]; moved into the run if outside.
    """
    last = len(times) - 1
    row = min(max(int(np.searchsorted(times, time, side="right")) - 1, 0), last)
    following = min(row + 1, last)
    span = float(times[following] - times[row])
    weight = min(max((time - float(times[row])) / span, 0.0), 1.0) if span > 0.0 else 0.0
    return Spot(row, following, weight)


class Sampler:
    """Samples instants of a trace, each with one binary search.

    Args:
        trace: The run.
    """

    def __init__(self, trace: Trace) -> None:
        self._trace, count = trace, trace.shape.num_contacts
        self._slip = trace.slip.reshape(len(trace), count, -1)
        if trace.shape.space.has_paths:
            paths = [(self._slip[:, i], trace.slip_path[:, i]) for i in range(count)]
            self._trails: list[_Reach] | list[_Path] = [_Path(*pair) for pair in paths]
        else:
            self._trails = [_Reach(self._slip[:, i]) for i in range(count)]

    def at(self, time: float) -> Sample:
        """The state at a time, interpolated between two rows of the trace.

        Args:
            time: Simulation time [s]; moved into the run if outside.
        """
        return self.read(locate(self._trace.times, time))

    def read(self, spot: Spot) -> Sample:
        """The state at a position between two rows of the trace."""
        trace = self._trace
        between = {name: spot.read_row(getattr(trace, name)) for name in _MOVING}
        now = replace(trace[spot.row : spot.row + 1], **between)
        states = states_of(now)
        slips = zip(self._trails, states.slip[0], strict=True)
        return Sample(
            states=states,
            external_wrench=now.external_wrench[0],
            trails=tuple(trail.at(spot.row, slip) for trail, slip in slips),
            estimates=now.estimates[0],
        )


class _Reach:
    """The ends of the path of a planar fingertip."""

    def __init__(self, slip: Values) -> None:
        self._least = np.minimum.accumulate(slip, axis=0)
        self._largest = np.maximum.accumulate(slip, axis=0)

    def at(self, row: int, slip: Values) -> Values:
        """The trail between two rows, with the fingertip at a slip."""
        least, largest = np.minimum(self._least[row], slip), np.maximum(self._largest[row], slip)
        return np.stack([least, np.zeros_like(slip), largest])


class _Path:
    """The path of a spatial fingertip, at rows with roughly equal distances."""

    def __init__(self, slip: Values, path: Values) -> None:
        self._slip = slip
        steps = np.linspace(0.0, path[-1], _POINTS_OF_A_PATH)
        rows = np.searchsorted(path, steps[1:]).clip(max=len(slip) - 1)
        self._stations = np.unique(np.append(0, rows))

    def at(self, row: int, slip: Values) -> Values:
        """The trail between two rows, with the fingertip at a slip."""
        passed = self._stations[: np.searchsorted(self._stations, row, side="right")]
        return np.concatenate([self._slip[passed], slip[None]])


def pushed(sample: Sample, force: Sequence[float]) -> Sample:
    """An instant with a force on the object, a number per direction [N], instead of pushes."""
    wrench = np.zeros_like(sample.external_wrench)
    wrench[: len(force)] = force
    return replace(sample, external_wrench=wrench)
