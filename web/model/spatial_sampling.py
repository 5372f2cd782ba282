"""One instant of a run in space, read off its trace: what the scene and the read-outs show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from slipgrasp.core.trace.trace import JOINTS_IN_SPACE, Trace
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.web.model.sampling import Sample, Sampler, Values, locate

_POINTS_OF_A_WAY = 160


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpatialSample:
    """The state of hand, object and contacts at one time, SI units.

    Attributes:
        time: Simulation time [s].
        object_pose: Position and unit quaternion (w, x, y, z) [m].
        desired_pose: The same of the desired pose.
        external_wrench: Force and moment that push the object, world axes [N, N m].
        slip: Displacement of each fingertip along its two tangents, shape ``(contacts, 2)`` [m].
        ways: The way that each fingertip has slid so far, shape ``(points, 2)`` each [m].
        slip_velocity: Its first derivative, shape ``(contacts, 2)`` [m/s].
        phases: Phase of each contact.
        tangential_force: F_x, F_y of each fingertip on the object, shape ``(contacts, 2)`` [N].
        normal_force: F_n of each fingertip on the object [N].
        friction: True friction coefficient of each contact.
        joint_positions: Joint angles, shape ``(fingers, 3)`` [rad].
        estimates: Estimates of the unknown parameters.
    """

    time: float
    object_pose: Values
    desired_pose: Values
    external_wrench: Values
    slip: Values
    ways: tuple[Values, ...]
    slip_velocity: Values
    phases: tuple[ContactPhase, ...]
    tangential_force: Values
    normal_force: Values
    friction: Values
    joint_positions: Values
    estimates: Values


class SpatialSampler:
    """Reads instants off one trace of a hand in space.

    Args:
        trace: The run.
    """

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self._slip = trace.slip.reshape(len(trace), -1, 2)
        self._stations = [
            _stations(self._slip[:, i], trace.slip_path[:, i]) for i in range(self._slip.shape[1])
        ]

    def at(self, time: float) -> SpatialSample:
        """The state at a time, on the straight line between two rows of the trace.

        Args:
            time: Simulation time [s]; moved into the run if outside.
        """
        trace, spot = self._trace, locate(self._trace.times, time)
        pose, error = spot.read(trace.object_pose), spot.read(trace.tracking_error)
        pose[3:] /= np.linalg.norm(pose[3:])
        desired = np.concatenate([pose[:3] + error[:3], _turned(error[3:], pose[3:])])
        slip = spot.read(self._slip)
        passed = [rows[: np.searchsorted(rows, spot.row, side="right")] for rows in self._stations]
        return SpatialSample(
            time=float(spot.read(trace.times)),
            object_pose=pose,
            desired_pose=desired,
            external_wrench=trace.external_wrench[spot.row],
            slip=slip,
            ways=tuple(
                np.concatenate([self._slip[rows, i], slip[i][None]])
                for i, rows in enumerate(passed)
            ),
            slip_velocity=spot.read(trace.slip_velocity).reshape(-1, 2),
            phases=tuple(ContactPhase(int(phase)) for phase in trace.phase[spot.row]),
            tangential_force=spot.read(trace.tangential_force).reshape(-1, 2),
            normal_force=spot.read(trace.normal_force),
            friction=trace.friction_coefficient[spot.row],
            joint_positions=spot.read(trace.joint_position).reshape(-1, JOINTS_IN_SPACE),
            estimates=spot.read(trace.estimates),
        )


AnySample = Sample | SpatialSample


def make_sampler(trace: Trace) -> Sampler | SpatialSampler:
    """What reads instants off a run."""
    return SpatialSampler(trace) if trace.shape.in_space else Sampler(trace)


def pushed(sample: AnySample, force: Sequence[float]) -> AnySample:
    """An instant at which nothing but a force pushes the object, a number per direction [N]."""
    wrench = np.zeros_like(sample.external_wrench)
    wrench[: len(force)] = force
    return replace(sample, external_wrench=wrench)


def _stations(slip: Values, path: Values) -> np.ndarray:
    """Rows at which a fingertip has gone about equally far, the first one included."""
    steps = np.linspace(0.0, path[-1], _POINTS_OF_A_WAY)
    return np.unique(np.append(0, np.searchsorted(path, steps[1:]).clip(max=len(slip) - 1)))


def _turned(vector: Values, quaternion: Values) -> Values:
    """A quaternion (w, x, y, z) turned on by a rotation vector in world axes."""
    angle = float(np.linalg.norm(vector))
    w, v = np.cos(0.5 * angle), 0.5 * np.sinc(0.5 * angle / np.pi) * vector
    w0, v0 = quaternion[0], quaternion[1:]
    return np.append(w * w0 - v @ v0, w * v0 + w0 * v + np.cross(v, v0))
