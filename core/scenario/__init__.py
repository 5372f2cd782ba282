"""A scenario: everything that decides the result of a run, and nothing else.

Every field carries its unit, bounds and a sentence (`slipgrasp.core.scenario.parameters.Quantity`).
Quantities are SI. The paper's two sample cases lie in ``core/scenario/presets``.
"""

from slipgrasp.core.scenario.controller import ControllerParameters, Estimate
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
from slipgrasp.core.scenario.whole import (
    MAX_DIAGNOSTICS,
    MAX_FINGERS,
    MAX_LAW_PARAMETERS,
    MAX_UNKNOWNS,
    Scenario,
)
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
    "SAMPLED_CONTROL",
    "ActuationParameters",
    "Change",
    "ControlLaw",
    "ControllerParameters",
    "Estimate",
    "FingerParameters",
    "LawSetting",
    "ObjectParameters",
    "Patch",
    "Pulse",
    "Scenario",
    "SensingParameters",
    "SetPoint",
    "SimulationParameters",
    "TrajectoryParameters",
]
