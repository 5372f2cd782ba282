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

from annotated_types import Ge, Le, Len
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.common import (
    Changes,
    FrictionCone,
    Pulses,
    Title,
    without_none,
)
from slipgrasp.core.scenario.controller import ControllerParameters, Estimate
from slipgrasp.core.scenario.field_types import CONFIG, Coordinate
from slipgrasp.core.scenario.held_object import MAX_CORNERS, SIDES, Corner, ObjectMass
from slipgrasp.core.scenario.numerics import (
    AbsoluteTolerance,
    Change,
    ChatterChanges,
    ChatterWindow,
    Duration,
    MaxStep,
    MaxSteps,
    OutputRate,
    RelativeTolerance,
)
from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.space import SUPPORT, Space
from slipgrasp.core.scenario.world import Patch, Pulse

HalfLength = Annotated[float, Ge(1e-3), Le(10.0)]
Speed = Annotated[float, Ge(-1e3), Le(1e3)]
Coefficient = Annotated[float, Ge(0.0), Le(10.0)]

NO_CONTROLLER = "none"
"""Kind of control in descriptions of runs."""

_NO_CONTROLLER = ControllerParameters(control_period=0.0)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SupportedObject:
    """The sliding body: a rectangle about its centre of mass, or a convex polygon, from above."""

    mass: ObjectMass = 0.37
    inertia: Annotated[
        float,
        Ge(1e-9),
        Le(1e3),
        Quantity(
            "Moment of inertia of the body about the normal of the support.",
            "kg m²",
            typical=(1e-4, 5e-3),
            changeable=True,
        ),
    ] = 6.773e-4
    half_width: Annotated[
        HalfLength, Quantity("Half the length of the body along its x axis.", "m")
    ] = 0.0524
    half_depth: Annotated[
        HalfLength, Quantity("Half the length of the body along its y axis.", "m")
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

    @property
    def shape(self) -> str:
        """Kind of outline."""
        return "polygon"

    @property
    def is_round(self) -> bool:
        """Whether the faces are curved: never."""
        return False

    @property
    def half_sizes(self) -> tuple[float, float]:
        """Half the sizes along x and y [m]."""
        return self.half_width, self.half_depth

    @property
    def half_height(self) -> float:
        """Extent perpendicular to the support, which is not modelled [m]."""
        return math.inf

    @property
    def face_names(self) -> tuple[str, ...]:
        """Names of the sides."""
        return tuple(f"edge-{k}" for k in range(len(self.corners))) or SIDES


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SupportParameters:
    """The plane under the body, and its friction."""

    friction: Annotated[
        Coefficient,
        Quantity(
            "Friction coefficient of the support while the body slides.",
            "1",
            typical=(0.05, 1.0),
            changeable=True,
        ),
    ] = 0.21
    static_friction: Annotated[
        Coefficient | None,
        Quantity(
            "Friction coefficient while the body is at rest (default: that of sliding).",
            "1",
            changeable=True,
        ),
    ] = None
    radius: Annotated[
        float,
        Ge(0.0),
        Le(1.0),
        Quantity(
            "Ratio of the largest friction moment about the normal to the largest friction force; "
            "0: the contact does not resist rotation.",
            "m",
            typical=(0.0, 0.1),
            changeable=True,
        ),
    ] = 0.0
    incline: Annotated[
        float,
        Ge(-1.5),
        Le(1.5),
        Quantity(
            "Angle of the plane, which rises along x.",
            "rad",
            typical=(-0.5, 0.5),
            changeable=True,
        ),
    ] = 0.0

    @property
    def eccentricity(self) -> float:
        """Radius of the support, with the name that it has for a soft fingertip [m]."""
        return self.radius

    @property
    def link_masses(self) -> tuple[float, ...]:
        """There are no links."""
        return ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class InitialMotion:
    """Pose and velocity of the body at the start."""

    start: Annotated[
        tuple[Coordinate, Coordinate, Annotated[float, Ge(-3.2), Le(3.2)]],
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
    gravity: Annotated[
        float, Ge(0.0), Le(100.0), Quantity("Gravitational acceleration.", "m/s²")
    ] = 9.81
    relative_tolerance: RelativeTolerance = 1e-8
    absolute_tolerance: AbsoluteTolerance = 1e-10
    max_step: MaxStep = 0.1
    max_steps: MaxSteps = 5_000_000
    chatter_changes: ChatterChanges = 100
    chatter_window: ChatterWindow = 0.15

    @property
    def seed(self) -> int:
        """Seed of sensor noise; there is none."""
        return 0


class WithoutHand:
    """Properties of a hand, with their values in a scenario without one."""

    __slots__ = ()

    @property
    def patches(self) -> tuple[Patch, ...]:
        """Patches; there are none."""
        return ()

    @property
    def slides(self) -> tuple[int, ...]:
        """There are no prismatic joints."""
        return ()

    @property
    def sliding_joints(self) -> tuple[int, ...]:
        """There are no prismatic joints."""
        return ()


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

    @property
    def space(self) -> Space:
        """Functions and constants that depend on the kind of scenario."""
        return SUPPORT

    @property
    def fingers(self) -> tuple[SupportParameters, ...]:
        """The only contact."""
        return (self.support,)

    @property
    def finger_names(self) -> tuple[str, ...]:
        """Name of the only contact."""
        return ("support",)

    @property
    def trajectory(self) -> InitialMotion:
        """The start; no motion is desired."""
        return self.motion

    @property
    def controller(self) -> ControllerParameters:
        """Defaults that have no effect: nothing is controlled."""
        return _NO_CONTROLLER

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Nothing is estimated."""
        return ()

    @property
    def has_soft_fingers(self) -> bool:
        """Whether the contact has a spin: always."""
        return True

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
