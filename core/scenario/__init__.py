"""A scenario: the complete input of a run.

Every field has a unit, bounds and a sentence (`slipgrasp.core.scenario.parameters.Quantity`).
Quantities are SI. The paper's two sample cases are in ``core/scenario/presets``.
"""

from slipgrasp.core.scenario.common import MAX_DIAGNOSTICS, MAX_LAW_PARAMETERS, MAX_UNKNOWNS
from slipgrasp.core.scenario.controller import ControllerParameters, Estimate
from slipgrasp.core.scenario.field_types import MAX_FINGERS
from slipgrasp.core.scenario.finger import FingerParameters
from slipgrasp.core.scenario.held_object import ObjectParameters
from slipgrasp.core.scenario.laws import (
    CONTROL_LAWS,
    SAMPLED_CONTROL,
    ControlLaw,
    LawSetting,
)
from slipgrasp.core.scenario.motion import (
    MAX_SET_POINTS,
    MAX_TABLE_ROWS,
    SetPoint,
    TrajectoryParameters,
)
from slipgrasp.core.scenario.numerics import MAX_CHATTER_CHANGES, Change, SimulationParameters
from slipgrasp.core.scenario.planar import PlanarScenario
from slipgrasp.core.scenario.rail import RailScenario
from slipgrasp.core.scenario.scenario import HandScenario, Scenario
from slipgrasp.core.scenario.space import PLANAR, RAIL, SPATIAL, SUPPORT, Space
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.supported import SupportScenario
from slipgrasp.core.scenario.world import ActuationParameters, Patch, Pulse, SensingParameters

__all__ = [
    "CONTROL_LAWS",
    "MAX_CHATTER_CHANGES",
    "MAX_DIAGNOSTICS",
    "MAX_FINGERS",
    "MAX_LAW_PARAMETERS",
    "MAX_SET_POINTS",
    "MAX_TABLE_ROWS",
    "MAX_UNKNOWNS",
    "PLANAR",
    "RAIL",
    "SAMPLED_CONTROL",
    "SPATIAL",
    "SUPPORT",
    "ActuationParameters",
    "Change",
    "ControlLaw",
    "ControllerParameters",
    "Estimate",
    "FingerParameters",
    "HandScenario",
    "LawSetting",
    "ObjectParameters",
    "Patch",
    "PlanarScenario",
    "Pulse",
    "RailScenario",
    "Scenario",
    "SensingParameters",
    "SetPoint",
    "SimulationParameters",
    "Space",
    "SpatialScenario",
    "SupportScenario",
    "TrajectoryParameters",
]
