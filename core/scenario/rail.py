"""A scenario of a finger that pushes or drags an object along a rail.

The object moves along x only. A finger with two joints touches it at one point, with normal
n = cos(phi) e - sin(phi) w and tangent t = sin(phi) e + cos(phi) w, where e is along the rail and w
points upwards: it pushes a side face (phi = 0) or presses from above and drags (phi = 90°).
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Annotated, Any, Literal

from annotated_types import Interval, Len
from pydantic import BeforeValidator
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.common import Changes, FrictionCone, Title, without_none
from slipgrasp.core.scenario.controller import Estimate
from slipgrasp.core.scenario.field_types import (
    CONFIG,
    Coordinate,
    Fraction,
    FrozenMapping,
    InertiaFraction,
    Length,
)
from slipgrasp.core.scenario.finger import Friction, LinkLength, StaticFriction
from slipgrasp.core.scenario.held_object import SIDES, ObjectMass
from slipgrasp.core.scenario.laws import law_kind
from slipgrasp.core.scenario.motion import MAX_SET_POINTS, MoveDuration, MoveTime
from slipgrasp.core.scenario.numerics import Change
from slipgrasp.core.scenario.parameters import Quantity, changeable
from slipgrasp.core.scenario.space import RAIL
from slipgrasp.core.scenario.supported import SupportSimulation, WithoutHand
from slipgrasp.core.scenario.world import Pulse

Gain = Annotated[float, Interval(ge=0.0, le=1e6)]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class RailObject:
    """The object on the rail, with an extent for the face that the fingertip touches."""

    mass: ObjectMass = 1.0
    half_width: Annotated[
        Length, Quantity("Half the length of the object along the rail.", "m")
    ] = 0.1
    face_half_length: Annotated[
        Length, Quantity("Half the height of the object above the rail.", "m")
    ] = 0.1

    # Kind of outline.
    shape = "rectangle"
    # Whether the faces are curved: never.
    is_round = False

    @property
    def half_sizes(self) -> tuple[float, float]:
        """Half the sizes along x and y [m]."""
        return self.half_width, self.face_half_length

    # Extent perpendicular to the plane, which is not modelled [m].
    half_height = math.inf
    # Corners of a polygon: it is drawn as a rectangle.
    corners = ()
    # Names of the sides.
    face_names = SIDES


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class RailParameters:
    """The rail, along x, and its friction."""

    friction: Annotated[
        float,
        Interval(ge=0.0, le=10.0),
        changeable(
            "Friction coefficient of the rail while the object slides.", "1", typical=(0.02, 0.5)
        ),
    ] = 0.1
    static_friction: Annotated[
        float | None,
        Interval(ge=0.0, le=10.0),
        changeable(
            "Friction coefficient of the rail while the object is at rest, not smaller than "
            "friction (default: the same).",
            "1",
        ),
    ] = None

    # There are no links.
    link_masses = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class RailFinger:
    """The finger: two links, with a fingertip that touches the object at one point."""

    link_masses: Annotated[
        tuple[
            Annotated[float, Interval(ge=1e-6, le=1e3)], Annotated[float, Interval(ge=1e-6, le=1e3)]
        ],
        changeable("Mass of a link.", "kg", typical=(0.2, 3.0)),
    ] = (1.0, 1.0)
    link_lengths: Annotated[tuple[LinkLength, LinkLength], Quantity("Length of a link.", "m")] = (
        1.0,
        1.0,
    )
    base: Annotated[
        tuple[Coordinate, Coordinate],
        Quantity("Position (x, y) of the first joint; the rail is at y = 0.", "m"),
    ]
    friction: Friction = 0.25
    static_friction: StaticFriction = None
    angle: Annotated[
        float,
        Interval(ge=0.0, le=0.5 * math.pi),
        Quantity(
            "Angle phi of the contact: 0 pushes the left side along x, pi/2 presses from above.",
            "rad",
        ),
    ] = 0.0
    elbow: Annotated[
        Literal["up", "down"],
        Quantity(
            "Branch of the inverse kinematics: sign of the second joint angle, up = negative."
        ),
    ] = "up"
    link_centre_fractions: Annotated[
        tuple[Fraction, Fraction],
        Quantity("Centre of mass of a link as a fraction of its length.", "1"),
    ] = (0.5, 0.5)
    link_inertia_fractions: Annotated[
        tuple[InertiaFraction, InertiaFraction],
        Quantity(
            "Inertia of a link about its centre of mass, divided by mass times length squared.", "1"
        ),
    ] = (1.0 / 12.0, 1.0 / 12.0)

    # Mechanism of the finger.
    kind = "links"


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class RailSetPoint:
    """A position to move to with minimum jerk, from the end of the previous motion."""

    time: MoveTime
    duration: MoveDuration
    pose: Annotated[
        tuple[Coordinate], Quantity("Position of the object along the rail at the end.", "m")
    ]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class RailTrajectory:
    """The desired motion along the rail; the object starts at rest."""

    start: Annotated[tuple[Coordinate], Quantity("Position at the start.", "m")] = (0.0,)
    set_points: Annotated[tuple[RailSetPoint, ...], Len(0, MAX_SET_POINTS)] = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class RailController:
    """The control law of the finger, continuous and with known phases.

    Its force on the object is grip_force along the normal plus a force along the rail: with
    theorem-3 and certainty-equivalence the force that the desired motion needs (computed torque),
    with pd-gravity feedback times the estimated mass.
    """

    kind: Annotated[
        Literal["theorem-3", "certainty-equivalence", "pd-gravity"],
        BeforeValidator(law_kind),
        changeable(
            "Control law. theorem-3 (adaptive-mass): computed torque; the tracking error adapts "
            "the estimated mass while the fingertip sticks and the object slides. "
            "certainty-equivalence: the same without adaptation. pd-gravity: feedback, a "
            "constant normal force, and compensation of the links' weight."
        ),
    ] = "certainty-equivalence"
    position_gain: Annotated[Gain, changeable("K_p.", "1/s²", typical=(0.0, 400.0))] = 100.0
    velocity_gain: Annotated[Gain, changeable("K_v.", "1/s", typical=(0.0, 50.0))] = 20.0
    grip_force: Annotated[
        float,
        Interval(ge=0.0, le=1e4),
        changeable(
            "Commanded normal force, to which the force along the rail is added.",
            "N",
            typical=(0.0, 50.0),
        ),
    ] = 1.0
    minimum_normal_force: Annotated[
        float,
        Interval(ge=0.0, le=1e4),
        changeable(
            "Smallest commanded normal force, so that the fingertip stays on the object; has no "
            "effect at an angle of pi/2.",
            "N",
            typical=(0.0, 20.0),
        ),
    ] = 0.5
    mass_estimate: Annotated[
        float | None,
        Interval(ge=1e-3, le=1e3),
        Quantity("Initial estimate of the object's mass; omitted: the mass is known.", "kg"),
    ] = None
    adaptation_gain: Annotated[
        float,
        Interval(ge=1e-12, le=1e6),
        changeable(
            "Gamma: speed of adaptation.", "1", typical=(1.0, 1000.0), used_by=("theorem-3",)
        ),
    ] = 100.0
    lyapunov_weight: Annotated[
        Gain,
        changeable(
            "Q: weight of the errors in the Lyapunov function.",
            "1",
            typical=(1.0, 100.0),
            used_by=("theorem-3",),
        ),
    ] = 20.0

    # Control is continuous.
    control_period = 0.0
    # Parameters of a custom law; there are none.
    parameters = FrozenMapping()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class RailScenario(WithoutHand):
    """A finger that moves an object along a rail.

    Equal scenarios give runs that are equal to the last bit. Common code sees two contacts, of the
    fingertip and of the rail, and a scenario without pulses and patches.
    """

    title: Title = ""
    object: RailObject = RailObject()
    rail: RailParameters = RailParameters()
    finger: RailFinger
    trajectory: RailTrajectory = RailTrajectory()
    controller: RailController = RailController()
    simulation: SupportSimulation = SupportSimulation()
    changes: Changes = ()

    # Functions and constants that depend on the kind of scenario.
    space = RAIL

    @property
    def fingers(self) -> tuple[RailFinger | RailParameters, ...]:
        """The contacts: fingertip and rail."""
        return self.finger, self.rail

    # Names of the contacts.
    finger_names = "finger", "rail"

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """The mass, if it is not known."""
        mass = self.controller.mass_estimate
        return () if mass is None else (Estimate(parameter="object.mass", initial=mass),)

    @property
    def pulses(self) -> tuple[Pulse, ...]:
        """Pulses; there are none."""
        return ()

    # Whether a contact has a spin: never.
    has_soft_fingers = False

    @property
    def friction_cone(self) -> FrictionCone:
        """Shape of the friction cone of both contacts: a line."""
        return "line"

    @property
    def contact_offset(self) -> tuple[float, float]:
        """Initial position of the fingertip relative to the centre of the object [m]."""
        sine, cosine = math.sin(self.finger.angle), math.cos(self.finger.angle)
        return -self.object.half_width * cosine, self.object.face_half_length * sine

    def to_mapping(self) -> dict[str, Any]:
        """The scenario as nested plain values, omitting None."""
        return asdict(self, dict_factory=without_none)


def full_rail_scenario() -> RailScenario:
    """A scenario with an item in every list; not for simulation."""
    return RailScenario(
        finger=RailFinger(base=(0.0, 0.0)),
        trajectory=RailTrajectory(set_points=(RailSetPoint(time=0.0, duration=1.0, pose=(0.0,)),)),
        changes=(Change(time=1.0, parameter="object.mass", value=1.0),),
    )
