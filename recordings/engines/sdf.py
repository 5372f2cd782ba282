"""A scenario as a scene for Drake: bodies, joints, friction and contacts as SDFormat.

The file is in the start pose, in which Drake's joint positions are zero. Properties without an
element of SDFormat in Drake are settings of the plant, in the file of the expected motion.
"""

from __future__ import annotations

from typing import Any

from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.engines.bodies import (
    LEAST_MASS,
    Chain,
    Floats,
    Frame,
    Shape,
    chains_of,
    numbers,
)

_APPARENT_MASS = 0.3  # of a fingertip [kg]
_OSCILLATION_PER_STEP = 0.3  # natural frequency of a contact times the step [rad]
_TYPICAL_FORCE = 20.0  # normal force at which ``similar`` is half critically damped [N]
_STICTION_SPEED = 1e-6  # speed below which friction is viscous in ``similar`` [m/s]
_ROUGH = 1e9  # Drake combines friction as 2 a b / (a + b), which is 2 a if b is this
_TYPES = {"hinge": "revolute", "slide": "prismatic"}


def settings(scenario: Scenario, step: float, approximation: str = "sap") -> dict[str, Any]:
    """Fields of Drake's ``MultibodyPlantConfig``, and the gravity [m/s^2].

    Args:
        scenario: The hand and its object.
        step: Drake's time step [s].
        approximation: Drake's convex approximation of contacts.
    """
    return {
        "plant": {
            "time_step": step,
            "contact_model": "point",
            "discrete_contact_approximation": approximation,
            "stiction_tolerance": _STICTION_SPEED,
        },
        "gravity": [0.0, 0.0, -scenario.simulation.gravity],
    }


def describe_scene(scenario: Scenario, angles: Floats, step: float) -> str:
    """The scene in SDFormat.

    Args:
        scenario: The hand and its object.
        angles: Joint positions of the start pose [rad, m].
        step: Drake's time step, which determines the stiffness of contacts [s].
    """
    chains = "".join(_chain(chain, step) for chain in chains_of(scenario, angles))
    return f"""<sdf version="1.9" xmlns:drake="http://drake.mit.edu"><model name="grasp">
      {chains}</model></sdf>"""


def _chain(chain: Chain, step: float) -> str:
    """Links and joints; an effort limit of zero means that Drake adds no motor."""
    text, parent = "", "world"
    limit = "<limit><effort>0</effort></limit>" if chain.tip is None else ""
    shapes = "".join(_collision(shape, step) for shape in chain.shapes)
    for link, frame in zip(chain.links, chain.frames, strict=True):
        xx, yy, zz = link.inertias
        text += f"""<link name="{link.name}">{_pose(frame)}
          <inertial><pose>{numbers(link.centre)} 0 0 0</pose><mass>{link.mass or LEAST_MASS}</mass>
            <inertia><ixx>{xx}</ixx><iyy>{yy}</iyy><izz>{zz}</izz>
            <ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>
          {shapes if link is chain.links[-1] else ""}</link>"""
        if link.kind != "free":
            text += f"""<joint name="{link.joint}" type="{_TYPES[link.kind]}">
              <parent>{parent}</parent><child>{link.name}</child>
              <axis><xyz>{numbers(link.axis)}</xyz>{limit}</axis></joint>"""
        parent = link.name
    if chain.tip is not None:
        text += f"""<frame name="{chain.shapes[0].name}" attached_to="{parent}">
          {_pose(Frame(chain.tip))}</frame>"""
    return text


def _collision(shape: Shape, step: float) -> str:
    """A contact whose compliance falls with the square of the step, as in MuJoCo's scene.

    Both bodies have twice the stiffness, because they are in series; ``similar`` uses the
    dissipation, ``sap`` the relaxation time.
    """
    frequency = _OSCILLATION_PER_STEP / step
    if shape.friction is None:
        friction, form = _ROUGH, f"<box><size>{numbers(2.0 * shape.sizes)}</size></box>"
    else:
        form = f"<sphere><radius>{numbers(shape.sizes)}</radius></sphere>"
        friction = 0.5 * shape.friction
    properties = {
        "point_contact_stiffness": 2.0 * _APPARENT_MASS * frequency**2,
        "hunt_crossley_dissipation": _APPARENT_MASS * frequency / _TYPICAL_FORCE,
        "relaxation_time": 1.0 / frequency,
        "mu_dynamic": friction,
        "mu_static": friction,
    }
    values = "".join(f"<drake:{key}>{value}</drake:{key}>" for key, value in properties.items())
    return f"""<collision name="{shape.name}">{_pose(shape.frame)}
      <geometry>{form}</geometry>
      <drake:proximity_properties>{values}</drake:proximity_properties></collision>"""


def _pose(frame: Frame) -> str:
    w, *vector = frame.turn
    values = numbers([*frame.place, *vector, w])
    return f'<pose rotation_format="quat_xyzw">{values}</pose>'
