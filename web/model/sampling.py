"""One instant of a run, read off its trace: what the scene and the read-outs show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.scene import rotations

Values = NDArray[np.float64]

_POINTS_OF_A_PATH = 160


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """The state of hand, object and contacts at one time, SI units.

    Attributes:
        time: Simulation time [s].
        object_pose: Pose x, y, theta [m, m, rad]; of a spatial hand position and unit quaternion
            (w, x, y, z).
        desired_pose: The same of the desired pose.
        external_wrench: Force and moment that push the object, world axes [N, N m].
        slip: Displacement of each fingertip along its tangents, ``(contacts, tangents)`` [m].
        trails: Where each fingertip has slid, in slips, ``(points, tangents)`` each [m]: of a
            spatial hand all of it, in order; of a planar one its ends and, between them, the
            point touched first.
        slip_velocity: First derivative of the slip, likewise [m/s].
        phases: Phase of each contact.
        tangential_force: Of each fingertip on the object along its tangents, likewise [N].
        normal_force: F_n of each fingertip on the object [N].
        friction: True friction coefficient of each contact.
        joint_positions: Joint angles, shape ``(fingers, joints)`` [rad]; positions of slides [m].
        estimates: Estimates of the unknown parameters.
        spin: Angle by which each fingertip has turned on its face [rad]; none of hard ones.
        torsional_moment: Of each on the object [N m], likewise.
    """

    time: float
    object_pose: Values
    desired_pose: Values
    external_wrench: Values
    slip: Values
    trails: tuple[Values, ...]
    slip_velocity: Values
    phases: tuple[ContactPhase, ...]
    tangential_force: Values
    normal_force: Values
    friction: Values
    joint_positions: Values
    estimates: Values
    spin: Values
    torsional_moment: Values


class Spot(NamedTuple):
    """A place between two rows of a trace: ``weight`` of the way from ``row`` to ``following``."""

    row: int
    following: int
    weight: float

    def read(self, values: Values) -> Any:
        """What an array over time holds here; the very bits of a row where it is on one.

        Args:
            values: One entry per row, of any shape.
        """
        if self.weight == 0.0:
            return values[self.row]
        return values[self.row] + self.weight * (values[self.following] - values[self.row])


def locate(times: Values, time: float) -> Spot:
    """Where a time stands between the rows of a trace.

    Two rows at one time are the two sides of an event; at that very time the side after
    it is taken, so no line ever crosses an event.

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
    """Reads instants off one trace, each in the time of a binary search.

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
        """The state at a time, on the straight line between two rows of the trace.

        Args:
            time: Simulation time [s]; moved into the run if outside.
        """
        return self.read(locate(self._trace.times, time))

    def read(self, spot: Spot) -> Sample:
        """The state at a place between two rows of the trace."""
        trace = self._trace
        slip, shape = spot.read(self._slip), trace.shape
        pose, error = spot.read(trace.object_pose), spot.read(trace.tracking_error)
        if len(pose) > len(error):
            pose[3:] /= np.linalg.norm(pose[3:])
        return Sample(
            time=spot.read(trace.times),
            object_pose=pose,
            desired_pose=_desired(pose, error),
            external_wrench=trace.external_wrench[spot.row],
            slip=slip,
            trails=tuple(each.at(spot.row, slip[i]) for i, each in enumerate(self._trails)),
            slip_velocity=spot.read(trace.slip_velocity).reshape(slip.shape),
            phases=tuple(ContactPhase(int(phase)) for phase in trace.phase[spot.row]),
            tangential_force=spot.read(trace.tangential_force).reshape(slip.shape),
            normal_force=spot.read(trace.normal_force),
            friction=trace.friction_coefficient[spot.row],
            joint_positions=spot.read(trace.joint_position).reshape(-1, shape.joints_per_finger),
            estimates=spot.read(trace.estimates),
            spin=spot.read(trace.spin),
            torsional_moment=spot.read(trace.torsional_moment),
        )


class _Reach:
    """The ends of what a planar fingertip has slid over."""

    def __init__(self, slip: Values) -> None:
        self._least = np.minimum.accumulate(slip, axis=0)
        self._largest = np.maximum.accumulate(slip, axis=0)

    def at(self, row: int, slip: Values) -> Values:
        """The trail between a row and the next, where the fingertip is at a slip."""
        least, largest = np.minimum(self._least[row], slip), np.maximum(self._largest[row], slip)
        return np.stack([least, np.zeros_like(slip), largest])


class _Path:
    """The path of a spatial fingertip, of rows at which it has gone about equally far."""

    def __init__(self, slip: Values, path: Values) -> None:
        self._slip = slip
        steps = np.linspace(0.0, path[-1], _POINTS_OF_A_PATH)
        rows = np.searchsorted(path, steps[1:]).clip(max=len(slip) - 1)
        self._stations = np.unique(np.append(0, rows))

    def at(self, row: int, slip: Values) -> Values:
        """The trail between a row and the next, where the fingertip is at a slip."""
        passed = self._stations[: np.searchsorted(self._stations, row, side="right")]
        return np.concatenate([self._slip[passed], slip[None]])


def pushed(sample: Sample, force: Sequence[float]) -> Sample:
    """An instant at which nothing but a force pushes the object, a number per direction [N]."""
    wrench = np.zeros_like(sample.external_wrench)
    wrench[: len(force)] = force
    return replace(sample, external_wrench=wrench)


def _desired(pose: Values, error: Values) -> Values:
    """The desired pose; the error of a spatial attitude is a rotation vector in world axes."""
    if len(pose) == len(error):
        return pose + error
    turned = rotations.product(rotations.from_vectors(error[3:]), pose[3:])
    return np.concatenate([pose[:3] + error[:3], turned])
