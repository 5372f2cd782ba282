"""Short implicit steps at the slip onset of soft contacts.

The mobility of a spin is hundreds of times smaller than that along the face. While a force leaves
its limit surface, it therefore moves along it, and the initial slip direction changes earlier than
that of a hard contact. In each step, friction opposes the velocity at the end of the step,

    lambda = proj(lambda - rho (w + v^ / h)) on |lambda| <= mu F_n,   w_n = 0,

with v^ = (s', e psi') at its start, until the slip is fast enough to determine its direction.
Creep in stick continues in these steps.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.spatial.flow import set_derivative, spatial_plant
from slipgrasp.core.kernel.spatial.guards import sample_guards
from slipgrasp.core.kernel.spatial.kinematics import update_kinematics
from slipgrasp.core.kernel.spatial.state import normalise
from slipgrasp.core.kernel.spatial.torsion import spatial_begin_slips
from slipgrasp.core.kernel.spatial.torsion_directions import take_directions
from slipgrasp.core.kernel.spatial.torsion_layout import NORMAL
from slipgrasp.core.kernel.spatial.torsion_phases import prepare_pads

SHORTEST = 1e-14  # step that determines a direction [s]


@compiled
def onset_step(model: Record, discrete: Record, h: float, step: Record, work: Record) -> bool:
    """Fills ``end``, ``slopes`` and ``directions``; False if friction has no solution.

    Until another step is tried, ``discrete`` has the directions of this one.
    """
    take_directions(model, step.begun, discrete)
    for i in range(model.num_fingers):
        for part in range(NORMAL):
            step.directions[i, part] = step.begun[i, part]
    if not h > SHORTEST:
        return False
    spatial_plant(model, discrete, step.start, work)
    if spatial_begin_slips(model, discrete, step.start, work, h, 0) == 0:
        return False
    for i in range(model.num_fingers):
        for part in range(NORMAL):
            step.directions[i, part] = work.gamma[i, part]
    method = method_of(model, step)
    first, second = step.slopes[0], step.slopes[method.last]
    set_derivative(model, step.start, first, work)
    for j in range(model.num_states):
        step.end.x[j] = step.start.x[j] + h * first.x[j]
    normalise(step.end)
    update_kinematics(model.hand, discrete.seeds, step.end, work.kin)
    prepare_pads(model, step.end, work)
    set_derivative(model, step.end, second, work)
    for j in range(model.num_states):
        step.end.x[j] = step.start.x[j] + 0.5 * h * (first.x[j] + second.x[j])
    normalise(step.end)
    take_directions(model, step.directions, discrete)
    spatial_plant(model, discrete, step.end, work)
    for row in range(1, method.last + 1):
        share = method.nodes[row]
        for j in range(model.num_states if row < method.last else 0):
            step.slopes[row].x[j] = (1.0 - share) * first.x[j] + share * second.x[j]
        sample_guards(model, discrete, step.end, work, step.samples, row)
    return True
