"""What a controller was most wrong about, in words."""

from __future__ import annotations

import math

from core.scenario import Scenario
from core.trace import Trace
from core.unknowns import name_unknown, unit_of_unknown

__all__ = ["describe_misbelief"]

_WORTH_TELLING = math.log(1.3)
_TURNING = 1e-6  # [rad/s]


def describe_misbelief(scenario: Scenario, last: Trace) -> str:
    """The estimate that is farthest from the truth, in proportion; empty if all are near.

    Args:
        scenario: Parameters at that time.
        last: Trace of one row.
    """
    believed, true = last.estimates[0], last.true_parameters[0]
    distances = [_distance(*pair) for pair in zip(believed, true, strict=True)]
    if abs(last.object_velocity[0, 2]) < _TURNING and "object.inertia" in last.shape.unknowns:
        # What does not turn shows nothing of its moment of inertia, and suffers nothing from it.
        distances[last.shape.unknowns.index("object.inertia")] = 0.0
    worst = max(range(len(distances)), key=distances.__getitem__, default=None)
    if worst is None or distances[worst] < _WORTH_TELLING:
        return ""
    key = last.shape.unknowns[worst]
    unit = unit_of_unknown(scenario, key)
    return (
        f"the controller believed {name_unknown(scenario, key)} to be {believed[worst]:.3g}{unit}, "
        f"it is {true[worst]:.3g}{unit}"
    )


def _distance(believed: float, true: float) -> float:
    """Logarithm of their ratio; infinite for a belief that no body can have."""
    if believed <= 0.0 or true <= 0.0:
        return 0.0 if believed == true else math.inf
    return abs(math.log(believed / true))
