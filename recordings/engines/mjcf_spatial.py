"""Bodies of a spatial hand in MuJoCo's XML; axes, angles and quaternions are ours.

Each face that is touched is a slab of its own below the face, because MuJoCo finds where a
sphere touches a box in closed form, and a prism only by iterating.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial import SpatialFinger, SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import (
    SpatialContact,
    rotation_matrix,
    spatial_contact,
)

Floats = NDArray[np.float64]

_SLAB = 0.01  # half the thickness of the slab below a face [m]
_THIN = 1e-9  # what MuJoCo wants of a thin rod about its own axis [kg m^2]


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


def held_object(scenario: SpatialScenario, contact: Contact) -> str:
    """The object, free to move, with a slab below every face that a finger touches."""
    body = scenario.object
    faces = {finger.face: spatial_contact(body, finger) for finger in scenario.fingers}
    slabs = "".join(_slab(face, contact) for face in faces.values())
    return f"""<body name="object"><freejoint/>
      <inertial pos="0 0 0" mass="{body.mass}" diaginertia="{numbers(body.inertias)}"/>
      {slabs}</body>"""


def finger(scenario: SpatialScenario, i: int, angles: list[float], contact: Contact) -> str:
    """Finger ``i``: a yaw and a pitch at its base, a pitch at its elbow, a sphere at its tip."""
    own = scenario.fingers[i]
    l1, l2 = own.link_lengths
    first, second = (_inertial(own, link) for link in range(2))
    radius = contact.tip_radius
    # The sphere touches the face exactly at the end of the link.
    inward = rotation(scenario.trajectory.start[3:]) @ contact_of(scenario, i).normal
    tip = np.array([l2, 0.0, 0.0]) - radius * _outer_link(angles).T @ inward
    return f"""<body pos="{numbers(own.base)}">
      <joint name="q{i}0" type="hinge" axis="0 0 1"/>
      <joint name="q{i}1" type="hinge" axis="0 -1 0"/>{first}
      <body pos="{l1} 0 0"><joint name="q{i}2" type="hinge" axis="0 -1 0"/>{second}
        <site name="tip{i}" pos="{l2} 0 0"/>
        <geom type="sphere" size="{radius}" pos="{numbers(tip)}" friction="{own.friction} 0 0"
          condim="3" contype="1" conaffinity="2" {contact.attributes}/></body></body>"""


def rotation(quaternion: Floats | tuple[float, ...]) -> Floats:
    """R(Q), world from object."""
    w, x, y, z = (float(part) for part in quaternion)
    return np.array(rotation_matrix((w, x, y, z)))


def contact_of(scenario: SpatialScenario, i: int) -> SpatialContact:
    """Where a finger touches the object."""
    return spatial_contact(scenario.object, scenario.fingers[i])


def _outer_link(angles: list[float]) -> Floats:
    """Attitude of the outer link, world from link."""
    yaw, pitch = angles[0], angles[1] + angles[2]
    along = np.array([np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)])
    across = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
    return np.stack([along, across, np.cross(along, across)], axis=1)


def _slab(face: SpatialContact, contact: Contact) -> str:
    low, high = np.min(face.outline, axis=0), np.max(face.outline, axis=0)
    middle = 0.5 * (low + high)
    axes = np.array([face.tangent_x, face.tangent_y, face.normal])
    place = face.anchor + np.array([*middle, _SLAB]) @ axes
    return f"""<geom type="box" size="{numbers([*(0.5 * (high - low)), _SLAB])}"
      pos="{numbers(place)}" xyaxes="{numbers([*face.tangent_x, *face.tangent_y])}"
      friction="0 0 0" condim="3" contype="2" conaffinity="1" {contact.attributes}/>"""


def _inertial(own: SpatialFinger, link: int) -> str:
    mass, length = own.link_masses[link], own.link_lengths[link]
    inertia = own.link_inertia_fractions[link] * mass * length**2
    centre = own.link_centre_fractions[link] * length
    return f"""<inertial pos="{centre} 0 0" mass="{mass}"
      diaginertia="{_THIN} {inertia} {inertia}"/>"""


def numbers(values: Iterable[float]) -> str:
    """Numbers as XML has them."""
    return " ".join(repr(float(value)) for value in values)
