"""The fingers of a scenario in Pinocchio, by way of a URDF; Eq. 15 with its terms.

Nothing of the fingers' mechanics is written here: Pinocchio gets lengths, masses, centres
and inertias, and gives back M, h, J, the fingertip's acceleration and the torque regressor.
Only the object and the contacts, which Pinocchio does not know, are assembled by hand.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio
from numpy.typing import NDArray

from slipgrasp.core.scenario import FingerParameters, Scenario
from tests.references.hand import Motion, Phase, State, block_diagonal, friction_rows

Array = NDArray[np.float64]

_ALIGNED = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
_TANGENTS = {"left": (0.0, 1.0), "right": (0.0, -1.0), "bottom": (-1.0, 0.0), "top": (1.0, 0.0)}


class FingerTerms(NamedTuple):
    """Kinematics and dynamics of all fingers at one joint position and velocity."""

    inertia: Array  # (2n, 2n), M of Eq. 1
    bias: Array  # (2n,), h of Eq. 1
    tips: Array  # (n, 2) [m]
    jacobians: Array  # (n, 2, 2)
    jacobian_rate_times_velocity: Array  # (n, 2)


class PinocchioHand:
    """All fingers of a scenario as one Pinocchio model; joints in the order of ours."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        self.model = pinocchio.buildModelFromXML(describe_hand(scenario))
        self.model.gravity.linear = np.array([0.0, -scenario.simulation.gravity, 0.0])
        self.data = self.model.createData()
        names = [f"joint{i}{k}" for i in range(len(scenario.fingers)) for k in range(2)]
        self.joints = [self.model.getJointId(name) for name in names]
        self.columns = [self.model.joints[joint].idx_v for joint in self.joints]
        tips = [f"tip{i}" for i in range(len(scenario.fingers))]
        self.tips = [self.model.getFrameId(name) for name in tips]

    def terms(self, q: Array, qd: Array) -> FingerTerms:
        """Everything but the regressor, for joint positions and velocities ``(n, 2)``."""
        model, data, n = self.model, self.data, len(self.tips)
        position, velocity = self._ordered(q), self._ordered(qd)
        square = np.ix_(self.columns, self.columns)
        pinocchio.forwardKinematics(model, data, position, velocity, np.zeros(2 * n))
        pinocchio.updateFramePlacements(model, data)
        accelerations = [
            pinocchio.getFrameClassicalAcceleration(model, data, tip, _ALIGNED).linear[:2].copy()
            for tip in self.tips
        ]
        tips = [data.oMf[tip].translation[:2].copy() for tip in self.tips]
        jacobians = [
            pinocchio.computeFrameJacobian(model, data, position, tip, _ALIGNED)[
                :2, self.columns[2 * i : 2 * i + 2]
            ]
            for i, tip in enumerate(self.tips)
        ]
        inertia = pinocchio.crba(model, data, position)
        upper = np.triu(inertia)
        bias = pinocchio.nonLinearEffects(model, data, position, velocity)
        return FingerTerms(
            inertia=(upper + np.triu(inertia, 1).T)[square],
            bias=bias[self.columns].copy(),
            tips=np.array(tips),
            jacobians=np.array(jacobians),
            jacobian_rate_times_velocity=np.array(accelerations),
        )

    def link_regressor(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Torques per kilogram of each link, its shape kept: ``(2n, 2n)``, links as columns.

        Pinocchio's regressor has ten columns per body (mass, first moments, inertia about
        the joint); with the link's shape given, all ten are proportional to its mass.
        """
        full = pinocchio.computeJointTorqueRegressor(
            self.model, self.data, self._ordered(q), self._ordered(qd), self._ordered(qdd)
        )
        links = [(finger, k) for finger in self.scenario.fingers for k in range(2)]
        columns = [
            full[:, 10 * (joint - 1) : 10 * joint] @ _parameters_per_mass(finger, k)
            for joint, (finger, k) in zip(self.joints, links, strict=True)
        ]
        return np.stack(columns, axis=1)[self.columns]

    def solve_all_unknowns(
        self, state: State, q: Array, qd: Array, phase: Phase, torques: Array
    ) -> Motion:
        """Solves Eq. 15 for joint, object and slip accelerations and forces together."""
        n, body = len(self.tips), self.scenario.object
        terms = self.terms(q, qd)
        A_o, A_s, W, frames, b = self._contacts(state, terms)
        J = block_diagonal([C.T @ j for C, j in zip(frames, terms.jacobians, strict=True)])
        alpha, D = friction_rows(phase, np.array([f.friction for f in self.scenario.fingers]))
        M_o = np.diag([body.mass, body.mass, body.inertia])
        h_o = np.array([0.0, body.mass * self.scenario.simulation.gravity, 0.0])
        zero = np.zeros
        matrix = np.block(
            [
                [terms.inertia, zero((2 * n, 3 + n)), J.T],
                [zero((3, 2 * n)), M_o, zero((3, n)), -W],
                [block_diagonal(list(terms.jacobians)), A_o, A_s, zero((2 * n, 2 * n))],
                [zero((n, 2 * n + 3)), alpha, D],
            ]
        )
        right = np.concatenate((torques - terms.bias, -h_o, b, zero(n)))
        solution = np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
        joints, rest, forces = np.split(solution, (2 * n, 3 * n + 3))
        return Motion(joints.reshape(n, 2), rest, forces.reshape(n, 2))

    def _contacts(
        self, state: State, terms: FingerTerms
    ) -> tuple[Array, Array, Array, list[Array], Array]:
        """A_o, A_s, W, contact frames and b of Eq. 13-16, from where Pinocchio's tips are."""
        c, s = np.cos(state.pose[2]), np.sin(state.pose[2])
        R, spin, turn = np.array([[c, -s], [s, c]]), state.velocity[2], np.array([[0, -1], [1, 0]])
        arms = terms.tips - state.pose[:2]
        tangents = [R @ _TANGENTS[finger.face] for finger in self.scenario.fingers]
        frames = [np.column_stack((-t, -turn @ t)) for t in tangents]
        A_o = -np.vstack([np.column_stack((np.eye(2), turn @ r)) for r in arms])
        W = np.hstack(
            [np.vstack((C, r[0] * C[1] - r[1] * C[0])) for C, r in zip(frames, arms, strict=True)]
        )
        b = -terms.jacobian_rate_times_velocity - spin**2 * arms
        b += 2.0 * spin * state.slip_velocity[:, None] * np.array([turn @ t for t in tangents])
        return A_o, block_diagonal([-t[:, None] for t in tangents]), W, frames, b.ravel()

    def _ordered(self, values: Array) -> Array:
        ordered = np.zeros(2 * len(self.tips))
        ordered[self.columns] = np.ravel(values)
        return ordered


