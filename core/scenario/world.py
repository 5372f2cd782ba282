"""Disturbances and imperfections: pushes, patches of other friction, sensors, actuators."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG, Face
from slipgrasp.core.scenario.parameters import Quantity

MAX_PATCHES = 20

Force = Annotated[float, Ge(-1e4), Le(1e4)]
FrictionFactor = Annotated[
    float,
    Ge(0.0),
    Le(10.0),
    Quantity(
        "Factor on the friction of a fingertip on it.",
        "1",
        typical=(0.2, 1.5),
        changeable=True,
    ),
]
PatchStart = Annotated[float, Ge(0.0), Le(600.0), Quantity("Time at which it appears.", "s")]
PatchEnd = Annotated[
    float | None,
    Gt(0.0),
    Le(600.0),
    Quantity("Time at which it disappears; never if left out.", "s"),
]
ForceError = Annotated[float, Ge(-1e3), Le(1e3)]


PulseTime = Annotated[float, Ge(0.0), Le(600.0), Quantity("Start time.", "s")]
PulseDuration = Annotated[float, Ge(1e-4), Le(600.0), Quantity("Duration.", "s")]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Pulse:
    """A constant force and moment on the object for a while."""

    time: PulseTime
    duration: PulseDuration = 0.05
    force: Annotated[
        tuple[Force, Force],
        Quantity("Force (x, y) on the centre of mass, in the inertial frame.", "N"),
    ] = (0.0, -5.0)
    moment: Annotated[float, Ge(-1e3), Le(1e3), Quantity("Moment, counterclockwise.", "N m")] = 0.0


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Patch:
    """A part of a face with other friction, such as a low-friction patch; it may come and go."""

    face: Annotated[Face, Quantity("Face it lies on.")]
    centre: Annotated[
        float,
        Ge(-10.0),
        Le(10.0),
        Quantity("Where its middle lies along the face's tangent, from the face's middle.", "m"),
    ] = 0.0
    half_length: Annotated[
        float, Ge(1e-4), Le(10.0), Quantity("Half of its length along the face.", "m")
    ] = 0.03
    friction_factor: FrictionFactor = 0.6
    start_time: PatchStart = 0.0
    end_time: PatchEnd = None

    @property
    def place(self) -> tuple[str, float, float]:
        """Where it lies and how large it is: face, middle and half length [m]."""
        return self.face, self.centre, self.half_length


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SensingParameters:
    """What the controller measures; perfect if nothing is said. Sampled control only."""

    position_noise: Annotated[
        float,
        Ge(0.0),
        Le(0.1),
        Quantity(
            "Standard deviation of the noise on measured positions: of the object (angles in rad) "
            "and of the slip.",
            "m",
            typical=(0.0, 1e-4),
            changeable=True,
        ),
    ] = 0.0
    velocity_noise: Annotated[
        float,
        Ge(0.0),
        Le(10.0),
        Quantity(
            "Standard deviation of the noise on measured velocities (of angles in rad/s).",
            "m/s",
            typical=(0.0, 0.01),
            changeable=True,
        ),
    ] = 0.0
    acceleration_noise: Annotated[
        float,
        Ge(0.0),
        Le(1e3),
        Quantity(
            "Standard deviation of the noise on measured accelerations (of angles in rad/s²).",
            "m/s²",
            typical=(0.0, 1.0),
            changeable=True,
        ),
    ] = 0.0
    true_accelerations: Annotated[
        bool,
        Quantity(
            "Whether accelerations are measured; otherwise they are filtered differences of the "
            "measured velocities.",
            changeable=True,
        ),
    ] = True
    acceleration_filter_time: Annotated[
        float,
        Ge(0.0),
        Le(1.0),
        Quantity(
            "Time constant of the filter of those differences.",
            "s",
            typical=(0.001, 0.02),
            changeable=True,
        ),
    ] = 0.006
    true_phases: Annotated[
        bool,
        Quantity(
            "Whether the controller knows which contacts slip; otherwise it detects slip from "
            "the measured slip velocity.",
            changeable=True,
        ),
    ] = True
    slip_detector: Annotated[
        Literal["threshold", "cumulative-sum"],
        Quantity(
            "Detection of slip: by a velocity above the threshold for the duration of the delay, "
            "or by a cumulative sum of velocities that exceeds the sum of the noise.",
            changeable=True,
        ),
    ] = "threshold"
    slip_threshold: Annotated[
        float,
        Ge(0.0),
        Le(10.0),
        Quantity(
            "Slip velocity above which slip is detected.",
            "m/s",
            typical=(0.001, 0.02),
            changeable=True,
        ),
    ] = 0.005
    slip_delay: Annotated[
        float,
        Ge(0.0),
        Le(1.0),
        Quantity(
            "Duration of slip, or of its end, until it is detected (at the threshold).",
            "s",
            typical=(0.0, 0.02),
            changeable=True,
        ),
    ] = 0.002
    slip_delay_deviation: Annotated[
        float,
        Ge(0.0),
        Le(1.0),
        Quantity(
            "Standard deviation of that time, drawn anew for every detection; never below 0 s.",
            "s",
            typical=(0.0, 0.01),
            changeable=True,
        ),
    ] = 0.0
    force_noise: Annotated[
        float,
        Ge(0.0),
        Le(1e3),
        Quantity(
            "Standard deviation of the noise on measured contact forces, which custom laws see.",
            "N",
            typical=(0.0, 1.0),
            changeable=True,
        ),
    ] = 0.0
    force_bias: Annotated[
        tuple[ForceError, ForceError],
        Quantity(
            "Constant error of measured contact forces: along the face, and normal to it.",
            "N",
            typical=(-5.0, 5.0),
            changeable=True,
        ),
    ] = (0.0, 0.0)
    force_filter_time: Annotated[
        float,
        Ge(0.0),
        Le(1.0),
        Quantity(
            "Time constant of the low-pass filter of measured contact forces.",
            "s",
            typical=(0.0, 0.02),
            changeable=True,
        ),
    ] = 0.0


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ActuationParameters:
    """What the joints can give; everything if nothing is said. Limits need sampled control."""

    torque_limit: Annotated[
        float | None,
        Ge(1e-6),
        Le(1e6),
        Quantity(
            "Largest torque of a joint, of slides force in N; no limit if left out.",
            "N m",
            changeable=True,
        ),
    ] = None
    torque_rate_limit: Annotated[
        float | None,
        Ge(1e-3),
        Le(1e9),
        Quantity(
            "Largest change of a joint's torque per second, of slides in N/s; no limit if left "
            "out.",
            "N m/s",
            changeable=True,
        ),
    ] = None
