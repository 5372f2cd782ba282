"""How much energy a step may lose or make where object or joints turn fast.

Near singular poses the kinetic energy depends on the state more than any coordinate of it shows.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record

FAST_RATE = 4.0  # of the object or a joint, from which on energy counts [rad/s]
LEAST_LEDGER_STEP = 1e-6  # below it rounding decides [s]
ENERGY_ROUNDING = 2e-12
LEDGER_SHARE = 0.002  # of the relative tolerance, for energy


@compiled
def allowed_imbalance(numerics: Record, kinetic: float, supplied: float) -> float:
    """Energy that one step may lose or make [J].

    Args:
        numerics: Tolerances of the run.
        kinetic: Kinetic energy at the end of the step [J].
        supplied: Energy supplied until then [J].
    """
    share = max(LEDGER_SHARE * numerics.relative_tolerance, ENERGY_ROUNDING)
    return numerics.absolute_tolerance + share * (kinetic + abs(supplied))
