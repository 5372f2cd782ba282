"""A scenario of a spatial hand: the parts that differ from those of a planar hand.

The hand stands in x, y, z with z up; the object is a convex polygon extruded along its own z axis.
Parameters with the same meaning as those of planar hands have the same key (docs/space.md).
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any, Literal

from annotated_types import Interval, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.chain import (
    MAX_LINKS,
    Attitude,
    Chain,
    ChainJoint,
    sliding_joints,
    torque_limits,
)
from slipgrasp.core.scenario.chain import Angle as JointPosition
from slipgrasp.core.scenario.common import (
    Changes,
    Estimates,
    Fingers,
    FrictionCone,
    Patches,
    Pulses,
    Title,
    names_by_face,
    without_none,
)
from slipgrasp.core.scenario.controller import Estimate, SpatialController
from slipgrasp.core.scenario.field_types import (
    CONFIG,
    Coordinate,
    Fraction,
    InertiaFraction,
    Length,
    Offset,
    SpatialFace,
)
from slipgrasp.core.scenario.finger import (
    Friction,
    JointDamping,
    JointFriction,
    LinkLengths,
    LinkMasses,
    SlidesMass,
    StaticFriction,
)
from slipgrasp.core.scenario.held_object import MAX_CORNERS, Corner, ObjectMass
from slipgrasp.core.scenario.motion import (
    SpatialSetPoint,
    SpatialTrajectory,
)
from slipgrasp.core.scenario.numerics import Change, SpatialSimulation
from slipgrasp.core.scenario.pads import PadPressure, PadRadius, eccentricity
from slipgrasp.core.scenario.parameters import Quantity, changeable
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.core.scenario.world import (
    ActuationParameters,
    SensingParameters,
    SpatialPatch,
    SpatialPulse,
)

Inertia = Annotated[float, Interval(ge=1e-6, le=1e3)]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialObject:
    """The held object: a box, a prism, a cylinder or a sphere about its centre of mass."""

    mass: ObjectMass = 1.0
    inertias: Annotated[
        tuple[Inertia, Inertia, Inertia],
        changeable(
            "True principal moments of inertia of the object about its x, y and z axes.",
            "kg m²",
            typical=(0.002, 0.05),
        ),
    ] = (0.13 / 12.0, 0.13 / 12.0, 0.08 / 12.0)
    half_width: Annotated[Length, Quantity("Half the width of a box along its x axis.", "m")] = 0.1
    half_depth: Annotated[Length, Quantity("Half the depth of a box along its y axis.", "m")] = 0.1
    height: Annotated[
        Length, Quantity("Height along its z axis, half of it above the centre of mass.", "m")
    ] = 0.3
    corners: Annotated[
        tuple[Corner, ...],
        Len(0, MAX_CORNERS),
        Quantity(
            "Corners (x, y) of the convex base of a prism, counterclockwise, relative to its "
            "centre of mass; omitted: a box.",
            "m",
        ),
    ] = ()
    shape: Annotated[
        Literal["prism", "cylinder", "sphere"],
        Quantity(
            "Shape of the object: prism (a box unless corners are given), cylinder (along the z "
            "axis) or sphere."
        ),
    ] = "prism"
    radius: Annotated[Length, Quantity("Radius of a cylinder or a sphere.", "m")] = 0.1

    @property
    def is_round(self) -> bool:
        """Whether the faces are curved."""
        return self.shape != "prism"

    @property
    def half_sizes(self) -> tuple[float, float]:
        """Half the sizes along x and y of a box, or of the box around a round object [m]."""
        if self.is_round:
            return self.radius, self.radius
        return self.half_width, self.half_depth

    @property
    def half_height(self) -> float:
        """Half the height along the z axis [m]."""
        return self.radius if self.shape == "sphere" else 0.5 * self.height

    @property
    def face_names(self) -> tuple[str, ...]:
        """Names of the faces.

        Curved faces are one face: their names are the origins of the contact offset.
        """
        return (*(f"side-{k}" for k in range(len(self.corners) or 4)), "top", "bottom")


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialFinger:
    """A finger whose base turns about a vertical axis, with two links that move in one plane.

    Alternatively a tip on three slides, or on a chain with three independent joints.
    """

    kind: Annotated[
        Literal["links", "slides", "chain"],
        Quantity(
            "Mechanism of the finger: links (a yaw axis and two links), slides (one along each "
            "axis, with one moving mass; joint positions are then in m and torques in N) or chain "
            "(three independent joints with any positions and axes, and joints coupled to them)."
        ),
    ] = "links"
    mass: SlidesMass = 0.1
    joints: Annotated[tuple[ChainJoint, ...], Len(0, MAX_LINKS)] = ()
    tip: Annotated[
        tuple[Coordinate, Coordinate, Coordinate],
        Quantity("position of the tip in the frame of the last link.", "m", used_by=("chain",)),
    ] = (0.0, 0.0, 0.0)
    attitude: Annotated[
        Attitude, Quantity("quaternion (w, x, y, z) of the base.", "1", used_by=("chain",))
    ] = (1.0, 0.0, 0.0, 0.0)
    posture: Annotated[
        tuple[JointPosition, JointPosition, JointPosition],
        Quantity(
            "approximate initial joint positions (prismatic: in m).", "rad", used_by=("chain",)
        ),
    ] = (0.0, 0.0, 0.0)
    link_masses: LinkMasses = (1.0, 1.0)
    link_lengths: LinkLengths = (1.0, 1.0)
    base: Annotated[
        tuple[Coordinate, Coordinate, Coordinate],
        Quantity(
            "Position (x, y, z) of the first joint (for slides: of their origin; for a chain: "
            "of the frame of its base).",
            "m",
        ),
    ]
    friction: Friction = 0.25
    static_friction: StaticFriction = None
    joint_damping: JointDamping = 0.0
    joint_friction: JointFriction = 0.0
    pad_radius: PadRadius = 0.0
    pad_pressure: PadPressure = "even"
    face: Annotated[
        SpatialFace,
        Quantity(
            "Face that the fingertip touches: side-K, from corner K to the next corner, top or "
            "bottom; side-0 to side-3 of a box, cylinder or sphere are on the -y, +x, +y and -x "
            "sides."
        ),
    ]
    contact_offset: Annotated[
        tuple[Offset, Offset],
        Quantity(
            "Initial position of the fingertip along the two tangents of the face, from the centre "
            "of a side, or from the axis on top and bottom; on curved faces along an arc.",
            "m",
        ),
    ] = (0.0, 0.0)
    elbow: Annotated[
        Literal["up", "down"],
        Quantity(
            "branch of the inverse kinematics: sign of the third joint angle, up = negative.",
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
            "inertia of a link about axes perpendicular to it through its centre of mass, divided "
            "by mass times length squared.",
            "1",
            used_by=("links",),
        ),
    ] = (1.0 / 12.0, 1.0 / 12.0)

    @property
    def chain(self) -> Chain:
        """The chain of joints of a finger of this kind."""
        return Chain(self.base, self.attitude, self.joints, self.tip)

    @property
    def eccentricity(self) -> float:
        """Ratio of the largest moment to the largest tangential force, 0 for a point [m]."""
        return eccentricity(self.pad_radius, self.pad_pressure)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialScenario:
    """A spatial hand, an object, a desired motion, a controller and its unknown parameters.

    Equal scenarios give runs that are equal to the last bit.
    """

    title: Title = ""
    object: SpatialObject = SpatialObject()
    fingers: Fingers[SpatialFinger]
    trajectory: SpatialTrajectory = SpatialTrajectory()
    controller: SpatialController = SpatialController()
    estimates: Estimates = ()
    sensing: SensingParameters = SensingParameters()
    actuation: ActuationParameters = ActuationParameters()
    simulation: SpatialSimulation = SpatialSimulation()
    pulses: Pulses[SpatialPulse] = ()
    patches: Patches[SpatialPatch] = ()
    changes: Changes = ()

    # Functions and constants that depend on the kind of hand.
    space = SPATIAL

    @property
    def has_soft_fingers(self) -> bool:
        """Whether any fingertip resists rotation on its face."""
        return any(finger.eccentricity > 0.0 for finger in self.fingers)

    @property
    def finger_names(self) -> tuple[str, ...]:
        """Names of the fingers: the faces that they touch, numbered if several share a face."""
        return names_by_face([finger.face for finger in self.fingers])

    @property
    def slides(self) -> tuple[int, ...]:
        """Indices of the fingers on slides."""
        return tuple(i for i, finger in enumerate(self.fingers) if finger.kind == "slides")

    @property
    def sliding_joints(self) -> tuple[int, ...]:
        """Indices of the prismatic joints among those of all fingers."""
        return sliding_joints(self.fingers, SPATIAL.joints_per_finger)

    @property
    def torque_limits(self) -> tuple[tuple[str, float | None], ...]:
        """Key and value of the torque limit of every joint, finger by finger."""
        limit = self.actuation.torque_limit
        return torque_limits(self.fingers, limit, SPATIAL.joints_per_finger)

    @property
    def friction_cone(self) -> FrictionCone:
        """Shape of the friction cone: a cone, or a pyramid along both tangents."""
        return self.simulation.friction

    def to_mapping(self) -> dict[str, Any]:
        """The scenario as nested plain values, omitting None and empty ``parameters``."""
        return asdict(self, dict_factory=without_none)


def full_spatial_scenario() -> SpatialScenario:
    """A scenario with an item in every list; not for simulation."""
    return SpatialScenario(
        object=SpatialObject(inertias=(0.01, 0.01, 0.01), height=0.1, corners=((0.0, 0.0),)),
        fingers=(SpatialFinger(base=(0.0, 0.0, 0.0), face="side-0", joints=(ChainJoint(),)),) * 2,
        trajectory=SpatialTrajectory(
            set_points=(
                SpatialSetPoint(time=0.0, duration=1.0, pose=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)),
            ),
            table=((0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),),
        ),
        pulses=(SpatialPulse(time=0.0),),
        patches=(SpatialPatch(face="side-0"),),
        controller=SpatialController(lyapunov_matrix=((1.0,),)),
        estimates=(Estimate(parameter="object.mass", initial=1.0),),
        changes=(Change(time=1.0, parameter="object.mass", value=1.0),),
    )
