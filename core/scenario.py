"""A scenario: everything that decides the result of a run, and nothing else.

Every field carries its unit, bounds and a sentence (`core.parameters.Quantity`).
Quantities are SI. The paper's two sample cases lie in ``core/presets``.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated, Any, Literal

from annotated_types import Ge, Gt, Le, Len
from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from core.parameters import Quantity

__all__ = [
    "MAX_FINGERS",
    "MAX_UNKNOWNS",
    "Change",
    "ControllerParameters",
    "Estimate",
    "FingerParameters",
    "ObjectParameters",
    "Scenario",
    "SimulationParameters",
    "TrajectoryParameters",
]

MAX_FINGERS = 6
MAX_UNKNOWNS = 32
MAX_CHATTER_CHANGES = 10_000

_CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

LinkMass = Annotated[float, Ge(1e-3), Le(1e3)]
LinkLength = Annotated[float, Ge(1e-3), Le(1e2)]
Coordinate = Annotated[float, Ge(-1e3), Le(1e3)]
Gain = Annotated[float, Ge(0.0), Le(1e6)]
PositiveGain = Annotated[float, Gt(0.0), Le(1e6)]


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class ObjectParameters:
    """The held object: a rectangle with its centre of mass in the middle."""

    mass: Annotated[
        float,
        Ge(1e-3),
        Le(1e3),
        Quantity("True mass of the object.", "kg", typical=(0.2, 3.0), changeable=True),
    ] = 1.0
    inertia: Annotated[
        float,
        Ge(1e-6),
        Le(1e3),
        Quantity(
            "True moment of inertia of the object about its centre.",
            "kg m^2",
            typical=(0.002, 0.05),
            changeable=True,
        ),
    ] = 0.01042
    half_width: Annotated[
        float,
        Ge(1e-3),
        Le(10.0),
        Quantity("Distance from the centre to the left and right face.", "m"),
    ] = 0.1
    face_half_length: Annotated[
        float,
        Ge(1e-3),
        Le(10.0),
        Quantity(
            "Half the length of the left and right face; a fingertip beyond it has left.", "m"
        ),
    ] = 0.1458


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class FingerParameters:
    """A planar finger of two links whose tip touches one face of the object."""

    link_masses: Annotated[
        tuple[LinkMass, LinkMass],
        Quantity("True mass of a link.", "kg", typical=(0.2, 3.0), changeable=True),
    ] = (1.0, 1.0)
    link_lengths: Annotated[tuple[LinkLength, LinkLength], Quantity("Length of a link.", "m")] = (
        1.0,
        1.0,
    )
    base: Annotated[
        tuple[Coordinate, Coordinate],
        Quantity("Position (x, y) of the finger's first joint.", "m"),
    ]
    friction: Annotated[
        float,
        Ge(0.0),
        Le(10.0),
        Quantity(
            "True Coulomb friction coefficient between fingertip and object.",
            "1",
            typical=(0.05, 1.0),
            changeable=True,
        ),
    ] = 0.25
    face: Annotated[
        Literal["left", "right", "bottom", "top"], Quantity("Face of the object the tip touches.")
    ]
    contact_offset: Annotated[
        float,
        Ge(-10.0),
        Le(10.0),
        Quantity(
            "Where along the face's tangent the tip starts, from the middle of the face.", "m"
        ),
    ] = 0.0
    elbow: Annotated[
        Literal["up", "down"],
        Quantity(
            "Branch of the inverse kinematics: sign of the second joint angle, up = negative."
        ),
    ] = "up"
    link_centre_fractions: Annotated[
        tuple[Annotated[float, Ge(0.0), Le(1.0)], Annotated[float, Ge(0.0), Le(1.0)]],
        Quantity("Centre of mass of a link as a fraction of its length.", "1"),
    ] = (0.5, 0.5)
    link_inertia_fractions: Annotated[
        tuple[Annotated[float, Gt(0.0), Le(1.0)], Annotated[float, Gt(0.0), Le(1.0)]],
        Quantity(
            "Inertia of a link about its centre of mass, divided by mass times length squared.",
            "1",
        ),
    ] = (1.0 / 12.0, 1.0 / 12.0)


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class TrajectoryParameters:
    """The desired motion of the object: accelerate, coast, brake, then rest (Eq. 64)."""

    start: Annotated[
        tuple[Coordinate, Coordinate, Annotated[float, Ge(-3.2), Le(3.2)]],
        Quantity("Object pose (x, y, theta) at the start, desired and actual.", "m, m, rad"),
    ] = (1.466, 0.366, 0.0)
    acceleration: Annotated[
        tuple[
            Annotated[float, Ge(-100.0), Le(100.0)],
            Annotated[float, Ge(-100.0), Le(100.0)],
            Annotated[float, Ge(-100.0), Le(100.0)],
        ],
        Quantity(
            "Desired acceleration (x, y, theta) while speeding up; its opposite while braking.",
            "m/s^2, m/s^2, rad/s^2",
        ),
    ] = (0.0, 0.0256, 0.0)
    acceleration_time: Annotated[
        float, Ge(0.0), Le(1e3), Quantity("How long it speeds up, and how long it brakes.", "s")
    ] = 1.0
    coast_time: Annotated[
        float, Ge(0.0), Le(1e3), Quantity("How long it moves at constant speed in between.", "s")
    ] = 5.0


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class ControllerParameters:
    """The control law, its gains and how it meets the plant."""

    kind: Annotated[
        Literal["theorem-3", "theorem-4"],
        Quantity("Adaptive law: theorem-3, or theorem-4 with sigma-modification.", changeable=True),
    ] = "theorem-4"
    control_period: Annotated[
        float,
        Ge(0.0),
        Le(0.1),
        Quantity(
            "Time between control updates; 0 = continuous control, else at least 0.0001 s.",
            "s",
            typical=(0.0, 0.01),
            changeable=True,
        ),
    ] = 0.001
    recognition_time: Annotated[
        float,
        Ge(1e-5),
        Le(0.1),
        Quantity(
            "How long continuous control keeps its belief where no phase is consistent.",
            "s",
            typical=(0.0001, 0.01),
            changeable=True,
        ),
    ] = 0.001
    position_gain: Annotated[
        Gain | Annotated[tuple[Gain, ...], Len(3, 3)],
        Quantity(
            "K_p: one number for the object, or one per coordinate x, y, theta; slip has none.",
            "1/s^2",
            typical=(10.0, 400.0),
            changeable=True,
        ),
    ] = 100.0
    velocity_gain: Annotated[
        PositiveGain | tuple[PositiveGain, ...],
        Quantity(
            "K_v: one number, or one per coordinate x, y, theta and slip of each contact.",
            "1/s",
            typical=(2.0, 50.0),
            changeable=True,
        ),
    ] = 10.0
    adaptation_gain: Annotated[
        PositiveGain | tuple[PositiveGain, ...],
        Quantity(
            "Gamma: speed of adaptation, one number or one per unknown.",
            "1",
            typical=(0.05, 10.0),
            changeable=True,
        ),
    ] = 1.28
    lyapunov_weight: Annotated[
        Gain | tuple[Gain, ...],
        Quantity(
            "Q: weight of the errors in the Lyapunov function, a number times the identity or one "
            "per coordinate x, y, theta and slip of each contact.",
            "1",
            typical=(1.0, 100.0),
            changeable=True,
        ),
    ] = 20.0
    grasp_force: Annotated[
        Literal["minimum", "none"],
        Quantity(
            "Internal force: minimum inside the estimated friction cones, or none (y = 0).",
            changeable=True,
        ),
    ] = "minimum"
    grip_safety: Annotated[
        float,
        Ge(1.0),
        Le(10.0),
        Quantity(
            "Factor by which the commanded force stays inside the estimated cones.",
            "1",
            typical=(1.0, 2.0),
            changeable=True,
        ),
    ] = 1.1
    estimate_norm_bound: Annotated[
        float,
        Gt(0.0),
        Le(1e6),
        Quantity(
            "phi_0: norm of the estimates above which theorem-4 pulls them back.",
            "1",
            typical=(0.5, 5.0),
            changeable=True,
        ),
    ] = 2.036


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class Estimate:
    """One parameter the controller does not know."""

    parameter: Annotated[str, Len(1, 80), Quantity("Dotted key of the unknown parameter.")]
    initial: Annotated[
        float,
        Ge(-1e3),
        Le(1e3),
        Quantity(
            "What the controller believes at the start, in the unit of the parameter.",
            "",
            changeable=True,
        ),
    ]
    minimum: Annotated[
        float | None,
        Ge(-1e3),
        Le(1e3),
        Quantity("Least value the estimate may take; none if left out.", "", changeable=True),
    ] = None
    maximum: Annotated[
        float | None,
        Ge(-1e3),
        Le(1e3),
        Quantity("Largest value the estimate may take; none if left out.", "", changeable=True),
    ] = None


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class SimulationParameters:
    """Duration, output, gravity and accuracy of the integration."""

    duration: Annotated[float, Ge(1e-3), Le(600.0), Quantity("Simulated time.", "s")] = 7.0
    output_rate: Annotated[
        float, Ge(1.0), Le(1e4), Quantity("Rate at which the trace is stored.", "Hz")
    ] = 200.0
    gravity: Annotated[
        float, Ge(0.0), Le(100.0), Quantity("Gravitational acceleration along -y.", "m/s^2")
    ] = 9.81
    relative_tolerance: Annotated[
        float, Ge(1e-12), Le(1e-3), Quantity("Relative error allowed in one step.", "1")
    ] = 1e-8
    absolute_tolerance: Annotated[
        float, Ge(1e-14), Le(1e-3), Quantity("Absolute error allowed in one step, SI units.", "")
    ] = 1e-10
    max_step: Annotated[
        float, Ge(1e-5), Le(1.0), Quantity("Largest step of the integration.", "s")
    ] = 0.1
    max_steps: Annotated[
        int, Ge(1), Le(100_000_000), Quantity("Steps after which a run ends as limit.", "1")
    ] = 5_000_000
    chatter_changes: Annotated[
        int,
        Ge(5),
        Le(MAX_CHATTER_CHANGES),
        Quantity("Phase changes within the chatter window that end a run as chattering.", "1"),
    ] = 100
    chatter_window: Annotated[
        float, Ge(1e-6), Le(10.0), Quantity("Length of the chatter window.", "s")
    ] = 0.15


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class Change:
    """A parameter that takes another value at a stated time during the run."""

    time: Annotated[float, Gt(0.0), Le(600.0), Quantity("When it changes.", "s")]
    parameter: Annotated[str, Len(1, 80), Quantity("Dotted key of the parameter that changes.")]
    value: Annotated[
        float | str | tuple[float, ...], Quantity("Its value from then on, in its own unit.")
    ]


@dataclass(frozen=True, kw_only=True, slots=True, config=_CONFIG)
class Scenario:
    """A hand, an object, a desired motion, a controller and its ignorance.

    Two scenarios that are equal give runs that are equal to the last bit.
    """

    title: Annotated[str, Len(0, 200), Quantity("What this scenario shows, in a sentence.")] = ""
    object: ObjectParameters = ObjectParameters()
    fingers: Annotated[tuple[FingerParameters, ...], Len(2, MAX_FINGERS)]
    trajectory: TrajectoryParameters = TrajectoryParameters()
    controller: ControllerParameters = ControllerParameters()
    estimates: Annotated[tuple[Estimate, ...], Len(0, MAX_UNKNOWNS)] = ()
    simulation: SimulationParameters = SimulationParameters()
    changes: Annotated[tuple[Change, ...], Len(0, 1000)] = ()

    @property
    def finger_names(self) -> tuple[str, ...]:
        """What to call the fingers: the faces they touch, numbered where several share one."""
        faces = [finger.face for finger in self.fingers]
        return tuple(
            face if faces.count(face) == 1 else f"{face} {faces[: i + 1].count(face)}"
            for i, face in enumerate(faces)
        )

    def to_mapping(self) -> dict[str, Any]:
        """The scenario as nested plain values, without what was left out (None)."""
        mapping: dict[str, Any] = asdict(self)
        mapping["estimates"] = [
            {k: v for k, v in e.items() if v is not None} for e in mapping["estimates"]
        ]
        return mapping
