"""A finger and its contact with the object."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Interval, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.chain import NUM_PLANAR_JOINTS, Angle, Chain, PlanarJoint, about_z
from slipgrasp.core.scenario.field_types import (
    CONFIG,
    Coordinate,
    Face,
    Fraction,
    InertiaFraction,
    Offset,
)
from slipgrasp.core.scenario.parameters import Quantity, changeable

FingerKind = Annotated[
    Literal["links", "slides", "chain"],
    Quantity(
        "Mechanism of the finger: links (revolute joints), slides (one along each axis, with one "
        "moving mass; joint positions are then in m and torques in N) or chain (two joints with "
        "any positions and axes)."
    ),
]
SlidesMass = Annotated[
    float,
    Interval(ge=1e-3, le=1e3),
    changeable(
        "true mass that moves with the tip.", "kg", typical=(0.02, 2.0), used_by=("slides",)
    ),
]
LinkMass = Annotated[float, Interval(ge=1e-3, le=1e3)]
LinkLength = Annotated[float, Interval(ge=1e-3, le=1e2)]
Friction = Annotated[
    float,
    Interval(ge=0.0, le=10.0),
    changeable(
        "True Coulomb friction coefficient between fingertip and object.", "1", typical=(0.05, 1.0)
    ),
]
StaticFriction = Annotated[
    float | None,
    Interval(ge=0.0, le=10.0),
    changeable(
        "True friction coefficient of a sticking fingertip, not smaller than friction (default: "
        "the same).",
        "1",
        typical=(0.05, 1.0),
    ),
]
JointDamping = Annotated[
    float,
    Interval(ge=0.0, le=1e3),
    changeable(
        "Viscous friction of each joint: torque per joint velocity (for slides: N s/m); unknown to "
        "all laws.",
        "N m s",
        typical=(0.0, 1.0),
    ),
]
JointFriction = Annotated[
    float,
    Interval(ge=0.0, le=1e3),
    changeable(
        "Dry friction of each joint at high speed (for slides: N); at 0.01 rad/s (for slides: "
        "0.01 m/s) it is 71 % of this value; unknown to all laws.",
        "N m",
        typical=(0.0, 1.0),
    ),
]


LinkMasses = Annotated[
    tuple[LinkMass, LinkMass],
    changeable("true mass of a link.", "kg", typical=(0.2, 3.0), used_by=("links",)),
]
LinkLengths = Annotated[
    tuple[LinkLength, LinkLength], Quantity("length of a link.", "m", used_by=("links",))
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class FingerParameters:
    """A planar finger with two links, slides or joints; its tip touches one face of the object."""

    kind: FingerKind = "links"
    mass: SlidesMass = 0.1
    joints: Annotated[tuple[PlanarJoint, ...], Len(0, NUM_PLANAR_JOINTS)] = ()
    tip: Annotated[
        tuple[Coordinate, Coordinate],
        Quantity("position of the tip in the frame of the last link.", "m", used_by=("chain",)),
    ] = (0.0, 0.0)
    attitude: Annotated[Angle, Quantity("angle of the base.", "rad", used_by=("chain",))] = 0.0
    posture: Annotated[
        tuple[Angle, Angle],
        Quantity(
            "approximate joint positions (prismatic: in m), which choose the branch of the inverse "
            "kinematics.",
            "rad",
            used_by=("chain",),
        ),
    ] = (0.0, 0.0)
    link_masses: LinkMasses = (1.0, 1.0)
    link_lengths: LinkLengths = (1.0, 1.0)
    base: Annotated[
        tuple[Coordinate, Coordinate],
        Quantity(
            "Position (x, y) of the first joint (for slides: of their origin; for a chain: of the "
            "frame of its base).",
            "m",
        ),
    ]
    friction: Friction = 0.25
    static_friction: StaticFriction = None
    joint_damping: JointDamping = 0.0
    joint_friction: JointFriction = 0.0
    face: Annotated[
        Face,
        Quantity(
            "Face that the fingertip touches: left, right, bottom or top of a rectangle or circle, "
            "or edge-K of a polygon, from corner K to the next corner."
        ),
    ]
    contact_offset: Annotated[
        Offset,
        Quantity(
            "Initial position of the fingertip along the face, from the centre of the face; on a "
            "circle along its arc.",
            "m",
        ),
    ] = 0.0
    elbow: Annotated[
        Literal["up", "down"],
        Quantity(
            "branch of the inverse kinematics: sign of the second joint angle, up = negative.",
            used_by=("links",),
        ),
    ] = "up"
    link_centre_fractions: Annotated[
        tuple[Fraction, Fraction],
        Quantity("centre of mass of a link as a fraction of its length.", "1", used_by=("links",)),
    ] = (0.5, 0.5)
    link_inertia_fractions: Annotated[
        tuple[InertiaFraction, InertiaFraction],
        Quantity(
            "inertia of a link about its centre of mass, divided by mass times length squared.",
            "1",
            used_by=("links",),
        ),
    ] = (1.0 / 12.0, 1.0 / 12.0)

    @property
    def chain(self) -> Chain:
        """The chain of joints of a finger of this kind, in the x-y plane of space."""
        joints = tuple(joint.spatial for joint in self.joints)
        base, tip = (*self.base, 0.0), (*self.tip, 0.0)
        return Chain(base, about_z(self.attitude), joints, tip)
