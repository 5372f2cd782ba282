"""Allowed energy error of a step with fast rotation of the object or a joint.

Near singular poses the kinetic energy is more sensitive than the tolerances of the coordinates
cover.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record

FAST_RATE = 4.0  # of the object or a joint, above which energy is checked [rad/s]
LEAST_LEDGER_STEP = 1e-6  # below which rounding dominates [s]
ENERGY_ROUNDING = 2e-12
LEDGER_SHARE = 0.002  # of the relative tolerance, for energy


@compiled
def allowed_imbalance(numerics: Record, kinetic: float, supplied: float) -> float:
    """Allowed energy error of one step [J].

    Args:
        numerics: Tolerances of the run.
        kinetic: Kinetic energy at the end of the step [J].
        supplied: Energy supplied until then [J].
    """
    share = max(LEDGER_SHARE * numerics.relative_tolerance, ENERGY_ROUNDING)
    return numerics.absolute_tolerance + share * (kinetic + abs(supplied))
