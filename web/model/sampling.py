"""An instant of a run, sampled from its trace, for the scene and the read-outs."""

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
        object_pose: Pose x, y, theta [m, m, rad]; for a spatial hand, position and unit quaternion
            (w, x, y, z).
        desired_pose: Desired pose in the same form.
        external_wrench: Force and moment of pushes on the object, world axes [N, N m].
        slip: Displacement of each fingertip along its tangents, ``(contacts, tangents)`` [m].
        trails: Path of each fingertip in slips, ``(points, tangents)`` each [m]: for a spatial hand
            in order; for a planar one its ends and, between them, the initial contact point.
        slip_velocity: First derivative of the slip [m/s].
        phases: Phase of each contact.
        tangential_force: Tangential force of each fingertip on the object [N].
        normal_force: F_n of each fingertip on the object [N].
        friction: True friction coefficient of each contact.
        joint_positions: Joint angles, shape ``(fingers, joints)`` [rad]; positions of slides [m].
        estimates: Estimates of the unknown parameters.
        spin: Rotation angle of each fingertip on its face [rad]; none for hard ones.
        torsional_moment: Moment of each fingertip on the object [N m].
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
    """A position between two rows: ``weight`` of the way from ``row`` to ``following``."""

    row: int
    following: int
    weight: float

    def read(self, values: Values) -> Any:
        """Interpolates an array over time; exact at a row.

        Args:
            values: One value per row, of any shape.
        """
        if self.weight == 0.0:
            return values[self.row]
        return values[self.row] + self.weight * (values[self.following] - values[self.row])


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
            joint_positions=spot.read(trace.joint_position).reshape(
                shape.num_jointed, shape.joints_per_finger
            ),
            estimates=spot.read(trace.estimates),
            spin=spot.read(trace.spin),
            torsional_moment=spot.read(trace.torsional_moment),
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


def _desired(pose: Values, error: Values) -> Values:
    """The desired pose; the error of a spatial attitude is a rotation vector in world axes."""
    if len(pose) == len(error):
        return pose + error
    turned = rotations.product(rotations.from_vectors(error[3:]), pose[3:])
    return np.concatenate([pose[:3] + error[:3], turned])