def describe_hand(scenario: Scenario) -> str:
    """The fingers as a URDF in the plane z = 0; every joint turns about z."""
    fingers = "".join(_describe_finger(i, f) for i, f in enumerate(scenario.fingers))
    return f'<robot name="hand"><link name="world"/>{fingers}</robot>'


def _describe_finger(i: int, finger: FingerParameters) -> str:
    x, y = finger.base
    l1, l2 = finger.link_lengths
    return f"""
    <joint name="base{i}" type="fixed"><parent link="world"/><child link="base{i}"/>
      <origin xyz="{x} {y} 0"/></joint><link name="base{i}"/>
    {_describe_link(i, 0, finger)}
    {_describe_joint(f"joint{i}0", f"base{i}", f"link{i}0", 0.0)}
    {_describe_link(i, 1, finger)}
    {_describe_joint(f"joint{i}1", f"link{i}0", f"link{i}1", l1)}
    <joint name="end{i}" type="fixed"><parent link="link{i}1"/><child link="tip{i}"/>
      <origin xyz="{l2} 0 0"/></joint><link name="tip{i}"/>"""


def _describe_joint(name: str, parent: str, child: str, distance: float) -> str:
    return f"""<joint name="{name}" type="revolute"><parent link="{parent}"/>
      <child link="{child}"/><origin xyz="{distance} 0 0"/><axis xyz="0 0 1"/>
      <limit lower="-100" upper="100" effort="1e9" velocity="1e9"/></joint>"""


def _describe_link(i: int, k: int, finger: FingerParameters) -> str:
    mass, centre, inertia = _mass_centre_inertia(finger, k)
    return f"""<link name="link{i}{k}"><inertial><origin xyz="{centre} 0 0"/>
      <mass value="{mass}"/><inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}"
        ixy="0" ixz="0" iyz="0"/></inertial></link>"""


def _mass_centre_inertia(finger: FingerParameters, k: int) -> tuple[float, float, float]:
    mass, length = finger.link_masses[k], finger.link_lengths[k]
    inertia = finger.link_inertia_fractions[k] * mass * length**2
    return mass, finger.link_centre_fractions[k] * length, inertia


def _parameters_per_mass(finger: FingerParameters, k: int) -> Array:
    mass, centre, inertia = _mass_centre_inertia(finger, k)
    body = pinocchio.Inertia(mass, np.array([centre, 0.0, 0.0]), inertia * np.eye(3))
    return body.toDynamicParameters() / mass
