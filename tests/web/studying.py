"""Plans and tiny studies for the tests of the study panel."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.web.model.study_draft import AxisDraft, StudyDraft

STUDY_DRAFT = StudyDraft(
    (AxisDraft("object.mass", 0.5, 2.5, 3), AxisDraft("fingers.*.friction", 0.1, 0.5, 3))
)
"""Nine runs; the heavier objects of the quick scenario are lost, or not at rest."""


def quick_scenario(duration: float = 0.2) -> Scenario:
    """The paper's first case, over in a moment."""
    scenario = with_values(load_scenario("paper-case-1"), {"simulation.duration": duration})
    return replace(scenario, title="quick")
