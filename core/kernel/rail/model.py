"""Constants of a segment of a run on a rail, and their computation from a scenario."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record, make_record
from slipgrasp.core.kernel.loop.model import NUMERICS
from slipgrasp.core.kernel.loop.motion import MAX_PIECES, motion_layout
from slipgrasp.core.kernel.numerics.dop853 import DOP853
from slipgrasp.core.kernel.numerics.elementary import sincos, square
from slipgrasp.core.kernel.numerics.lyapunov import pack_lyapunov
from slipgrasp.core.kernel.numerics.methods import METHOD
from slipgrasp.core.kernel.planar.model import HAND, TRUTH
from slipgrasp.core.scenario.motion import SAME_TIME
from slipgrasp.core.scenario.rail import RailScenario

FINGER, RAIL_CONTACT = range(2)
NUM_CONTACTS = 2
NUM_STATES = 10  # without an estimate
ADAPTIVE, COMPUTED, FEEDBACK = range(3)  # laws
_LAWS = {"theorem-3": ADAPTIVE, "certainty-equivalence": COMPUTED, "pd-gravity": FEEDBACK}
_MINIMUM_JERK = (10.0, -15.0, 6.0)

# With gains and weights as arrays of one coordinate, as in laws of hands.
LAW = np.dtype(
    [
        ("facts", np.dtype([("is_own", np.bool_)])),
        ("period", np.float64),  # 0: continuous
        ("kind", np.int64),
        ("position_gains", np.float64, (1,)),
        ("velocity_gains", np.float64, (1,)),
        ("adaptation_gain", np.float64),
        ("lyapunov_11", np.float64, (1,)),
        ("lyapunov_12", np.float64, (1,)),
        ("lyapunov_22", np.float64, (1,)),
        ("weight", np.float64),
        ("grip_force", np.float64),  # [N]
        ("minimum_normal_force", np.float64),  # [N]
        ("directions", np.float64, (MAX_PIECES,)),  # of the desired motion: -1, 0 or 1
    ],
    align=True,
)

MODEL = np.dtype(
    [
        ("num_fingers", np.int64),  # contacts: 2
        ("num_unknowns", np.int64),  # 1 if the mass is estimated
        ("num_states", np.int64),
        ("num_diagnostics", np.int64),  # 0
        ("hand", HAND),  # one finger
        ("truth", TRUTH),  # friction of both contacts
        ("cosine", np.float64),  # of the angle phi of the contact
        ("sine", np.float64),
        ("unknowns", np.int64),  # none but the mass
        ("law", LAW),
        ("motion", motion_layout(1)),
        ("numerics", NUMERICS),
        ("methods", METHOD, (1,)),
    ],
    align=True,
)


@compiled_apart(types.void, MODEL, types.float64, types.float64, types.float64)
def rail_pack(model: Record, angle: float, half_width: float, half_height: float) -> None:
    """Places the contact and computes P, with equal bits on every machine."""
    hand, law = model.hand, model.law
    model.sine, model.cosine = sincos(angle)
    # Relative to the point on the rail below the centre of the object.
    hand.anchors[0, 0] = -half_width * model.cosine
    hand.anchors[0, 1] = half_height + half_height * model.sine
    # The tip moves by -t s.
    hand.tangents[0, 0], hand.tangents[0, 1] = -model.sine, -model.cosine
    half = np.sqrt(square(half_height * model.cosine) + square(half_width * model.sine))
    hand.slip_minimum[0], hand.slip_maximum[0] = -half, half
    if law.kind == ADAPTIVE:
        pack_lyapunov(law, 0, law.weight, 0.0, law.weight)


def pack_model(scenario: RailScenario) -> Record:
    """Constants of a segment."""
    model = make_record(MODEL)
    body, p = scenario.object, len(scenario.estimates)
    model.num_fingers, model.num_unknowns = NUM_CONTACTS, p
    model.num_states = NUM_STATES + p
    _pack_finger(scenario, model.hand)
    model.truth.num_fingers = 1
    model.truth.link_masses[0] = scenario.finger.link_masses
    model.truth.object_inertia[:] = body.mass, body.mass, 1.0
    for i, contact in enumerate(scenario.fingers):
        static = contact.static_friction
        model.truth.friction[i] = contact.friction
        model.truth.static_friction[i] = contact.friction if static is None else static
    _pack_law(scenario, model.law)
    _pack_motion(scenario, model)
    call(rail_pack, model, scenario.finger.angle, body.half_width, body.face_half_length)
    for name in NUMERICS.names or ():
        model.numerics[name] = getattr(scenario.simulation, name)
    model["methods"][0] = DOP853
    return model


def _pack_finger(scenario: RailScenario, hand: Record) -> None:
    finger = scenario.finger
    hand.num_fingers, hand.gravity = 1, scenario.simulation.gravity
    hand.bases[0] = finger.base
    hand.elbows[0] = -1.0 if finger.elbow == "up" else 1.0
    for link in range(2):
        length, centre = finger.link_lengths[link], finger.link_centre_fractions[link]
        inertia = centre * centre + finger.link_inertia_fractions[link]
        hand.link_lengths[0, link] = length
        hand.link_centres[0, link] = centre * length
        hand.link_moments[0, link] = inertia * (length * length)


def _pack_law(scenario: RailScenario, law: Record) -> None:
    controller = scenario.controller
    law.kind = _LAWS[controller.kind]
    law.position_gains[0], law.velocity_gains[0] = (
        controller.position_gain,
        controller.velocity_gain,
    )
    law.adaptation_gain, law.weight = controller.adaptation_gain, controller.lyapunov_weight
    law.grip_force = controller.grip_force
    law.minimum_normal_force = controller.minimum_normal_force


def _pack_motion(scenario: RailScenario, model: Record) -> None:
    """Packs minimum-jerk motions between set-points, with rests in between, and their signs."""
    motion, piece, now = model.motion, 0, 0.0
    (here,) = scenario.trajectory.start
    motion.start[0] = here
    motion.breaks[:] = np.inf
    for point in scenario.trajectory.set_points:
        (there,) = point.pose
        if point.time - now > SAME_TIME:
            motion.polynomials[piece, 0, 0] = here
            motion.breaks[piece] = point.time
            piece += 1
        motion.polynomials[piece, 0, 0] = here
        power = point.duration * point.duration
        for k in range(3):
            power *= point.duration
            motion.polynomials[piece, 0, 3 + k] = (there - here) * (_MINIMUM_JERK[k] / power)
        now = point.time + point.duration
        motion.breaks[piece] = now
        model.law.directions[piece] = np.sign(there - here)
        here, piece = there, piece + 1
    motion.polynomials[piece, 0, 0] = here
