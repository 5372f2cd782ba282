"""A scenario of a spatial hand: the parts that differ from those of a planar hand.

The hand stands in x, y, z with z up; the object is a convex polygon extruded along its own z axis.
Parameters with the same meaning as those of planar hands have the same key (docs/space.md).
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any, Literal

from annotated_types import Ge, Le, Len
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
from slipgrasp.core.scenario.field_types import CONFIG, Coordinate
from slipgrasp.core.scenario.finger import (
    Friction,
    JointDamping,
    JointFriction,
    LinkLengths,
    LinkMasses,
    SlidesMass,
    StaticFriction,
)
from slipgrasp.core.scenario.held_object import MAX_CORNERS, Corner, ObjectMass, Radius
from slipgrasp.core.scenario.motion import (
    MAX_SET_POINTS,
    MAX_TABLE_ROWS,
    Acceleration,
    AccelerationTime,
    Amplitude,
    Angle,
    CoastTime,
    Cycles,
    MotionKind,
    MoveDuration,
    MoveTime,
    Period,
    Time,
)
from slipgrasp.core.scenario.numerics import Change, SpatialSimulation
from slipgrasp.core.scenario.pads import PadPressure, PadRadius, eccentricity
from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.space import SPATIAL, Space
from slipgrasp.core.scenario.world import (
    ActuationParameters,
    Force,
    FrictionFactor,
    PatchEnd,
    PatchStart,
    PulseDuration,
    PulseTime,
    SensingParameters,
)

# side-K of an object runs from corner K to the next one.
SpatialFace = Literal[
    "side-0",
    "side-1",
    "side-2",
    "side-3",
    "side-4",
    "side-5",
    "side-6",
    "side-7",
    "side-8",
    "side-9",
    "side-10",
    "side-11",
    "top",
    "bottom",
]

Inertia = Annotated[float, Ge(1e-6), Le(1e3)]
Offset = Annotated[float, Ge(-10.0), Le(10.0)]
Fraction = Annotated[float, Ge(0.0), Le(1.0)]
Part = Annotated[float, Ge(-1.0), Le(1.0)]
Moment = Annotated[float, Ge(-1e3), Le(1e3)]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialObject:
    """The held object: a box, a prism, a cylinder or a sphere about its centre of mass."""

    mass: ObjectMass = 1.0
    inertias: Annotated[
        tuple[Inertia, Inertia, Inertia],
        Quantity(
            "True principal moments of inertia of the object about its x, y and z axes.",
            "kg m²",
            typical=(0.002, 0.05),
            changeable=True,
        ),
    ] = (0.13 / 12.0, 0.13 / 12.0, 0.08 / 12.0)
    half_width: Annotated[
        float, Ge(1e-3), Le(10.0), Quantity("Half the width of a box along its x axis.", "m")
    ] = 0.1
    half_depth: Annotated[
        float, Ge(1e-3), Le(10.0), Quantity("Half the depth of a box along its y axis.", "m")
    ] = 0.1
    height: Annotated[
        float,
        Ge(1e-3),
        Le(10.0),
        Quantity("Height along its z axis, half of it above the centre of mass.", "m"),
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
            "axis) or sphere.",
        ),
    ] = "prism"
    radius: Annotated[Radius, Quantity("Radius of a cylinder or a sphere.", "m")] = 0.1

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
            "(three independent joints with any positions and axes, and joints coupled to them).",
        ),
    ] = "links"
    mass: SlidesMass = 0.1
    joints: Annotated[
        tuple[ChainJoint, ...],
        Len(0, MAX_LINKS),
    ] = ()
    tip: Annotated[
        tuple[Coordinate, Coordinate, Coordinate],
        Quantity("position of the tip in the frame of the last link.", "m", used_by=("chain",)),
    ] = (0.0, 0.0, 0.0)
    attitude: Annotated[
        Attitude,
        Quantity("quaternion (w, x, y, z) of the base.", "1", used_by=("chain",)),
    ] = (1.0, 0.0, 0.0, 0.0)
    posture: Annotated[
        tuple[JointPosition, JointPosition, JointPosition],
        Quantity(
            "approximate initial joint positions (prismatic: in m).",
            "rad",
            used_by=("chain",),
        ),
    ] = (0.0, 0.0, 0.0)
    link_masses: LinkMasses = (1.0, 1.0)
    link_lengths: LinkLengths = (
        1.0,
        1.0,
    )
    base: Annotated[
        tuple[Coordinate, Coordinate, Coordinate],
        Quantity(
            "Position (x, y, z) of the first joint (for slides: of their origin; for a chain: of "
            "the frame of its base).",
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
            "sides.",
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
        tuple[Annotated[float, Ge(1e-6), Le(1.0)], Annotated[float, Ge(1e-6), Le(1.0)]],
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
class SpatialSetPoint:
    """A pose to move to with minimum jerk, from the end of the previous motion."""

    time: MoveTime
    duration: MoveDuration
    pose: Annotated[
        tuple[Coordinate, Coordinate, Coordinate, Angle, Angle, Angle],
        Quantity(
            "Absolute position (x, y, z) at the end of the motion, and rotation vector from the "
            "attitude of trajectory.start to the attitude there.",
            "m, m, m, rad, rad, rad",
        ),
    ]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialTrajectory:
    """The desired motion: positions x, y, z, and a rotation vector from the initial attitude."""

    kind: MotionKind = "coast"
    start: Annotated[
        tuple[Coordinate, Coordinate, Coordinate, Part, Part, Part, Part],
        Quantity(
            "Position (x, y, z) and unit quaternion (w, x, y, z, world from object) at the start, "
            "desired and actual.",
            "m, m, m, 1, 1, 1, 1",
        ),
    ] = (0.0, 0.0, 0.366, 1.0, 0.0, 0.0, 0.0)
    acceleration: Annotated[
        tuple[Acceleration, Acceleration, Acceleration, Acceleration, Acceleration, Acceleration],
        Quantity(
            "desired acceleration (x, y, z, rotation vector) while speeding up; its opposite "
            "while braking.",
            "m/s², m/s², m/s², rad/s², rad/s², rad/s²",
            used_by=("coast",),
        ),
    ] = (0.0, 0.0, 0.0256, 0.0, 0.0, 0.0)
    acceleration_time: AccelerationTime = 1.0
    coast_time: CoastTime = 5.0
    period: Period = 2.0
    cycles: Cycles = 2.0
    radius: Annotated[
        float,
        Ge(0.0),
        Le(10.0),
        Quantity(
            "radius of the circle, which lies in the x-z plane and starts at its lowest point.",
            "m",
            used_by=("circle",),
        ),
    ] = 0.05
    angle: Annotated[
        tuple[Angle, Angle, Angle],
        Quantity(
            "rotation vector at which the motion reverses.",
            "rad",
            used_by=("rotation",),
        ),
    ] = (0.0, 0.0, 0.3)
    amplitude: Annotated[
        tuple[Amplitude, Amplitude, Amplitude, Amplitude, Amplitude, Amplitude],
        Quantity(
            "amplitude (x, y, z, rotation vector) of the oscillation.",
            "m, m, m, rad, rad, rad",
            used_by=("shake",),
        ),
    ] = (0.0, 0.0, 0.02, 0.0, 0.0, 0.0)
    set_points: Annotated[
        tuple[SpatialSetPoint, ...],
        Len(0, MAX_SET_POINTS),
        Quantity("successive motions.", used_by=("set-points",)),
    ] = ()
    table: Annotated[
        tuple[
            tuple[Time, Coordinate, Coordinate, Coordinate, Angle, Angle, Angle],
            ...,
        ],
        Len(0, MAX_TABLE_ROWS),
        Quantity(
            "rows of time, position and rotation vector (t, x, y, z, rx, ry, rz), joined by a "
            "smooth curve; a scenario file can instead give the name of a CSV file in the same "
            "folder.",
            "s, m, m, m, rad, rad, rad",
            used_by=("table",),
        ),
    ] = ()

    @property
    def table_start(self) -> tuple[float, ...]:
        """The start pose as a row of a table, with rotations relative to the initial attitude."""
        return (*self.start[:3], 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialPulse:
    """A constant force and moment on the object for a limited time."""

    time: PulseTime
    duration: PulseDuration = 0.05
    force: Annotated[
        tuple[Force, Force, Force],
        Quantity("Force (x, y, z) on the centre of mass, in the inertial frame.", "N"),
    ] = (0.0, 0.0, -5.0)
    moment: Annotated[
        tuple[Moment, Moment, Moment],
        Quantity("Moment (x, y, z), in the inertial frame.", "N m"),
    ] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialPatch:
    """A round patch of a face with different friction; may be temporary."""

    face: Annotated[SpatialFace, Quantity("Face of the patch.")]
    centre: Annotated[
        tuple[Offset, Offset],
        Quantity(
            "Position of the centre along the two tangents of the face, from the centre of a side, "
            "or from the axis on top and bottom.",
            "m",
        ),
    ] = (0.0, 0.0)
    radius: Annotated[float, Ge(1e-4), Le(10.0), Quantity("Radius of the patch.", "m")] = 0.03
    friction_factor: FrictionFactor = 0.6
    start_time: PatchStart = 0.0
    end_time: PatchEnd = None

    @property
    def place(self) -> tuple[str, tuple[float, float], float]:
        """Position and size of the patch: face, centre and radius [m]."""
        return self.face, self.centre, self.radius


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

    @property
    def space(self) -> Space:
        """Functions and constants that depend on the kind of hand."""
        return SPATIAL

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
