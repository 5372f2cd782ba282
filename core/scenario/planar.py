"""A scenario of a planar hand."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.chain import PlanarJoint, sliding_joints, torque_limits
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
from slipgrasp.core.scenario.controller import ControllerParameters, Estimate
from slipgrasp.core.scenario.field_types import CONFIG
from slipgrasp.core.scenario.finger import FingerParameters
from slipgrasp.core.scenario.held_object import ObjectParameters
from slipgrasp.core.scenario.motion import SetPoint, TrajectoryParameters
from slipgrasp.core.scenario.numerics import Change, SimulationParameters
from slipgrasp.core.scenario.space import PLANAR, Space
from slipgrasp.core.scenario.world import ActuationParameters, Patch, Pulse, SensingParameters


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class PlanarScenario:
    """A planar hand, an object, a desired motion, a controller and its unknown parameters.

    Equal scenarios give runs that are equal to the last bit.
    """

    title: Title = ""
    object: ObjectParameters = ObjectParameters()
    fingers: Fingers[FingerParameters]
    trajectory: TrajectoryParameters = TrajectoryParameters()
    controller: ControllerParameters = ControllerParameters()
    estimates: Estimates = ()
    sensing: SensingParameters = SensingParameters()
    actuation: ActuationParameters = ActuationParameters()
    simulation: SimulationParameters = SimulationParameters()
    pulses: Pulses[Pulse] = ()
    patches: Patches[Patch] = ()
    changes: Changes = ()

    @property
    def space(self) -> Space:
        """Functions and constants that depend on the kind of hand."""
        return PLANAR

    @property
    def has_soft_fingers(self) -> bool:
        """Whether any fingertip resists rotation on its face: never for planar hands."""
        return False

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
        return sliding_joints(self.fingers, PLANAR.joints_per_finger)

    @property
    def torque_limits(self) -> tuple[tuple[str, float | None], ...]:
        """Key and value of the torque limit of every joint, finger by finger."""
        return torque_limits(self.fingers, self.actuation.torque_limit, PLANAR.joints_per_finger)

    @property
    def friction_cone(self) -> FrictionCone:
        """Shape of the friction cone: a line, along the only tangent."""
        return "line"

    def to_mapping(self) -> dict[str, Any]:
        """The scenario as nested plain values, omitting None and empty ``parameters``."""
        return asdict(self, dict_factory=without_none)


def full_planar_scenario() -> PlanarScenario:
    """A scenario with an item in every list; not for simulation."""
    return PlanarScenario(
        object=ObjectParameters(corners=((0.0, 0.0),)),
        fingers=(FingerParameters(base=(0.0, 0.0), face="left", joints=(PlanarJoint(),)),) * 2,
        trajectory=TrajectoryParameters(
            set_points=(SetPoint(time=0.0, duration=1.0, pose=(0.0, 0.0, 0.0)),),
            table=((0.0, 0.0, 0.0, 0.0),),
        ),
        controller=ControllerParameters(lyapunov_matrix=((1.0,),)),
        pulses=(Pulse(time=0.0),),
        patches=(Patch(face="left"),),
        estimates=(Estimate(parameter="object.mass", initial=1.0),),
        changes=(Change(time=1.0, parameter="object.mass", value=1.0),),
    )
