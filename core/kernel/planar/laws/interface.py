"""Interface of the control laws: command a torque, and adapt (docs/model.md, Controllers).

The workspace contains the inputs of a law (measured state, estimated phases, masses and friction)
and its outputs (tip forces, rates of the estimates). The facts of
`slipgrasp.core.scenario.laws.ControlLaw` select the law. Functions used in every evaluation of the
theorems are inlined; other laws are compiled separately.
"""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.laws.grip_reflex import squeeze_harder
from slipgrasp.core.kernel.laws.gripper import approach_grip
from slipgrasp.core.kernel.planar.laws.certainty_equivalence import command_forces
from slipgrasp.core.kernel.planar.laws.composite import COMPOSITE_MEMORY, learn
from slipgrasp.core.kernel.planar.laws.gripper import close_jaws
from slipgrasp.core.kernel.planar.laws.pd_gravity import command_grip
from slipgrasp.core.kernel.planar.laws.theorem_3 import gradient_rates
from slipgrasp.core.kernel.planar.laws.theorem_4 import pull_back
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.state import STATE, estimate_at
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE


@compiled
def command(model: Record, discrete: Record, t: float, state: Record, work: Record) -> int:
    """Writes the commanded torque as tip forces u = J^-T tau to ``work.tip_forces``.

    Returns:
        1, or 0 if there is no unique solution.
    """
    law = model.law
    if law.facts.is_own:
        work.room.violation = 0.0
        for i in range(model.num_fingers):
            work.tip_forces[i, 0] = work.tip_forces[i, 1] = 0.0  # it computes torques at ticks only
        return 1
    if law.facts.uses_friction:
        return command_forces(model, discrete, work)
    if law.facts.holds_tips:
        return close_jaws(model, discrete, t, state, work)
    grip = law.grip_force
    if law.facts.reacts_to_slip:
        grip += discrete.added_grip
    return command_grip(model, work, grip)


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def adapt(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Writes the rates of the estimates before projection (Eq. 24 / 28), for the measured x''."""
    count = model.num_unknowns
    if not model.law.facts.learns:
        for k in range(count):
            work.rates[k] = 0.0
        return
    gradient_rates(model, discrete, work)
    sigma = pull_back(model.law, state, count) if model.law.facts.pulls_back else 0.0
    for k in range(count):
        estimate = state.x[estimate_at(model.num_fingers, k)]
        work.rates[k] = model.law.adaptation_gains[k] * work.rates[k] - sigma * estimate


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE, COMPOSITE_MEMORY)
def adapt_at_tick(
    model: Record, discrete: Record, state: Record, work: Record, memory: Record
) -> None:
    """Writes the rates of the estimates until the next tick of sampled control.

    Laws with a memory update it here, and the grip reflex reacts to slip.

    Args:
        model: Constants of the run.
        discrete: State of the controller, including the additional grip of the grip reflex.
        state: Measured state.
        work: Evaluated at that state with the current torque; the rates are written to it.
        memory: Memory of the law, if any.
    """
    if model.law.facts.has_memory:
        learn(model, discrete, state, work, memory)
        return
    if model.law.facts.reacts_to_slip:
        squeeze_harder(model, discrete)
    if model.law.facts.holds_tips:
        approach_grip(model.law, discrete)
    adapt(model, discrete, state, work)
