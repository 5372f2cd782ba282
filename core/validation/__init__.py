"""What a single field cannot say: conditions between the fields of a scenario."""

from __future__ import annotations

from core.exceptions import ScenarioError
from core.scenario import Scenario
from core.validation.control import (
    check_control,
    check_gains,
    check_latency,
    check_least_gain,
    check_normal_forces,
    check_sampled,
)
from core.validation.estimates import check_estimates
from core.validation.hand import check_faces, check_start_pose
from core.validation.outline import check_outline
from core.validation.times import check_times
from core.validation.trajectory import check_trajectory
from core.validation.world import check_patches, check_pulses, check_static_friction

__all__ = ["check_scenario"]

_CHECKS = (
    check_outline,
    check_faces,
    check_start_pose,
    check_trajectory,
    check_estimates,
    check_gains,
    check_least_gain,
    check_control,
    check_normal_forces,
    check_sampled,
    check_latency,
    check_times,
    check_static_friction,
    check_patches,
    check_pulses,
)


def check_scenario(scenario: Scenario) -> None:
    """Raises if the fields of a scenario do not fit together.

    Raises:
        ScenarioError: With one entry per wrong field.
    """
    errors = [error for check in _CHECKS for error in check(scenario)]
    if errors:
        raise ScenarioError(errors)
