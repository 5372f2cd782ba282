"""A scenario as a MuJoCo scene: same bodies, gravity, friction and start pose, as MJCF.

The object of a planar hand has an out-of-plane slide, without which MuJoCo's no-slip solver has no
effect.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.engines.bodies import (
    TIP_RADIUS,
    Chain,
    Floats,
    Link,
    Shape,
    chains_of,
    links_of,
    numbers,
)

_NO_SLIP_ITERATIONS = 5  # three give the same digits as ten
_OSCILLATION_PER_STEP = 0.3  # natural frequency of a contact times the step [rad]


class Contact(NamedTuple):
    """Parameters of a contact in MuJoCo other than its friction coefficient.

    Attributes:
        tip_radius: Radius of the sphere at the fingertip; our tips are points [m].
        attributes: MuJoCo's solver attributes of the geoms in contact.
        friction_hardness: MuJoCo's ``impratio``.
    """

    tip_radius: float
    attributes: str
    friction_hardness: float


def describe_contact(step: float) -> Contact:
    """A contact whose compliance falls with the square of the step.

    The contact is a spring and damper per unit of apparent mass: stiffness (0.3 / step)^2,
    half critically damped, which the step still resolves. MuJoCo's convex contact model couples
    friction with the normal direction: a sliding tip lifts off until it hops, unless friction is
    soft in the main solve (``impratio`` far below 1). The no-slip solver then restores Coulomb's
    law exactly.
    """
    frequency = _OSCILLATION_PER_STEP / step
    return Contact(
        tip_radius=TIP_RADIUS,
        attributes=f'solref="{-(frequency**2)} {-frequency}" solimp="0.5 0.5 0.001 0.5 2"',
        friction_hardness=1e-3,
    )


def start_coordinates(scenario: Scenario, angles: Floats) -> Floats:
    """MuJoCo's coordinates in the start pose: joints, object, then the out-of-plane slide."""
    out_of_plane = [0.0] * (3 - scenario.space.num_positions)
    return np.concatenate((angles, scenario.trajectory.start, out_of_plane))


def motors(scenario: Scenario) -> str:
    """One torque motor per joint, in the order of our joints."""
    return "".join(f'<motor joint="{name}"/>' for name in joint_names(scenario))


def joint_names(scenario: Scenario) -> list[str]:
    """Names of all joints, in our order."""
    fingers = range(len(scenario.fingers))
    return [link.joint for i in fingers for link in links_of(scenario, i)]


def describe_scene(
    scenario: Scenario, angles: Floats, step: float, actuators: str, contact: Contact
) -> str:
    """The scene in MuJoCo's XML; its coordinates are those of `start_coordinates`.

    Args:
        scenario: The hand and its object.
        angles: Joint positions of the start pose, which determine the tip spheres [rad, m].
        step: Time step [s].
        actuators: XML of the actuators.
        contact: Parameters of the contacts.
    """
    chains = chains_of(scenario, angles, contact.tip_radius)
    bodies = "".join(_chain(chain, contact) for chain in chains)
    start = numbers(start_coordinates(scenario, angles))
    return f"""<mujoco><option timestep="{step}" gravity="0 0 -{scenario.simulation.gravity}"
      integrator="implicitfast" cone="elliptic" noslip_iterations="{_NO_SLIP_ITERATIONS}"
      noslip_tolerance="1e-14" impratio="{contact.friction_hardness}"/>
      <worldbody>{bodies}</worldbody><actuator>{actuators}</actuator>
      <keyframe><key name="start" qpos="{start}"/></keyframe></mujoco>"""


def _chain(chain: Chain, contact: Contact) -> str:
    """Nested bodies; a joint whose body has no mass belongs to the next one."""
    text, depth, place, joints = "", 0, np.zeros(3), ""
    for link in chain.links:
        place, joints = place + link.place, joints + _joint(link)
        if link.mass:
            text += f"""<body name="{link.name}" pos="{numbers(place)}">{joints}
              <inertial pos="{numbers(link.centre)}" mass="{link.mass}"
                diaginertia="{numbers(link.inertias)}"/>"""
            depth, place, joints = depth + 1, np.zeros(3), ""
    if chain.tip is not None:
        text += f'<site name="{chain.shapes[0].name}" pos="{numbers(chain.tip)}"/>'
    elif chain.links[-1].kind != "free":
        text += '<joint type="slide" axis="0 1 0"/>'
    return text + "".join(_geom(shape, contact) for shape in chain.shapes) + "</body>" * depth


def _geom(shape: Shape, contact: Contact) -> str:
    # MuJoCo uses the larger of two friction coefficients, so that of the object is zero.
    kind, mask = ("box", (2, 1)) if shape.friction is None else ("sphere", (1, 2))
    return f"""<geom name="{shape.name}" type="{kind}" size="{numbers(shape.sizes)}"
      pos="{numbers(shape.frame.place)}" quat="{numbers(shape.frame.turn)}"
      friction="{shape.friction or 0.0} 0 0" condim="3" contype="{mask[0]}"
      conaffinity="{mask[1]}" {contact.attributes}/>"""


def _joint(link: Link) -> str:
    if link.kind == "free":
        return "<freejoint/>"
    return f'<joint name="{link.joint}" type="{link.kind}" axis="{numbers(link.axis)}"/>'
