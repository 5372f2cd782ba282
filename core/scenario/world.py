"""Disturbances and imperfections: pushes, low-friction patches, sensors and actuators."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Interval
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG, Face, Offset, SpatialFace
from slipgrasp.core.scenario.parameters import Quantity, changeable

MAX_PATCHES = 20

Force = Annotated[float, Interval(ge=-1e4, le=1e4)]
Moment = Annotated[float, Interval(ge=-1e3, le=1e3)]
FrictionFactor = Annotated[
    float,
    Interval(ge=0.0, le=10.0),
    changeable(
        "Ratio of the friction on the patch to that of the fingertip elsewhere.",
        "1",
        typical=(0.2, 1.5),
    ),
]
PatchStart = Annotated[
    float, Interval(ge=0.0, le=600.0), Quantity("Time at which the patch appears.", "s")
]
PatchEnd = Annotated[
    float | None,
    Interval(gt=0.0, le=600.0),
    Quantity("Time at which the patch disappears (default: never).", "s"),
]
ForceError = Annotated[float, Interval(ge=-1e3, le=1e3)]


PulseTime = Annotated[float, Interval(ge=0.0, le=600.0), Quantity("Start time.", "s")]
PulseDuration = Annotated[float, Interval(ge=1e-4, le=600.0), Quantity("Duration.", "s")]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Pulse:
    """A constant force and moment on the object for a limited time."""

    time: PulseTime
    duration: PulseDuration = 0.05
    force: Annotated[
        tuple[Force, Force],
        Quantity("Force (x, y) on the centre of mass, in the inertial frame.", "N"),
    ] = (0.0, -5.0)
    moment: Annotated[
        float, Interval(ge=-1e3, le=1e3), Quantity("Moment, counterclockwise.", "N m")
    ] = 0.0


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Patch:
    """A part of a face with different friction, such as a low-friction patch; may be temporary."""

    face: Annotated[Face, Quantity("Face of the patch.")]
    centre: Annotated[
        Offset, Quantity("Position of the centre along the face, from the centre of the face.", "m")
    ] = 0.0
    half_length: Annotated[
        float, Interval(ge=1e-4, le=10.0), Quantity("Half the length along the face.", "m")
    ] = 0.03
    friction_factor: FrictionFactor = 0.6
    start_time: PatchStart = 0.0
    end_time: PatchEnd = None

    @property
    def place(self) -> tuple[str, float, float]:
        """Position and size of the patch: face, centre and half length [m]."""
        return self.face, self.centre, self.half_length


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
        tuple[Moment, Moment, Moment], Quantity("Moment (x, y, z), in the inertial frame.", "N m")
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
    radius: Annotated[float, Interval(ge=1e-4, le=10.0), Quantity("Radius of the patch.", "m")] = (
        0.03
    )
    friction_factor: FrictionFactor = 0.6
    start_time: PatchStart = 0.0
    end_time: PatchEnd = None

    @property
    def place(self) -> tuple[str, tuple[float, float], float]:
        """Position and size of the patch: face, centre and radius [m]."""
        return self.face, self.centre, self.radius


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SensingParameters:
    """Measurements of the controller; perfect by default. Noise needs sampled control."""

    position_noise: Annotated[
        float,
        Interval(ge=0.0, le=0.1),
        changeable(
            "Standard deviation of the noise on measured positions: of the object (angles in rad) "
            "and of the slip.",
            "m",
            typical=(0.0, 1e-4),
        ),
    ] = 0.0
    velocity_noise: Annotated[
        float,
        Interval(ge=0.0, le=10.0),
        changeable(
            "Standard deviation of the noise on measured velocities (of angles in rad/s).",
            "m/s",
            typical=(0.0, 0.01),
        ),
    ] = 0.0
    acceleration_noise: Annotated[
        float,
        Interval(ge=0.0, le=1e3),
        changeable(
            "Standard deviation of the noise on measured accelerations (of angles in rad/s²).",
            "m/s²",
            typical=(0.0, 1.0),
        ),
    ] = 0.0
    true_accelerations: Annotated[
        bool,
        changeable(
            "Whether accelerations are measured; otherwise they are filtered differences of the "
            "measured velocities."
        ),
    ] = True
    acceleration_filter_time: Annotated[
        float,
        Interval(ge=0.0, le=1.0),
        changeable(
            "Time constant of the low-pass filter of the differences and of the torques.",
            "s",
            typical=(0.001, 0.02),
        ),
    ] = 0.006
    true_phases: Annotated[
        bool,
        changeable(
            "Whether the controller knows which contacts slip; otherwise it detects slip from "
            "the measured slip velocity."
        ),
    ] = True
    slip_detector: Annotated[
        Literal["threshold", "cumulative-sum"],
        changeable(
            "Detection of slip: by a velocity above the threshold for the duration of the delay, "
            "or by a cumulative sum of the velocities (Page's test), with a limit that follows "
            "from slip_threshold, slip_delay and controller.velocity_noise."
        ),
    ] = "threshold"
    slip_threshold: Annotated[
        float,
        Interval(ge=0.0, le=10.0),
        changeable("Slip velocity above which slip is detected.", "m/s", typical=(0.001, 0.02)),
    ] = 0.005
    slip_delay: Annotated[
        float,
        Interval(ge=0.0, le=1.0),
        changeable(
            "threshold: duration of slip (or of sticking) until it is detected; cumulative-sum: "
            "a quantity from which its limit follows.",
            "s",
            typical=(0.0, 0.02),
        ),
    ] = 0.002
    slip_delay_deviation: Annotated[
        float,
        Interval(ge=0.0, le=1.0),
        changeable(
            "Standard deviation of slip_delay, which is random for every detection (at least 0 s).",
            "s",
            typical=(0.0, 0.01),
        ),
    ] = 0.0
    force_noise: Annotated[
        float,
        Interval(ge=0.0, le=1e3),
        changeable(
            "Standard deviation of the noise on measured contact forces (input of custom laws).",
            "N",
            typical=(0.0, 1.0),
        ),
    ] = 0.0
    force_bias: Annotated[
        tuple[ForceError, ForceError],
        changeable(
            "Constant error of measured contact forces: tangential and normal component.",
            "N",
            typical=(-5.0, 5.0),
        ),
    ] = (0.0, 0.0)
    force_filter_time: Annotated[
        float,
        Interval(ge=0.0, le=1.0),
        changeable(
            "Time constant of the low-pass filter of measured contact forces.",
            "s",
            typical=(0.0, 0.02),
        ),
    ] = 0.0


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ActuationParameters:
    """Limits of the joint torques; none by default. Limits need sampled control."""

    torque_limit: Annotated[
        float | None,
        Interval(ge=1e-6, le=1e6),
        changeable(
            "Largest torque of a joint (for slides: force in N); no limit if omitted.", "N m"
        ),
    ] = None
    torque_rate_limit: Annotated[
        float | None,
        Interval(ge=1e-3, le=1e9),
        changeable(
            "Largest rate of change of a joint's torque (for slides: of its force in N/s); no "
            "limit if omitted.",
            "N m/s",
        ),
    ] = None
