"""Constants of a segment of a run of a body on a support, and their computation from a scenario."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record, make_record
from slipgrasp.core.kernel.loop.model import NUMERICS
from slipgrasp.core.kernel.numerics.elementary import sincos
from slipgrasp.core.kernel.numerics.methods import DOPRI5, METHOD
from slipgrasp.core.kernel.support.state import NUM_STATES
from slipgrasp.core.scenario.supported import SupportScenario

# The support, with the name that the loop gives to geometry.
HAND = np.dtype(
    [
        ("radius", np.float64),  # c of the limit surface [m]
        ("fall", np.float64),  # g sin(incline), downhill along -x [m/s^2]
        ("start", np.float64, (3,)),  # pose at zero slip [m, m, rad]
    ],
    align=True,
)

TRUTH = np.dtype(
    [
        ("mass", np.float64),  # [kg]
        ("inertia", np.float64),  # [kg m^2]
        ("normal_force", np.float64),  # [N]
        ("friction", np.float64, (1,)),
        ("static_friction", np.float64, (1,)),
    ],
    align=True,
)

# Nothing is controlled.
LAW = np.dtype([("period", np.float64), ("facts", np.dtype([("is_own", np.bool_)]))], align=True)

MODEL = np.dtype(
    [
        ("num_fingers", np.int64),  # contacts: 1
        ("num_unknowns", np.int64),  # 0
        ("num_states", np.int64),
        ("num_diagnostics", np.int64),  # 0
        ("hand", HAND),
        ("truth", TRUTH),
        ("load", np.float64, (3,)),  # force and moment of pulses [N, N m]
        ("unknowns", np.int64),  # none
        ("law", LAW),
        ("numerics", NUMERICS),
        ("methods", METHOD, (1,)),
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, types.float64, types.float64)
def support_incline(model: Record, gravity: float, incline: float) -> None:
    """Resolves gravity along the plane and its normal, with equal bits on every machine."""
    sine, cosine = sincos(incline)
    model.hand.fall = gravity * sine
    model.truth.normal_force = model.truth.mass * (gravity * cosine)


def pack_model(scenario: SupportScenario, load: Sequence[float]) -> Record:
    """Constants of a segment.

    Args:
        scenario: Scenario during the segment.
        load: Force (x, y) and moment of the active pulses [N, N m].
    """
    model = make_record(MODEL)
    body, support = scenario.object, scenario.support
    model.num_fingers, model.num_states = 1, NUM_STATES
    model.hand.radius = support.radius
    model.hand.start[:] = scenario.motion.start
    model.truth.mass, model.truth.inertia = body.mass, body.inertia
    static = support.static_friction
    model.truth.friction[0] = support.friction
    model.truth.static_friction[0] = support.friction if static is None else static
    call(support_incline, model, scenario.simulation.gravity, support.incline)
    model.load[:] = load
    for name in NUMERICS.names or ():
        model.numerics[name] = getattr(scenario.simulation, name)
    model["methods"][0] = DOPRI5
    return model
