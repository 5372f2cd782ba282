"""A scenario as a MuJoCo scene: same bodies, gravity, friction and start pose, as MJCF.

In the plane the object carries a slide out of it, without which MuJoCo's no-slip solver has no
effect there. MuJoCo's x and z are our x and y; its y axis points away from the viewer, so angles
turn about its -y. The bodies of a spatial hand are in `mjcf_spatial`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import FingerParameters, PlanarScenario, Scenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.held_object import ObjectParameters
from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialScenario
from slipgrasp.recordings.engines import mjcf_spatial
from slipgrasp.recordings.engines.expected import STEP
from slipgrasp.recordings.engines.mjcf_spatial import Contact

OBJECT = "object"
_NO_SLIP_ITERATIONS = 5  # three already give all digits that ten give
_OSCILLATION_PER_STEP = 0.3  # natural frequency of a contact times the step [rad]


def describe_contact(step: float) -> Contact:
    """A contact whose compliance falls with the square of the step.

    The contact is a spring and damper per unit of apparent mass: stiffness (0.3 / step)^2,
    half critically damped, which the step still resolves. MuJoCo's convex contact model ties
    friction to the normal direction: a sliding tip is lifted off until it hops, unless the
    friction is soft in the main solve (``impratio`` far below 1). The no-slip solver then
    restores Coulomb's law exactly. A tip of 10 um rolls by nanometres only.
    """
    frequency = _OSCILLATION_PER_STEP / step
    return Contact(
        tip_radius=1e-5,
        attributes=f'solref="{-(frequency**2)} {-frequency}" solimp="0.5 0.5 0.001 0.5 2"',
        friction_hardness=1e-3,
    )


class SceneError(SlipgraspError):
    """A scenario that this scene cannot show."""


def check_for_scene(scenario: Scenario) -> None:
    """Refuses what MuJoCo's scene does not have.

    Raises:
        SceneError: If the scenario has it.
    """
    body = scenario.object
    fingers = scenario.fingers
    missing = {
        "fingers on slides or chains": any(each.kind != "links" for each in fingers),
        "static friction": any(
            each.static_friction not in (None, each.friction) for each in fingers
        ),
        "friction or damping of joints": any(
            each.joint_friction or each.joint_damping for each in fingers
        ),
        "soft pads": any(
            isinstance(each, SpatialFinger) and each.pad_radius > 0.0 for each in fingers
        ),
        "round objects": body.is_round,
        "planar objects with corners": isinstance(body, ObjectParameters) and bool(body.corners),
        "low-friction patches": bool(scenario.patches),
        "pushes": bool(scenario.pulses),
        "timed changes": bool(scenario.changes),
    }
    if found := [name for name, present in missing.items() if present]:
        raise SceneError(f"a scene in MuJoCo cannot have {' and '.join(found)} yet")


def write_scene(result: RunResult) -> str:
    """The scene of a run at its start, with a torque motor per joint, as MJCF."""
    scenario, angles = result.scenario, result.trace.joint_position[0]
    return describe_scene(scenario, angles, STEP, motors(scenario), describe_contact(STEP))


def contacts_of(scenario: Scenario) -> list[dict[str, Any]]:
    """Where each tip begins to slip and along which tangents, in the frame of the object.

    The slip of a tip at x, with the object at p and turned by R, is tangents (R' (x - p) - anchor).
    """
    if isinstance(scenario, SpatialScenario):
        faces = [mjcf_spatial.contact_of(scenario, i) for i in range(len(scenario.fingers))]
        places = [(face.anchor, (face.tangent_x, face.tangent_y)) for face in faces]
    else:
        frames = [contact_frame(scenario.object, finger) for finger in scenario.fingers]
        places = [(frame.anchor, (frame.tangent,)) for frame in frames]
    return [
        {"site": f"tip{i}", "anchor": point(anchor), "tangents": [*map(point, tangents)]}
        for i, (anchor, tangents) in enumerate(places)
    ]


def point(ours: Iterable[float]) -> list[float]:
    """A point or a direction of our plane or space in MuJoCo's axes."""
    values = [float(each) for each in ours]
    return [values[0], 0.0, values[1]] if len(values) == 2 else values


def start_coordinates(scenario: Scenario, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """MuJoCo's coordinates in the start pose: all joints, then the object's, then out of plane."""
    out_of_plane = [0.0] * (3 - scenario.space.num_positions)
    return np.concatenate((angles, scenario.trajectory.start, out_of_plane))


def motors(scenario: Scenario) -> str:
    """One torque motor per joint, in the order of our joints."""
    return "".join(f'<motor joint="{name}"/>' for name in joint_names(scenario))


def describe_scene(
    scenario: Scenario, angles: NDArray[np.float64], step: float, actuators: str, contact: Contact
) -> str:
    """The scene in MuJoCo's XML; its coordinates are those of `start_coordinates`.

    Args:
        scenario: The hand and its object.
        angles: Joint angles of the start pose, which place the tip spheres [rad].
        step: Time step [s].
        actuators: XML of the actuators.
        contact: How fingertips and object touch.
    """
    bodies = "".join(_bodies(scenario, angles.tolist(), contact))
    start = mjcf_spatial.numbers(start_coordinates(scenario, angles))
    return f"""<mujoco><option timestep="{step}" gravity="0 0 -{scenario.simulation.gravity}"
      integrator="implicitfast" cone="elliptic" noslip_iterations="{_NO_SLIP_ITERATIONS}"
      noslip_tolerance="1e-14" impratio="{contact.friction_hardness}"/>
      <worldbody>{bodies}</worldbody><actuator>{actuators}</actuator>
      <keyframe><key name="start" qpos="{start}"/></keyframe></mujoco>"""


def _bodies(scenario: Scenario, angles: list[float], contact: Contact) -> Iterator[str]:
    """All fingers, then the object."""
    if isinstance(scenario, SpatialScenario):
        for i in range(len(scenario.fingers)):
            yield mjcf_spatial.finger(scenario, i, angles[3 * i : 3 * i + 3], contact)
        yield mjcf_spatial.held_object(scenario, contact)
        return
    for i in range(len(scenario.fingers)):
        yield _finger(scenario, i, angles, contact)
    yield _held_object(scenario, contact)


def joint_names(scenario: Scenario) -> list[str]:
    """Names of all joints, in our order."""
    joints = scenario.space.joints_per_finger
    return [f"q{i}{joint}" for i in range(len(scenario.fingers)) for joint in range(joints)]


def _held_object(scenario: PlanarScenario, contact: Contact) -> str:
    body = scenario.object
    return f"""<body name="{OBJECT}">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
      <joint type="hinge" axis="0 -1 0"/><joint type="slide" axis="0 1 0"/>
      <inertial pos="0 0 0" mass="{body.mass}"
        diaginertia="{body.inertia} {body.inertia} {body.inertia}"/>
      <geom type="box" size="{body.half_width} {body.half_width} {body.face_half_length}"
        friction="0 0 0" condim="3" contype="2" conaffinity="1" {contact.attributes}/></body>"""


def _finger(scenario: PlanarScenario, i: int, angles: list[float], contact: Contact) -> str:
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
