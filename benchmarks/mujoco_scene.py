"""A scenario as a MuJoCo scene: same bodies, gravity, friction and start pose.

In the plane the object carries a slide out of it, without which MuJoCo's no-slip solver has no
effect there. MuJoCo's x and z are our x and y; its y axis points away from the viewer, so angles
turn about its -y. The bodies of a spatial hand are in `benchmarks.mujoco_space`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from benchmarks import mujoco_space
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import FingerParameters, Scenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.spatial import SpatialScenario

STIFFNESS, DAMPING = 2000.0, 120.0
NO_SLIP_ITERATIONS = 5  # three already give all digits that ten give


class Contact(NamedTuple):
    """What MuJoCo wants to know of a contact beside its friction coefficient.

    Attributes:
        tip_radius: Radius of the sphere at the fingertip; our tips are points [m].
        attributes: MuJoCo's solver attributes of the geoms in contact.
        friction_hardness: MuJoCo's ``impratio``.
    """

    tip_radius: float
    attributes: str
    friction_hardness: float


# MuJoCo's own defaults, with a tip that one can see.
DEFAULT_CONTACT = Contact(tip_radius=0.005, attributes="", friction_hardness=1.0)


def build_model(scenario: Scenario, step: float) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """The scenario in its start pose, held by PD laws around the torque our run ends with.

    The PD laws are MuJoCo's own actuators, so that no Python runs between the steps.
    """
    trace = simulate(scenario).trace
    angles = trace.joint_position[0]
    gain = f'gainprm="{STIFFNESS}" biastype="affine" biasprm="0 {-STIFFNESS} {-DAMPING}"'
    actuators = "".join(f'<general joint="{name}" {gain}/>' for name in _joint_names(scenario))
    text = describe_scene(scenario, angles.tolist(), step, actuators, DEFAULT_CONTACT)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:] = start_coordinates(scenario, angles)
    data.ctrl[:] = angles + trace.joint_torque[-1] / STIFFNESS
    mujoco.mj_forward(model, data)
    return model, data


def start_coordinates(scenario: Scenario, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """MuJoCo's coordinates in the start pose: all joints, then the object's, then out of plane."""
    out_of_plane = [0.0] * (3 - scenario.space.num_positions)
    return np.concatenate((angles, scenario.trajectory.start, out_of_plane))


def motors(scenario: Scenario) -> str:
    """One torque motor per joint, in the order of our joints."""
    return "".join(f'<motor joint="{name}"/>' for name in _joint_names(scenario))


def describe_scene(
    scenario: Scenario, angles: list[float], step: float, actuators: str, contact: Contact
) -> str:
    """The scene in MuJoCo's XML; its coordinates are those of `start_coordinates`.

    Args:
        scenario: The hand and its object.
        angles: Joint angles of the start pose, which place the tip spheres [rad].
        step: Time step [s].
        actuators: XML of the actuators.
        contact: How fingertips and object touch.
    """
    bodies = "".join(_bodies(scenario, angles, contact))
    return f"""<mujoco><option timestep="{step}" gravity="0 0 -{scenario.simulation.gravity}"
      integrator="implicitfast" cone="elliptic" noslip_iterations="{NO_SLIP_ITERATIONS}"
      noslip_tolerance="1e-14" impratio="{contact.friction_hardness}"/>
      <worldbody>{bodies}</worldbody><actuator>{actuators}</actuator></mujoco>"""


def _bodies(scenario: Scenario, angles: list[float], contact: Contact) -> Iterator[str]:
    """All fingers, then the object."""
    if isinstance(scenario, SpatialScenario):
        for i in range(len(scenario.fingers)):
            yield mujoco_space.finger(scenario, i, angles[3 * i : 3 * i + 3], contact)
        yield mujoco_space.held_object(scenario, contact)
        return
    for i in range(len(scenario.fingers)):
        yield _finger(scenario, i, angles, contact)
    yield _held_object(scenario, contact)


def _joint_names(scenario: Scenario) -> list[str]:
    joints = scenario.space.joints_per_finger
    return [f"q{i}{joint}" for i in range(len(scenario.fingers)) for joint in range(joints)]


def _held_object(scenario: Scenario, contact: Contact) -> str:
    body = scenario.object
    return f"""<body>
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
      <joint type="hinge" axis="0 -1 0"/><joint type="slide" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="{body.mass}"
        diaginertia="{body.inertia} {body.inertia} {body.inertia}"/>
      <geom type="box" size="{body.half_width} {body.half_width} {body.face_half_length}"
        friction="0 0 0" condim="3" contype="2" conaffinity="1" {contact.attributes}/></body>"""


def _finger(scenario: Scenario, i: int, angles: list[float], contact: Contact) -> str:
    finger = scenario.fingers[i]
    l1, l2 = finger.link_lengths
    first, second = (_inertial(finger, link) for link in range(2))
    # The sphere touches the face exactly at the end of the link.
    nx, ny = contact_frame(scenario.object, finger).normal
    angle = scenario.trajectory.start[2] - angles[2 * i] - angles[2 * i + 1]
    across = math.cos(angle) * nx - math.sin(angle) * ny
    along = math.sin(angle) * nx + math.cos(angle) * ny
    radius = contact.tip_radius
    tip = f"{l2 - radius * across} 0 {-radius * along}"
    # Of two friction coefficients MuJoCo takes the larger one: the object has none.
    return f"""<body pos="{finger.base[0]} 0 {finger.base[1]}">
      <joint name="q{i}0" type="hinge" axis="0 -1 0"/>{first}
      <body pos="{l1} 0 0"><joint name="q{i}1" type="hinge" axis="0 -1 0"/>{second}
        <site name="tip{i}" pos="{l2} 0 0"/>
        <geom type="sphere" size="{radius}" pos="{tip}" friction="{finger.friction} 0 0"
          condim="3" contype="1" conaffinity="2" {contact.attributes}/></body></body>"""


def _inertial(finger: FingerParameters, link: int) -> str:
    mass, length = finger.link_masses[link], finger.link_lengths[link]
    inertia = finger.link_inertia_fractions[link] * mass * length**2
    centre = finger.link_centre_fractions[link] * length
    # Only the turn about the out-of-plane axis is possible; the others need any valid value.
    return f"""<inertial pos="{centre} 0 0" mass="{mass}"
      diaginertia="{inertia} {inertia} {inertia}"/>"""
