"""Text about the worst estimate of a controller."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import law_of
from slipgrasp.core.scenario.unknowns import name_unknown, unit_of_unknown, unknown_of
from slipgrasp.core.trace.trace import Trace

_WORTH_TELLING = math.log(1.3)
_TURNING = 1e-6  # [rad/s]


def describe_misbelief(scenario: Scenario, row: Trace, *, of_friction: bool = True) -> str:
    """The estimate with the largest relative error; empty if all errors are small.

    Args:
        scenario: Parameters at that time.
        row: One row of the trace.
        of_friction: Whether estimates of friction are included.
    """
    believed, true = row.estimates[0].tolist(), row.true_parameters[0].tolist()
    found = worst_beliefs(scenario, believed, true, turns=turns(row), of_friction=of_friction)
    if not found:
        return ""
    worst = found[0]
    key = scenario.estimates[worst].parameter
    unit = unit_of_unknown(scenario, key)
    return (
        f"the controller estimated {name_unknown(scenario, key)} as {believed[worst]:.3g}{unit} "
        f"instead of {true[worst]:.3g}{unit}"
    )


def turns(last: Trace) -> bool:
    """Whether the object rotates in the row of a trace."""
    spin = last.object_velocity[0, last.shape.space.num_positions :]
    return bool(np.abs(spin).max() >= _TURNING)


def worst_beliefs(
    scenario: Scenario,
    believed: Sequence[float],
    true: Sequence[float],
    *,
    turns: bool,
    of_friction: bool = True,
) -> list[int]:
    """Indices of the estimates of one kind with large relative errors.

    The first has the largest error of all estimates, others of its kind follow; empty if all errors
    are small. Estimates that the law does not use are excluded, and so is the moment of inertia if
    the object does not rotate, because neither affects the run.

    Args:
        scenario: The scenario of the estimates.
        believed: Estimated values.
        true: True values.
        turns: Whether the object rotates.
        of_friction: Whether estimates of friction are included.
    """
    uses_friction = of_friction and law_of(scenario.controller.kind).uses_friction
    ignored = {"friction": not uses_friction, "object_inertia": not turns}
    kinds = [unknown_of(scenario, estimate.parameter).kind for estimate in scenario.estimates]
    distances = [_distance(*pair) for pair in zip(believed, true, strict=True)]
    far = [
        k
        for k, kind in enumerate(kinds)
        if distances[k] >= _WORTH_TELLING and not ignored.get(kind, False)
    ]
    far.sort(key=lambda k: -distances[k])
    return [k for k in far if kinds[k] == kinds[far[0]]]


def _distance(believed: float, true: float) -> float:
    """Logarithm of the ratio of estimate and true value; infinite for unphysical estimates."""
    if believed <= 0.0 or true <= 0.0:
        return 0.0 if believed == true else math.inf
    return abs(math.log(believed / true))
