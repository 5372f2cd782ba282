"""Fingers in space in Pinocchio, by way of a URDF: yaw about z, then two pitches about -y."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio
from numpy.typing import NDArray

from tests.references.spatial_fingers import Fingers

Array = NDArray[np.float64]

_ALIGNED = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED


class FingerTerms(NamedTuple):
    """Kinematics and dynamics of one finger."""

    inertia: Array  # (3, 3)
    bias: Array  # (3,)
    tip: Array  # (3,)
    jacobian: Array  # (3, 3)
    jacobian_rate_times_velocity: Array  # (3,)


def finger_terms(
    fingers: Fingers, i: int, masses: Array, gravity: float, q: Array, qd: Array
) -> FingerTerms:
    """What Pinocchio says of finger ``i`` at joint positions and velocities ``(3,)``."""
    model = pinocchio.buildModelFromXML(_describe(fingers, i, masses))
    model.gravity.linear = np.array([0.0, 0.0, -gravity])
    data = model.createData()
    tip = model.getFrameId("tip")
    inertia = pinocchio.crba(model, data, q).copy()
    bias = pinocchio.nonLinearEffects(model, data, q, qd).copy()
    jacobian = pinocchio.computeFrameJacobian(model, data, q, tip, _ALIGNED)[:3].copy()
    pinocchio.forwardKinematics(model, data, q, qd, np.zeros(3))
    pinocchio.updateFramePlacements(model, data)
    acceleration = pinocchio.getFrameClassicalAcceleration(model, data, tip, _ALIGNED).linear
    return FingerTerms(
        np.triu(inertia) + np.triu(inertia, 1).T,
        bias,
        data.oMf[tip].translation.copy(),
        jacobian,
        acceleration.copy(),
    )


def _describe(fingers: Fingers, i: int, masses: Array) -> str:
    x, y, z = fingers.bases[i]
    l1, l2 = fingers.lengths[i]
    rods = [
        f"""<link name="link{k}"><inertial><origin xyz="{fingers.centres[i, k]} 0 0"/>
        <mass value="{masses[k]}"/><inertia ixx="0" iyy="{masses[k] * fingers.inertias[i, k]}"
        izz="{masses[k] * fingers.inertias[i, k]}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
        for k in range(2)
    ]
    return f"""<robot name="finger"><link name="world"/>
    <joint name="fixed" type="fixed"><parent link="world"/><child link="base"/>
      <origin xyz="{x} {y} {z}"/></joint><link name="base"/><link name="yawed"/>{"".join(rods)}
    {_joint("yaw", "base", "yawed", 0.0, "0 0 1")}{_joint("lift", "yawed", "link0", 0.0, "0 -1 0")}
    {_joint("elbow", "link0", "link1", l1, "0 -1 0")}
    <joint name="end" type="fixed"><parent link="link1"/><child link="tip"/>
      <origin xyz="{l2} 0 0"/></joint><link name="tip"/></robot>"""


def _joint(name: str, parent: str, child: str, distance: float, axis: str) -> str:
    return f"""<joint name="{name}" type="revolute"><parent link="{parent}"/>
      <child link="{child}"/><origin xyz="{distance} 0 0"/><axis xyz="{axis}"/>
      <limit lower="-100" upper="100" effort="1e9" velocity="1e9"/></joint>"""
