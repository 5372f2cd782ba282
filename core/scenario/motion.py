"""The desired motion of the object."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Interval, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG, Angle, Coordinate
from slipgrasp.core.scenario.parameters import Quantity

MAX_SET_POINTS = 50
MAX_TABLE_ROWS = 250

# Times closer than this are equal, such as 0.1 + 0.2 and 0.3 [s].
SAME_TIME = 1e-12

Part = Annotated[float, Interval(ge=-1.0, le=1.0)]
Acceleration = Annotated[float, Interval(ge=-100.0, le=100.0)]
Time = Annotated[float, Interval(ge=0.0, le=600.0)]
Amplitude = Annotated[float, Interval(ge=-10.0, le=10.0)]


MoveTime = Annotated[float, Interval(ge=0.0, le=600.0), Quantity("Start of the motion.", "s")]
MoveDuration = Annotated[
    float, Interval(ge=1e-3, le=600.0), Quantity("Duration of the motion.", "s")
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SetPoint:
    """A pose to move to with minimum jerk, from the end of the previous motion."""

    time: MoveTime
    duration: MoveDuration
    pose: Annotated[
        tuple[Coordinate, Coordinate, Angle],
        Quantity("Absolute object pose (x, y, theta) at the end of the motion.", "m, m, rad"),
    ]


MotionKind = Annotated[
    Literal["coast", "set-points", "circle", "rotation", "shake", "table"],
    Quantity(
        "Shape of the motion: coast (accelerate, coast, brake, Eq. 64), set-points, circle, "
        "rotation (to an angle and back), shake, or a table of poses.",
    ),
]
AccelerationTime = Annotated[
    float,
    Interval(ge=0.0, le=1e3),
    Quantity("coast, circle, rotation, shake: duration of acceleration and of braking.", "s"),
]
CoastTime = Annotated[
    float,
    Interval(ge=0.0, le=1e3),
    Quantity("duration of the motion at constant speed.", "s", used_by=("coast",)),
]
Period = Annotated[
    float,
    Interval(ge=0.01, le=600.0),
    Quantity("time of one cycle at full speed.", "s", used_by=("circle", "rotation", "shake")),
]
Cycles = Annotated[
    float,
    Interval(ge=1e-3, le=1e4),
    Quantity("number of cycles.", "1", used_by=("circle", "rotation", "shake")),
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class TrajectoryParameters:
    """The desired motion of the object; ``kind`` determines which of the fields are used."""

    kind: MotionKind = "coast"
    start: Annotated[
        tuple[Coordinate, Coordinate, Angle],
        Quantity("Object pose (x, y, theta) at the start, desired and actual.", "m, m, rad"),
    ] = (1.466, 0.366, 0.0)
    acceleration: Annotated[
        tuple[Acceleration, Acceleration, Acceleration],
        Quantity(
            "desired acceleration (x, y, theta) while speeding up; its opposite while braking.",
            "m/s², m/s², rad/s²",
            used_by=("coast",),
        ),
    ] = (0.0, 0.0256, 0.0)
    acceleration_time: AccelerationTime = 1.0
    coast_time: CoastTime = 5.0
    period: Period = 2.0
    cycles: Cycles = 2.0
    radius: Annotated[
        float,
        Interval(ge=0.0, le=10.0),
        Quantity("radius of the circle, which starts at the bottom.", "m", used_by=("circle",)),
    ] = 0.05
    angle: Annotated[
        Angle,
        Quantity("angle at which the motion reverses.", "rad", used_by=("rotation",)),
    ] = 0.3
    amplitude: Annotated[
        tuple[Amplitude, Amplitude, Amplitude],
        Quantity("amplitude (x, y, theta) of the oscillation.", "m, m, rad", used_by=("shake",)),
    ] = (0.0, 0.02, 0.0)
    set_points: Annotated[
        tuple[SetPoint, ...],
        Len(0, MAX_SET_POINTS),
        Quantity("successive motions.", used_by=("set-points",)),
    ] = ()
    table: Annotated[
        tuple[tuple[Time, Coordinate, Coordinate, Angle], ...],
        Len(0, MAX_TABLE_ROWS),
        Quantity(
            "rows of time and pose (t, x, y, theta), joined by a smooth curve; a scenario file can "
            "instead give the name of a CSV file in the same folder.",
            "s, m, m, rad",
            used_by=("table",),
        ),
    ] = ()

    @property
    def table_start(self) -> tuple[float, ...]:
        """The start pose as in the rows of a table."""
        return self.start


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
        Interval(ge=0.0, le=10.0),
        Quantity(
            "radius of the circle, which lies in the x-z plane and starts at its lowest point.",
            "m",
            used_by=("circle",),
        ),
    ] = 0.05
    angle: Annotated[
        tuple[Angle, Angle, Angle],
        Quantity("rotation vector at which the motion reverses.", "rad", used_by=("rotation",)),
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
        tuple[tuple[Time, Coordinate, Coordinate, Coordinate, Angle, Angle, Angle], ...],
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
