"""Allowed energy error of a step with fast rotation of the object or a joint.

Near singular poses the kinetic energy is more sensitive than the tolerances of the coordinates
cover.
"""

from __future__ import annotations

from typing import Any

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record

FAST_RATE = 4.0  # of the object or a joint, above which energy is checked [rad/s]
LEAST_LEDGER_STEP = 1e-6  # below which rounding dominates [s]
ENERGY_ROUNDING = 2e-12
LEDGER_SHARE = 0.002  # of the relative tolerance, for energy


def make_energy_balance(stored_energy: Any, supplied_at: Any, dissipated_at: Any) -> Any:
    """Creates the function that returns what a ledger compares at two instants of a step.

    Args:
        stored_energy: Returns the kinetic and the potential energy of a state [J].
        supplied_at: Returns the index of the supplied energy in the state.
        dissipated_at: Returns that of the dissipated energy.
    """

    @compiled
    def energy_balance(model: Record, state: Record, kin: Record) -> tuple[float, float]:
        """Stored minus supplied plus dissipated energy, and the kinetic energy [J]."""
        kinetic, potential = stored_energy(model.hand, model.truth, kin, state)
        supplied, dissipated = state.x[supplied_at(model)], state.x[dissipated_at(model)]
        return kinetic + potential - supplied + dissipated, kinetic

    return energy_balance


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
