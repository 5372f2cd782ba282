"""One instant of a run, read off its trace: what the scene and the read-outs show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import JOINTS_PER_FINGER, Trace
from slipgrasp.core.trace.types import ContactPhase

Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """The state of hand, object and contacts at one time, SI units.

    Attributes:
        time: Simulation time [s].
        object_pose: Pose x, y, theta [m, m, rad].
        desired_pose: Desired pose x, y, theta [m, m, rad].
        external_wrench: Force and moment that push the object [N, N, N m].
        slip: Displacement of each fingertip along its face [m].
        slip_reach: Least and largest slip of each fingertip so far, shape ``(contacts, 2)`` [m].
        slip_velocity: Its first derivative [m/s].
        phases: Phase of each contact.
        tangential_force: F_x of each fingertip on the object [N].
        normal_force: F_n of each fingertip on the object [N].
        friction: True friction coefficient of each contact.
        joint_positions: Joint angles, shape ``(fingers, joints)`` [rad].
        estimates: Estimates of the unknown parameters.
    """

    time: float
    object_pose: Values
    desired_pose: Values
    external_wrench: Values
    slip: Values
    slip_reach: Values
    slip_velocity: Values
    phases: tuple[ContactPhase, ...]
    tangential_force: Values
    normal_force: Values
    friction: Values
    joint_positions: Values
    estimates: Values


class Spot(NamedTuple):
    """A place between two rows of a trace: ``weight`` of the way from ``row`` to ``following``."""

    row: int
    following: int
    weight: float

    def read(self, values: Values) -> Values:
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
        self._trace = trace
        self._least = np.minimum.accumulate(trace.slip, axis=0)
        self._largest = np.maximum.accumulate(trace.slip, axis=0)

    def at(self, time: float) -> Sample:
        """The state at a time, on the straight line between two rows of the trace.

        Args:
            time: Simulation time [s]; moved into the run if outside.
        """
        trace, spot = self._trace, locate(self._trace.times, time)
        pose, slip = spot.read(trace.object_pose), spot.read(trace.slip)
        reach = (np.minimum(self._least[spot.row], slip), np.maximum(self._largest[spot.row], slip))
        return Sample(
            time=float(spot.read(trace.times)),
            object_pose=pose,
            desired_pose=pose + spot.read(trace.tracking_error),
            external_wrench=trace.external_wrench[spot.row],
            slip=slip,
            slip_reach=np.stack(reach, axis=1),
            slip_velocity=spot.read(trace.slip_velocity),
            phases=tuple(ContactPhase(int(phase)) for phase in trace.phase[spot.row]),
            tangential_force=spot.read(trace.tangential_force),
            normal_force=spot.read(trace.normal_force),
            friction=trace.friction_coefficient[spot.row],
            joint_positions=spot.read(trace.joint_position).reshape(-1, JOINTS_PER_FINGER),
            estimates=spot.read(trace.estimates),
        )
