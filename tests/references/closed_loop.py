"""A scenario as plain arrays, and one evaluation of plant and controller together."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import FingerParameters, Scenario
from tests.references.chain import ChainFinger
from tests.references.controller import Law, Unknowns, regressor
from tests.references.finger import Finger
from tests.references.hand import Hand, Kinematics, Motion, Parameters, Phase, State
from tests.references.trajectory import Trajectory, trajectory_of

Array = NDArray[np.float64]

_FACES = {"left": (0.0, 1.0), "right": (0.0, -1.0), "bottom": (-1.0, 0.0), "top": (1.0, 0.0)}


class Evaluation(NamedTuple):
    """Plant and control law at one instant; ``kin`` as the controller sees it."""

    kin: Kinematics
    torques: Array
    violation: float
    motion: Motion
    forces: Array  # that the torques of the law ask for; none where torques are given, (2n,)


class ClosedLoop(NamedTuple):
    """Hand, truth, law and desired motion of a scenario."""

    hand: Hand
    truth: Parameters
    unknowns: Unknowns
    law: Law
    trajectory: Trajectory
    initial_estimates: Array
    static_friction: Array  # (n,)
    load: Array  # force and moment on the object from outside, (3,)
    believed_hand: Hand
    rubbing: Array  # viscous and dry friction of the joints of each finger, (n, 2)

    @classmethod
    def from_scenario(cls, scenario: Scenario) -> ClosedLoop:
        """Reads a scenario but for what happens during the run."""
        n = len(scenario.fingers)
        truth = Parameters(
            np.array([_masses(f) for f in scenario.fingers]),
            scenario.object.mass,
            scenario.object.inertia,
            np.array([f.friction for f in scenario.fingers]),
        )
        hand, ratio = _hand(scenario), scenario.controller.link_length_ratio
        return cls(
            hand=hand,
            truth=truth,
            unknowns=Unknowns(
                tuple(e.parameter for e in scenario.estimates),
                truth._replace(link_masses=scenario.controller.link_mass_ratio * truth.link_masses),
            ),
            law=_law(scenario, n),
            trajectory=trajectory_of(scenario.trajectory),
            initial_estimates=np.array([e.initial for e in scenario.estimates]),
            static_friction=np.array(
                [
                    f.friction if f.static_friction is None else f.static_friction
                    for f in scenario.fingers
                ]
            ),
            load=np.zeros(3),
            believed_hand=hand if ratio == 1.0 else _hand(scenario, ratio),
            rubbing=np.array([(f.joint_damping, f.joint_friction) for f in scenario.fingers]),
        )

    def with_friction(self, factors: Array) -> ClosedLoop:
        """The same with the frictions of all contacts multiplied."""
        truth = self.truth._replace(friction=factors * self.truth.friction)
        return self._replace(
            truth=truth,
            unknowns=self.unknowns._replace(
                known=self.unknowns.known._replace(friction=truth.friction)
            ),
            static_friction=factors * self.static_friction,
        )

    def evaluate(
        self,
        state: State,
        phase: Phase,
        estimates: Array,
        desired: tuple[Array, Array, Array],
        *,
        belief: Phase | None = None,
        torques: Array | None = None,
        stopping: Array | None = None,
        kin: Kinematics | None = None,
    ) -> Evaluation:
        """Torques, accelerations and contact forces at one instant.

        Args:
            state: The state of the plant.
            phase: Phase of the plant.
            estimates: What the controller believes.
            desired: Desired pose, velocity, acceleration.
            belief: Phase the controller acts on; the plant's if left out.
            torques: Torques that act; those of the law if left out.
            stopping: What is added to the commanded slip accelerations, ``(n,)``.
            kin: The believed kinematics of the state, if known.
        """
        kin = kin or self.believed_kinematics(state)
        violation, forces = 0.0, np.zeros(0)
        if torques is None:
            believed = phase if belief is None else belief
            v = self.law.commanded_acceleration(state, believed, desired)
            v[3:] += 0.0 if stopping is None else stopping
            torques, violation, forces = self.law.command(
                self.believed_hand, kin, self.unknowns.fill(estimates), believed, v
            )
        is_true = self.believed_hand is self.hand
        motion = self.solve_plant(state, phase, torques, kin if is_true else None)
        return Evaluation(kin, torques, violation, motion, forces)

    def believed_kinematics(self, state: State) -> Kinematics:
        """How the controller believes the fingers to be in a state."""
        is_true = self.believed_hand is self.hand
        return self.believed_hand.kinematics(state, None if is_true else self.hand)

    def solve_plant(
        self, state: State, phase: Phase, torques: Array, kin: Kinematics | None = None
    ) -> Motion:
        """What the plant does under torques, less what the friction of its joints takes.

        ``kin`` is the kinematics of the plant in that state, if known.
        """
        kin = kin or self.hand.kinematics(state)
        given = np.ravel(torques) - self.joint_friction(kin)
        return self.hand.solve_all_unknowns(kin, self.truth, phase, given, self.load)

    def joint_friction(self, kin: Kinematics) -> Array:
        """Torques that the friction of the joints takes, ``(2n,)`` [N m]."""
        viscous, dry = self.rubbing[:, :1], self.rubbing[:, 1:]
        return (viscous * kin.qd + dry * kin.qd / np.hypot(kin.qd, 0.01)).ravel()

    def estimate_rates(
        self,
        kin: Kinematics,
        state: State,
        phase: Phase,
        estimates: Array,
        desired: tuple[Array, Array, Array],
        acceleration: Array,
    ) -> Array:
        """The update law in the believed phase at a measured acceleration, unprojected."""
        U, _ = regressor(self.believed_hand, kin, self.unknowns, phase, acceleration)
        reduced = self.believed_hand.reduced_form(kin, self.unknowns.fill(estimates), phase)
        return self.law.estimate_rates(reduced, U, state, phase, desired, estimates)


def _hand(scenario: Scenario, ratio: float = 1.0) -> Hand:
    body = scenario.object
    anchors, tangents, fingers = [], [], []
    for f in scenario.fingers:
        if body.corners:
            middle, tangent = _edge(np.array(body.corners), int(f.face.split("-")[1]))
        else:
            tangent = np.array(_FACES[f.face])
            depth = body.half_width if f.face in ("left", "right") else body.face_half_length
            middle = depth * np.array([-tangent[1], tangent[0]])
        tangents.append(tangent)
        anchors.append(middle + f.contact_offset * tangent)
        if f.kind == "chain":
            fingers.append(ChainFinger(f))
            continue
        lengths = ratio * np.array(f.link_lengths)
        fingers.append(
            Finger(
                base=np.array(f.base),
                lengths=lengths,
                centres=lengths * f.link_centre_fractions,
                inertias=lengths**2 * f.link_inertia_fractions,
                elbow=-1.0 if f.elbow == "up" else 1.0,
            )
        )
    return Hand(tuple(fingers), np.array(anchors), np.array(tangents), scenario.simulation.gravity)


def _masses(finger: FingerParameters) -> tuple[float, ...]:
    if finger.kind == "chain":
        return tuple(joint.mass for joint in finger.joints)
    return finger.link_masses


def _edge(corners: Array, k: int) -> tuple[Array, Array]:
    """Middle of an edge, and the direction clockwise along it."""
    a, b = corners[k], corners[(k + 1) % len(corners)]
    return (a + b) / 2.0, (a - b) / np.linalg.norm(a - b)


def _law(scenario: Scenario, n: int) -> Law:
    c = scenario.controller
    p = len(scenario.estimates)
    position = np.zeros(3 + n)
    position[:3], position[3:] = c.position_gain, c.slip_position_gain
    return Law(
        position_gain=position,
        velocity_gain=np.broadcast_to(c.velocity_gain, 3 + n).astype(float),
        lyapunov_weight=(
            np.array(c.lyapunov_matrix)
            if c.lyapunov_matrix
            else np.broadcast_to(c.lyapunov_weight, 3 + n).astype(float)
        ),
        adaptation_gain=np.broadcast_to(c.adaptation_gain, p).astype(float),
        grip_safety=c.grip_safety,
        normal_forces=(c.minimum_normal_force, _or_infinity(c.maximum_normal_force)),
        torque_limit=_or_infinity(scenario.actuation.torque_limit),
        squeezes=c.grasp_force == "minimum",
        holds=c.distribution == "hold",
        norm_bound=c.estimate_norm_bound if c.kind == "theorem-4" else np.inf,
        minimum=np.array([-np.inf if e.minimum is None else e.minimum for e in scenario.estimates]),
        maximum=np.array([np.inf if e.maximum is None else e.maximum for e in scenario.estimates]),
    )


def _or_infinity(limit: float | None) -> float:
    return np.inf if limit is None else limit
