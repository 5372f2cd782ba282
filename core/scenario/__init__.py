"""A scenario: everything that decides the result of a run, and nothing else.

Every field carries its unit, bounds and a sentence (`core.parameters.Quantity`).
Quantities are SI. The paper's two sample cases lie in ``core/presets``.
"""

from core.scenario.controller import ControllerParameters, Estimate
from core.scenario.finger import FingerParameters
from core.scenario.held_object import ObjectParameters
from core.scenario.laws import CONTROL_LAWS, SAMPLED_CONTROL, ControlLaw, LawSetting
from core.scenario.simulation import MAX_CHATTER_CHANGES, Change, SimulationParameters
from core.scenario.trajectory import (
    MAX_SET_POINTS,
    MAX_TABLE_ROWS,
    SetPoint,
    TrajectoryParameters,
)
from core.scenario.whole import MAX_FINGERS, MAX_UNKNOWNS, Scenario
from core.scenario.world import ActuationParameters, Patch, Pulse, SensingParameters

__all__ = [
    "CONTROL_LAWS",
    "MAX_CHATTER_CHANGES",
    "MAX_FINGERS",
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
