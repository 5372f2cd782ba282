"""Validation across fields: conditions that no single field can state."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import PLANAR, RAIL, SPATIAL, SUPPORT, Scenario, Space
from slipgrasp.core.scenario.field_errors import refuse_other_types
from slipgrasp.core.scenario.validation.control import (
    check_control,
    check_estimates,
    check_gains,
    check_latency,
    check_law,
    check_law_parameters,
    check_least_gain,
    check_lyapunov_matrix,
    check_normal_forces,
    check_sampled,
)
from slipgrasp.core.scenario.validation.hand import check_faces, check_start_pose
from slipgrasp.core.scenario.validation.hands import check_computed
from slipgrasp.core.scenario.validation.outline import check_outline
from slipgrasp.core.scenario.validation.pads import check_pads
from slipgrasp.core.scenario.validation.rail import check_rail
from slipgrasp.core.scenario.validation.space import (
    check_body,
    check_sampled_only,
    check_spatial_contacts,
)
from slipgrasp.core.scenario.validation.trajectory import check_trajectory
from slipgrasp.core.scenario.validation.world import (
    check_patches,
    check_pulses,
    check_static_friction,
    check_times,
)

_CONTROL = (
    check_trajectory,
    check_estimates,
    check_gains,
    check_least_gain,
    check_lyapunov_matrix,
    check_law_parameters,
    check_control,
    check_normal_forces,
)
_EVENTS = (check_times, check_static_friction, check_patches, check_pulses)
_CHECKS: dict[Space, tuple[Callable[[Any], Iterator[FieldError]], ...]] = {
    PLANAR: (
        *(check_outline, check_faces, check_start_pose),
        *(*_CONTROL, check_sampled, check_latency, *_EVENTS),
    ),
    SPATIAL: (
        *(check_outline, check_body, check_spatial_contacts),
        *(*_CONTROL, check_sampled_only, check_latency, check_pads, *_EVENTS),
    ),
    SUPPORT: (check_outline, check_times, check_static_friction, check_pulses),
    RAIL: (check_rail, check_times, check_static_friction),
}


def check_scenario(scenario: Scenario, *, with_law: bool = True) -> None:
    """Raises an error if the fields of a scenario are inconsistent.

    Args:
        scenario: The scenario.
        with_law: Whether its laws must be loaded; a recording can be read without them.

    Raises:
        ScenarioError: With one item per wrong field.
    """
    refuse_other_types(scenario)
    checks_law = with_law and scenario.space.has_hand
    errors = [*check_law(scenario), *check_computed(scenario)] if checks_law else []
    unknown = {error.field for error in errors}
    others = [error for check in _CHECKS[scenario.space] for error in check(scenario)]
    # The requirements of an unknown law cannot be checked.
    errors += (error for error in others if error.field not in unknown)
    if errors:
        raise ScenarioError(errors)
