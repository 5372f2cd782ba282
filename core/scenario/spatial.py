"""A scenario in space: its parts where they differ from those in the plane.

The hand stands in x, y, z with z up; the object is a convex polygon extruded along its own z axis.
Whatever means the same as in the plane has the same key (docs/space.md).
"""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.controller import (
    ControllerParameters,
    Estimate,
    Gain,
    PositiveGain,
    Weight,
)
from slipgrasp.core.scenario.field_types import CONFIG, Coordinate
from slipgrasp.core.scenario.finger import (
    Friction,
    JointDamping,
    JointFriction,
    LinkLength,
    LinkMass,
    StaticFriction,
)
from slipgrasp.core.scenario.held_object import MAX_CORNERS, Corner
from slipgrasp.core.scenario.laws import CONTROL_LAWS
from slipgrasp.core.scenario.motion import (
    MAX_SET_POINTS,
    MAX_TABLE_ROWS,
    Acceleration,
    Amplitude,
    Angle,
    Time,
)
from slipgrasp.core.scenario.numerics import Change, SimulationParameters
from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.whole import MAX_FINGERS, Scenario
from slipgrasp.core.scenario.world import (
    MAX_PATCHES,
    Force,
    FrictionFactor,
    Patch,
    PatchEnd,
    PatchStart,
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
_MAX_ROWS = 2 * (6 + 2 * MAX_FINGERS)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialObject:
    """The held object: a box or a prism about its centre of mass."""

    mass: Annotated[
        float,
        Ge(1e-3),
        Le(1e3),
        Quantity("True mass of the object.", "kg", typical=(0.2, 3.0), changeable=True),
    ] = 1.0
    inertias: Annotated[
        tuple[Inertia, Inertia, Inertia],
        Quantity(
            "True principal moments of inertia of the object about its x, y and z axis.",
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
            "Corners (x, y) of the convex base of a prism, counterclockwise, from its centre of "
            "mass; none: a box.",
            "m",
        ),
    ] = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialFinger:
    """A finger whose base turns about a vertical axis, with two links that move in its plane."""

    link_masses: Annotated[
        tuple[LinkMass, LinkMass],
        Quantity("True mass of a link.", "kg", typical=(0.2, 3.0), changeable=True),
    ] = (1.0, 1.0)
    link_lengths: Annotated[tuple[LinkLength, LinkLength], Quantity("Length of a link.", "m")] = (
        1.0,
        1.0,
    )
    base: Annotated[
        tuple[Coordinate, Coordinate, Coordinate],
        Quantity("Position (x, y, z) of the finger's first joint.", "m"),
    ]
    friction: Friction = 0.25
    static_friction: StaticFriction = None
    joint_damping: JointDamping = 0.0
    joint_friction: JointFriction = 0.0
    face: Annotated[
        SpatialFace,
        Quantity(
            "Face of the object the tip touches: side-K, from corner K to the next, top or bottom; "
            "of a box side-0 to side-3 face -y, +x, +y, -x."
        ),
    ]
    contact_offset: Annotated[
        tuple[Offset, Offset],
        Quantity(
            "Where along the two tangents of the face the tip starts, from the middle of a side, "
            "or from the axis of top and bottom.",
            "m",
        ),
    ] = (0.0, 0.0)
    elbow: Annotated[
        Literal["up", "down"],
        Quantity("Branch of the inverse kinematics: sign of the third joint angle, up = negative."),
    ] = "up"
    link_centre_fractions: Annotated[
        tuple[Fraction, Fraction],
        Quantity("Centre of mass of a link as a fraction of its length.", "1"),
    ] = (0.5, 0.5)
    link_inertia_fractions: Annotated[
        tuple[Annotated[float, Ge(1e-6), Le(1.0)], Annotated[float, Ge(1e-6), Le(1.0)]],
        Quantity(
            "Inertia of a link across its centre of mass, divided by mass times length squared.",
            "1",
        ),
    ] = (1.0 / 12.0, 1.0 / 12.0)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialSetPoint:
    """A pose to move to, with the least jerk, from wherever the set-point before has led."""

    time: Annotated[float, Ge(0.0), Le(600.0), Quantity("When the move begins.", "s")]
    duration: Annotated[float, Ge(1e-3), Le(600.0), Quantity("How long the move takes.", "s")]
    pose: Annotated[
        tuple[Coordinate, Coordinate, Coordinate, Angle, Angle, Angle],
        Quantity(
            "Position (x, y, z) at its end, and the rotation vector by which the object is turned "
            "from its start attitude.",
            "m, m, m, rad, rad, rad",
        ),
    ]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialTrajectory:
    """The desired motion: positions x, y, z, and a rotation vector from the start attitude."""

    kind: Annotated[
        Literal["coast", "set-points", "circle", "rotation", "shake", "table"],
        Quantity(
            "Shape of the motion: coast (accelerate, coast, brake, Eq. 64), set-points, circle, "
            "rotation (turn and back), shake, or a table of poses."
        ),
    ] = "coast"
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
    acceleration_time: Annotated[
        float,
        Ge(0.0),
        Le(1e3),
        Quantity(
            "How long it speeds up, and how long it brakes: coast, circle, rotation, shake.", "s"
        ),
    ] = 1.0
    coast_time: Annotated[
        float,
        Ge(0.0),
        Le(1e3),
        Quantity("how long it moves at constant speed in between.", "s", used_by=("coast",)),
    ] = 5.0
    period: Annotated[
        float,
        Ge(0.01),
        Le(600.0),
        Quantity("time of one cycle at full speed.", "s", used_by=("circle", "rotation", "shake")),
    ] = 2.0
    cycles: Annotated[
        float,
        Ge(1e-3),
        Le(1e4),
        Quantity("how many cycles until it rests.", "1", used_by=("circle", "rotation", "shake")),
    ] = 2.0
    radius: Annotated[
        float,
        Ge(0.0),
        Le(10.0),
        Quantity(
            "its radius; it stands upright along x, and begins at the bottom.",
            "m",
            used_by=("circle",),
        ),
    ] = 0.05
    angle: Annotated[
        tuple[Angle, Angle, Angle],
        Quantity(
            "rotation vector by which it turns before it turns back.",
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
        Quantity("the moves, one after another.", used_by=("set-points",)),
    ] = ()
    table: Annotated[
        tuple[
            tuple[Time, Coordinate, Coordinate, Coordinate, Angle, Angle, Angle],
            ...,
        ],
        Len(0, MAX_TABLE_ROWS),
        Quantity(
            "rows of time, position and rotation vector (t, x, y, z, rx, ry, rz), joined by a "
            "smooth curve; in a scenario file also the name of a CSV file beside it.",
            "s, m, m, m, rad, rad, rad",
            used_by=("table",),
        ),
    ] = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialController(ControllerParameters):
    """The control law, its gains and how it meets the plant; six coordinates of the object."""

    position_gain: Annotated[
        Gain | Annotated[tuple[Gain, ...], Len(6, 6)],
        Quantity(
            "K_p: one number for the object, or one per coordinate x, y, z and rotation vector.",
            "1/s²",
            typical=(10.0, 400.0),
            changeable=True,
        ),
    ] = 100.0
    slip_position_gain: Annotated[
        Gain | tuple[Gain, ...],
        Quantity(
            "K_p of the slips, K_p2 of the appendix: pulls a slipping contact back to where it "
            "started, one number or two per contact; 0: only its velocity is to end.",
            "1/s²",
            typical=(0.0, 400.0),
            changeable=True,
        ),
    ] = 0.0
    velocity_gain: Annotated[
        PositiveGain | tuple[PositiveGain, ...],
        Quantity(
            "K_v: one number, or one per coordinate x, y, z, rotation vector and the two slips of "
            "each contact.",
            "1/s",
            typical=(2.0, 50.0),
            changeable=True,
        ),
    ] = 10.0
    lyapunov_weight: Annotated[
        Gain | tuple[Gain, ...],
        Quantity(
            "Q: weight of the errors in the Lyapunov function, a number times the identity or one "
            "per coordinate x, y, z, rotation vector and the two slips of each contact.",
            "1",
            typical=(1.0, 100.0),
            changeable=True,
        ),
    ] = 20.0
    lyapunov_matrix: Annotated[
        tuple[Annotated[tuple[Weight, ...], Len(1, _MAX_ROWS)], ...],
        Len(0, _MAX_ROWS),
        Quantity(
            "Q in full instead of lyapunov_weight: symmetric and positive definite, a row for each "
            "coordinate of the error (x, y, z, rotation vector and the two slips of each contact) "
            "and then of its rate.",
            "1",
        ),
    ] = ()
    distribution: Annotated[  # pyright: ignore[reportIncompatibleVariableOverride]
        Literal["exact", "hold", "softened"],
        Quantity(
            "How the contact forces share the wanted wrench: hold (every contact inside its cone, "
            "slipping or not), exact (forces of slipping contacts on their cones, the paper's) or "
            "softened (exact but for what only huge forces would give).",
            changeable=True,
            used_by=tuple(law.kind for law in CONTROL_LAWS.values() if law.uses_friction),
        ),
    ] = "hold"


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialSimulation(SimulationParameters):
    """Duration, output, gravity, kind of friction and accuracy of the integration."""

    gravity: Annotated[
        float, Ge(0.0), Le(100.0), Quantity("Gravitational acceleration along -z.", "m/s²")
    ] = 9.81
    friction: Annotated[
        Literal["cone", "pyramid"],
        Quantity(
            "Friction of a contact along its two tangents: cone (Coulomb's law) or pyramid (the "
            "paper's, which bounds each tangential force by itself)."
        ),
    ] = "cone"


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialPulse:
    """A constant force and moment on the object for a while."""

    time: Annotated[float, Ge(0.0), Le(600.0), Quantity("When it begins.", "s")]
    duration: Annotated[float, Ge(1e-4), Le(600.0), Quantity("How long it lasts.", "s")] = 0.05
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
    """A round part of a face with other friction, such as a wet spot; it may come and go."""

    face: Annotated[SpatialFace, Quantity("Face it lies on.")]
    centre: Annotated[
        tuple[Offset, Offset],
        Quantity(
            "Where its middle lies along the two tangents of the face, from the middle of a side, "
            "or from the axis of top and bottom.",
            "m",
        ),
    ] = (0.0, 0.0)
    radius: Annotated[float, Ge(1e-4), Le(10.0), Quantity("Its radius.", "m")] = 0.03
    friction_factor: FrictionFactor = 0.6
    start_time: PatchStart = 0.0
    end_time: PatchEnd = None


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialScenario(Scenario):
    """A hand in space, an object, a desired motion, a controller and its ignorance.

    Two scenarios that are equal give runs that are equal to the last bit.
    """

    # Parts with the same meaning and other numbers: whoever reads those asks `in_space` first.
    object: SpatialObject = SpatialObject()  # pyright: ignore[reportIncompatibleVariableOverride]
    fingers: Annotated[  # pyright: ignore[reportIncompatibleVariableOverride]
        tuple[SpatialFinger, ...], Len(2, MAX_FINGERS)
    ]
    trajectory: SpatialTrajectory = (  # pyright: ignore[reportIncompatibleVariableOverride]
        SpatialTrajectory()
    )
    controller: SpatialController = SpatialController()
    simulation: SpatialSimulation = SpatialSimulation()
    pulses: Annotated[  # pyright: ignore[reportIncompatibleVariableOverride]
        tuple[SpatialPulse, ...], Len(0, 100)
    ] = ()
    patches: Annotated[  # pyright: ignore[reportIncompatibleVariableOverride]
        tuple[SpatialPatch, ...], Len(0, MAX_PATCHES)
    ] = ()

    @property
    def in_space(self) -> bool:
        """Whether the hand stands in space and not in the plane."""
        return True

    @property
    def has_pyramid(self) -> bool:
        """Whether friction acts along each tangent by itself."""
        return self.simulation.friction == "pyramid"


def is_there(patch: Patch | SpatialPatch, t: float) -> bool:
    """Whether a patch is there at a time [s]."""
    return patch.start_time <= t and (patch.end_time is None or t < patch.end_time)


def is_spatial(mapping: dict[str, object]) -> bool:
    """Whether plain values are those of a scenario in space: its object has a height."""
    body = mapping.get("object")
    return isinstance(body, dict) and not {"height", "inertias"}.isdisjoint(body)


def full_spatial_scenario() -> SpatialScenario:
    """A scenario with an entry in every list; it could not be simulated."""
    return SpatialScenario(
        object=SpatialObject(inertias=(0.01, 0.01, 0.01), height=0.1, corners=((0.0, 0.0),)),
        fingers=(SpatialFinger(base=(0.0, 0.0, 0.0), face="side-0"),) * 2,
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
