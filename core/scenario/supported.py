"""A scenario of a body that slides on a support, without a hand.

The body lies on a plane with friction. Its contact has the ellipsoid limit surface: with friction
force f, friction moment M about the normal, normal force N and radius c, (|f| / (mu N))² +
(M / (c mu N))² is at most 1 (Howe and Cutkosky, Practical force-motion models for sliding
manipulation, 1996).
"""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Annotated, Any

from annotated_types import Interval, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.common import Changes, FrictionCone, Pulses, Title, without_none
from slipgrasp.core.scenario.controller import ControllerParameters
from slipgrasp.core.scenario.field_types import CONFIG, Angle, Coordinate, Length
from slipgrasp.core.scenario.held_object import MAX_CORNERS, SIDES, Corner, ObjectMass
from slipgrasp.core.scenario.numerics import (
    AbsoluteTolerance,
    Change,
    ChatterChanges,
    ChatterWindow,
    Duration,
    Gravity,
    MaxStep,
    MaxSteps,
    OutputRate,
    RelativeTolerance,
)
from slipgrasp.core.scenario.parameters import Quantity, changeable
from slipgrasp.core.scenario.space import SUPPORT
from slipgrasp.core.scenario.world import Patch, Pulse

Speed = Annotated[float, Interval(ge=-1e3, le=1e3)]
Coefficient = Annotated[float, Interval(ge=0.0, le=10.0)]

NO_CONTROLLER = "none"
"""Kind of control in descriptions of runs."""

_NO_CONTROLLER = ControllerParameters(control_period=0.0)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SupportedObject:
    """The sliding body: a rectangle about its centre of mass, or a convex polygon, from above."""

    mass: ObjectMass = 0.37
    inertia: Annotated[
        float,
        Interval(ge=1e-9, le=1e3),
        changeable(
            "Moment of inertia of the body about the normal of the support.",
            "kg m²",
            typical=(1e-4, 5e-3),
        ),
    ] = 6.773e-4
    half_width: Annotated[
        Length, Quantity("Half the length of the body along its x axis.", "m")
    ] = 0.0524
    half_depth: Annotated[
        Length, Quantity("Half the length of the body along its y axis.", "m")
    ] = 0.0524
    corners: Annotated[
        tuple[Corner, ...],
        Len(0, MAX_CORNERS),
        Quantity(
            "Corners (x, y) of a convex polygon, counterclockwise, relative to its centre of mass; "
            "omitted: a rectangle.",
            "m",
        ),
    ] = ()

    # Kind of outline.
    shape = "polygon"
    # Whether the faces are curved: never.
    is_round = False

    @property
    def half_sizes(self) -> tuple[float, float]:
        """Half the sizes along x and y [m]."""
        return self.half_width, self.half_depth

    # Extent perpendicular to the support, which is not modelled [m].
    half_height = math.inf

    @property
    def face_names(self) -> tuple[str, ...]:
        """Names of the sides."""
        return tuple(f"edge-{k}" for k in range(len(self.corners))) or SIDES


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SupportParameters:
    """The plane under the body, and its friction."""

    friction: Annotated[
        Coefficient,
        changeable(
            "Friction coefficient of the support while the body slides.", "1", typical=(0.05, 1.0)
        ),
    ] = 0.21
    static_friction: Annotated[
        Coefficient | None,
        changeable(
            "Friction coefficient while the body is at rest (default: that of sliding).", "1"
        ),
    ] = None
    radius: Annotated[
        float,
        Interval(ge=0.0, le=1.0),
        changeable(
            "Ratio of the largest friction moment about the normal to the largest friction force; "
            "0: the contact does not resist rotation.",
            "m",
            typical=(0.0, 0.1),
        ),
    ] = 0.0
    incline: Annotated[
        float,
        Interval(ge=-1.5, le=1.5),
        changeable("Angle of the plane, which rises along x.", "rad", typical=(-0.5, 0.5)),
    ] = 0.0

    @property
    def eccentricity(self) -> float:
        """Radius of the support, with the name that it has for a soft fingertip [m]."""
        return self.radius

    # There are no links.
    link_masses = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class InitialMotion:
    """Pose and velocity of the body at the start."""

    start: Annotated[
        tuple[Coordinate, Coordinate, Angle],
        Quantity("Pose (x, y, theta) at the start, in the plane of the support.", "m, m, rad"),
    ] = (0.0, 0.0, 0.0)
    velocity: Annotated[
        tuple[Speed, Speed, Speed],
        Quantity("Velocity (x, y, theta) at the start.", "m/s, m/s, rad/s", typical=(-2.0, 2.0)),
    ] = (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SupportSimulation:
    """Duration, output, gravity and accuracy of the integration."""

    duration: Duration = 1.0
    output_rate: OutputRate = 200.0
    gravity: Annotated[Gravity, Quantity("Gravitational acceleration.", "m/s²")] = 9.81
    relative_tolerance: RelativeTolerance = 1e-8
    absolute_tolerance: AbsoluteTolerance = 1e-10
    max_step: MaxStep = 0.1
    max_steps: MaxSteps = 5_000_000
    chatter_changes: ChatterChanges = 100
    chatter_window: ChatterWindow = 0.15

    # Seed of sensor noise; there is none.
    seed = 0


class WithoutHand:
    """Properties of a hand, with their values in a scenario without one."""

    __slots__ = ()

    @property
    def patches(self) -> tuple[Patch, ...]:
        """Patches; there are none."""
        return ()

    # There are no prismatic joints.
    slides = ()
    # There are no prismatic joints.
    sliding_joints = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SupportScenario(WithoutHand):
    """A body on a support: thrown, pushed, or on an inclined plane.

    Equal scenarios give runs that are equal to the last bit. The support counts as the only
    contact; common code sees it as the only finger of a scenario without estimates and patches.
    """

    title: Title = ""
    object: SupportedObject = SupportedObject()
    support: SupportParameters = SupportParameters()
    motion: InitialMotion = InitialMotion()
    simulation: SupportSimulation = SupportSimulation()
    pulses: Pulses[Pulse] = ()
    changes: Changes = ()

    # Functions and constants that depend on the kind of scenario.
    space = SUPPORT

    @property
    def fingers(self) -> tuple[SupportParameters, ...]:
        """The only contact."""
        return (self.support,)

    # Name of the only contact.
    finger_names = ("support",)

    @property
    def trajectory(self) -> InitialMotion:
        """The start; no motion is desired."""
        return self.motion

    # Defaults that have no effect: nothing is controlled.
    controller = _NO_CONTROLLER
    # Nothing is estimated.
    estimates = ()
    # Whether the contact has a spin: always.
    has_soft_fingers = True

    @property
    def friction_cone(self) -> FrictionCone:
        """Shape of the bound of the friction force: a cone."""
        return "cone"

    def to_mapping(self) -> dict[str, Any]:
        """The scenario as nested plain values, omitting None."""
        return asdict(self, dict_factory=without_none)


def full_support_scenario() -> SupportScenario:
    """A scenario with an item in every list; not for simulation."""
    return SupportScenario(
        object=SupportedObject(corners=((0.0, 0.0),)),
        pulses=(Pulse(time=0.0),),
        changes=(Change(time=1.0, parameter="object.mass", value=1.0),),
    )
