"""Conversion of a scenario table to the constants of the kernel, in compiled code.

Only sums, products, quotients, square roots and `slipgrasp.core.kernel.numerics.elementary` are
used, so that a model has the same bits on every machine.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record, as_record, make_record
from slipgrasp.core.kernel.laws.gripper import lag_share
from slipgrasp.core.kernel.loop.links import BY_CHAIN, BY_LINKS, ON_SLIDES
from slipgrasp.core.kernel.loop.model import (
    FRICTION,
    LINK_MASS,
    OBJECT_INERTIA,
    OBJECT_MASS,
    facts_table,
)
from slipgrasp.core.kernel.loop.pieces import pack_motion
from slipgrasp.core.kernel.numerics.dop853 import DOP853
from slipgrasp.core.kernel.numerics.elementary import exp, log
from slipgrasp.core.kernel.numerics.lyapunov import pack_coupling, pack_lyapunov
from slipgrasp.core.kernel.numerics.methods import BS32, DOPRI5, METHOD, RK43
from slipgrasp.core.kernel.planar.chain import pack_chain
from slipgrasp.core.kernel.planar.kinematics import turn_tangent
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.state import count_coordinates, count_states
from slipgrasp.core.scenario import (
    CONTROL_LAWS,
    ControllerParameters,
    FingerParameters,
    ObjectParameters,
    PlanarScenario,
    SensingParameters,
)
from slipgrasp.core.scenario.custom_laws import OUTSIDE, law_of
from slipgrasp.core.scenario.geometry import TANGENTS
from slipgrasp.core.scenario.parameters import kinds_using
from slipgrasp.core.scenario.space import PLANAR
from slipgrasp.core.scenario.table import NUMBER, TABLE, choices_of, place_of, write_table

# Values that vary between the segments of a run, beyond the parameters of its scenario.
STRETCH = np.dtype(
    [
        ("load", np.float64, (3,)),  # of pulses on the object [N, N, N m]
        ("slip_minimum", np.float64, (MAX_FINGERS,)),  # ends of the part of the face
        ("slip_maximum", np.float64, (MAX_FINGERS,)),  # with constant friction; NaN: full face [m]
        ("friction_factor", np.float64, (MAX_FINGERS,)),  # of patches
    ],
    align=True,
)

FORGETTING_TIME = 1e-3  # [s]
SHORT_PERIOD = 2e-3  # longest period for which low orders are accurate enough [s]
_INERTIA_DEVIATION, _DEVIATION = 0.1, 3.0

_CIRCLE = choices_of(ObjectParameters, "shape").index("circle")
_ELBOW_UP = choices_of(FingerParameters, "elbow").index("up")
_HOLD = choices_of(ControllerParameters, "distribution").index("hold")
_CUMULATIVE = choices_of(SensingParameters, "slip_detector").index("cumulative-sum")
_MINIMUM_GRASP = choices_of(ControllerParameters, "grasp_force").index("minimum")
# By face index; the edges of a polygon follow the faces of a rectangle.
_TANGENTS = np.array(tuple(TANGENTS.values()))
_FIRST_EDGE = len(TANGENTS)
_SIDES = tuple(TANGENTS).index("bottom")  # left and right come before
# By law index; the custom law is the last.
_LAWS = (*CONTROL_LAWS.values(), law_of(OUTSIDE))
_FACTS = facts_table(PLANAR)
_BRAKES = np.array([law.kind in kinds_using(ControllerParameters, "slip_stop") for law in _LAWS])
# Methods of sampled control in ascending order, and the method of continuous control.
_SAMPLED = np.array([BS32, RK43, DOPRI5], METHOD)
_CONTINUOUS = np.array([DOP853], METHOD)


def _list_unknowns() -> np.ndarray:
    """Parameters that can be estimated: table index, kind, finger and link (-1 if none)."""
    rows = [
        (place_of("object.mass"), OBJECT_MASS, -1, -1),
        (place_of("object.inertia"), OBJECT_INERTIA, -1, -1),
    ]
    for i in range(MAX_FINGERS):
        rows.append((place_of(f"fingers.{i}.friction"), FRICTION, i, -1))
        rows.append((place_of(f"fingers.{i}.mass"), LINK_MASS, i, 0))
        for link in range(2):
            rows.append((place_of(f"fingers.{i}.link_masses.{link}"), LINK_MASS, i, link))
            rows.append((place_of(f"fingers.{i}.joints.{link}.mass"), LINK_MASS, i, link))
    return np.array(rows, np.int64)


_UNKNOWNS = _list_unknowns()


def make_table(scenario: PlanarScenario) -> Record:
    """Table of a validated scenario (`slipgrasp.core.scenario.table`)."""
    numbers = np.zeros(TABLE.itemsize // NUMBER.itemsize)
    write_table(scenario, numbers)
    return as_record(numbers, TABLE)


def whole_faces() -> Record:
    """Values of a segment without pulses or patches."""
    stretch = make_record(STRETCH)
    stretch.slip_minimum[:] = stretch.slip_maximum[:] = np.nan
    stretch.friction_factor[:] = 1.0
    return stretch


def pack_model(table: Record, stretch: Record) -> Record:
    """Constants of a segment for the kernel; see `pack`."""
    model = make_record(MODEL)
    call(pack, table, stretch, model)
    return model


@compiled_apart(types.void, TABLE, STRETCH, MODEL)
def pack(table: Record, stretch: Record, model: Record) -> None:
    """Packs a scenario for the kernel.

    Args:
        table: Parameters of the scenario.
        stretch: Values of the segment.
        model: Constants of the kernel; every value in use is set.
    """
    n, p = int(table.fingers.count), int(table.estimates.count)
    model.num_fingers = model.hand.num_fingers = model.truth.num_fingers = n
    model.law.num_fingers = n
    model.num_unknowns = model.unknowns.count = p
    model.num_states = count_states(n, p)
    model.num_diagnostics = 0
    model.hand.gravity = model.nominal.gravity = table.simulation.gravity
    model.nominal.num_fingers = n
    model.hand.joints_rub = False
    model.truth.object_inertia[0] = model.truth.object_inertia[1] = table.object.mass
    model.truth.object_inertia[2] = table.object.inertia
    for c in range(3):
        model.load[c] = stretch.load[c]
    for i in range(n):
        _pack_finger(table.fingers.entries[i], i, model)
        _pack_torque_limits(table.fingers.entries[i], i, table.actuation.torque_limit, model.hand)
        _pack_links(table.fingers.entries[i], i, 1.0, model.hand)
        _pack_links(table.fingers.entries[i], i, table.controller.link_length_ratio, model.nominal)
        _pack_contact(table, stretch, i, model)
    for k in range(p):
        _pack_unknown(table.estimates.entries[k], k, model.unknowns)
    _pack_law(table, n, model.law)
    _pack_learning(table, model.unknowns, model.law)
    _pack_world(table, model)
    _pack_numerics(table.simulation, model.numerics)
    pack_motion(table.trajectory, model.motion)
    _pack_methods(table.controller.control_period, model)


@compiled
def _pack_methods(period: float, model: Record) -> None:
    """Sets the methods from which the order is chosen; for long periods, only the highest.

    A lower order would be barely within tolerance there, too inaccurate for closed loops that
    amplify errors.
    """
    model.num_methods = 1
    if period == 0.0:
        model.methods[0] = _CONTINUOUS[0]
    elif period > SHORT_PERIOD:
        model.methods[0] = _SAMPLED[-1]
    else:
        model.num_methods = len(_SAMPLED)
        for rank in range(len(_SAMPLED)):
            model.methods[rank] = _SAMPLED[rank]


@compiled
def _or(value: float, otherwise: float) -> float:
    """Returns a number, or the default if it is NaN (omitted)."""
    return value if value == value else otherwise


@compiled
def _pack_finger(finger: Record, i: int, model: Record) -> None:
    hand, truth = model.hand, model.truth
    kind = int(finger.kind)
    hand.kinds[i] = model.nominal.kinds[i] = kind
    for link in range(2):
        hand.bases[i, link] = finger["base"][link]  # `.base` is an attribute of NumPy arrays
        truth.link_masses[i, link] = finger.link_masses[link]
    if kind == ON_SLIDES:
        truth.link_masses[i, 0], truth.link_masses[i, 1] = finger.mass, 0.0
    elif kind == BY_CHAIN:
        pack_chain(finger, hand.chains[i])
        pack_chain(finger, model.nominal.chains[i])
        for link in range(2):
            truth.link_masses[i, link] = finger.joints.entries[link].mass
    hand.elbows[i] = -1.0 if finger.elbow == _ELBOW_UP else 1.0
    hand.joint_damping[i], hand.joint_friction[i] = finger.joint_damping, finger.joint_friction
    hand.joints_rub = hand.joints_rub or finger.joint_damping + finger.joint_friction > 0.0


@compiled
def _pack_links(finger: Record, i: int, ratio: float, hand: Record) -> None:
    """Packs the links with lengths scaled by a ratio, same mass fractions; 0 for other kinds."""
    ratio = ratio if finger.kind == BY_LINKS else 0.0
    for link in range(2):
        length, centre = ratio * finger.link_lengths[link], finger.link_centre_fractions[link]
        inertia = centre * centre + finger.link_inertia_fractions[link]
        hand.link_lengths[i, link] = length
        hand.link_centres[i, link] = centre * length
        hand.link_moments[i, link] = inertia * (length * length)


@compiled
def _pack_torque_limits(finger: Record, i: int, limit: float, hand: Record) -> None:
    """Packs the limit of all joints or, if it is omitted, those of the joints of a chain."""
    for joint in range(2):
        own = finger.joints.entries[joint].torque_limit if finger.kind == BY_CHAIN else np.inf
        hand.torque_limits[i, joint] = _or(_or(limit, own), np.inf)


@compiled
def _pack_contact(table: Record, stretch: Record, i: int, model: Record) -> None:
    """Packs frame and friction of a contact (docs/model.md, Contact)."""
    hand, truth, finger = model.hand, model.truth, table.fingers.entries[i]
    offset, factor = finger.contact_offset, stretch.friction_factor[i]
    x, y, tx, ty, half = _face(table.object, int(finger.face))
    radius = table.object.radius if table.object.shape == _CIRCLE else 0.0
    hand.radii[i] = model.nominal.radii[i] = radius
    if radius > 0.0:
        tx, ty = turn_tangent(tx, ty, offset / radius)
        x, y, offset, half = -radius * ty, radius * tx, 0.0, np.inf
    hand.anchors[i, 0], hand.anchors[i, 1] = x + offset * tx, y + offset * ty
    hand.tangents[i, 0], hand.tangents[i, 1] = tx, ty
    hand.slip_minimum[i] = _or(stretch.slip_minimum[i], -half - offset)
    hand.slip_maximum[i] = _or(stretch.slip_maximum[i], half - offset)
    truth.friction[i] = finger.friction * factor
    truth.static_friction[i] = _or(finger.static_friction, finger.friction) * factor


@compiled
def _face(body: Record, face: int) -> tuple[float, float, float, float, float]:
    """Midpoint and tangent of a face in the object frame, and half its length."""
    if face < _FIRST_EDGE:
        tx, ty = _TANGENTS[face, 0], _TANGENTS[face, 1]
        depth, half = body.half_width, body.face_half_length
        if face >= _SIDES:
            depth, half = half, depth
        return -depth * ty, depth * tx, tx, ty, half
    edge, corners = face - _FIRST_EDGE, body.corners.entries
    following = edge + 1 if edge + 1 < int(body.corners.count) else 0
    x0, y0 = corners[edge, 0], corners[edge, 1]
    x1, y1 = corners[following, 0], corners[following, 1]
    length = np.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    # Corners run counter-clockwise, the tangent clockwise.
    return (
        0.5 * (x0 + x1),
        0.5 * (y0 + y1),
        (x0 - x1) / length,
        (y0 - y1) / length,
        0.5 * length,
    )


@compiled
def _pack_unknown(estimate: Record, k: int, unknowns: Record) -> None:
    for row in range(len(_UNKNOWNS)):
        if _UNKNOWNS[row, 0] == estimate.parameter:
            unknowns.kinds[k] = _UNKNOWNS[row, 1]
            unknowns.fingers[k], unknowns.links[k] = _UNKNOWNS[row, 2], _UNKNOWNS[row, 3]
    unknowns.minimum[k] = _or(estimate.minimum, -np.inf)
    unknowns.maximum[k] = _or(estimate.maximum, np.inf)


@compiled
def _pack_law(table: Record, n: int, law: Record) -> None:
    controller = table.controller
    law.facts = _FACTS[int(controller.kind)]
    law.period = controller.control_period
    law.recognition_time = controller.recognition_time
    for k in range(count_coordinates(n)):
        gain = controller.position_gain[k] if k < 3 else controller.slip_position_gain[k - 3]
        law.position_gains[k] = gain
        law.velocity_gains[k] = controller.velocity_gain[k]
    _pack_weights(controller, count_coordinates(n), law)
    law.grasp_force = controller.grasp_force == _MINIMUM_GRASP
    law.link_mass_ratio = controller.link_mass_ratio
    law.knows_lengths = controller.link_length_ratio == 1.0
    law.holds = controller.distribution == _HOLD
    law.grip_safety = controller.grip_safety
    law.minimum_normal_force = controller.minimum_normal_force
    law.maximum_normal_force = _or(controller.maximum_normal_force, np.inf)
    law.estimate_norm_bound = controller.estimate_norm_bound
    law.latency = controller.latency
    law.predicts = controller.prediction > 0.0 and controller.latency > 0.0
    law.grip_force, law.grip_rate = controller.grip_force, controller.grip_rate
    law.jaw_stiffness, law.jaw_damping = controller.jaw_stiffness, controller.jaw_damping
    law.force_rate = controller.force_rate
    law.force_share = lag_share(controller.force_bandwidth, law.period)


@compiled
def _pack_weights(controller: Record, size: int, law: Record) -> None:
    """Packs P of Eq. 25 for the weight or the matrix Q."""
    law.couples = controller.lyapunov_matrix.count > 0.0
    for j in range(size):
        weight = controller.lyapunov_weight[j]
        pack_lyapunov(law, j, weight, 0.0, weight)
        if not law.couples:
            continue
        rows = controller.lyapunov_matrix.entries
        position, rate = rows[j].entries, rows[size + j].entries
        pack_lyapunov(law, j, position[j], position[size + j], rate[size + j])
        for k in range(size):
            if k != j:
                pack_coupling(
                    law, size, j, k, position[k], position[size + k], rate[k], rate[size + k]
                )


@compiled
def _pack_learning(table: Record, unknowns: Record, law: Record) -> None:
    controller = table.controller
    law.slip_stop = controller.slip_stop if _BRAKES[int(controller.kind)] else 0.0
    spans = controller.control_period / FORGETTING_TIME
    law.forgetting = exp(spans * log(controller.forgetting))
    law.probing = controller.probing
    law.force_variance = controller.force_noise * controller.force_noise
    law.acceleration_variance = _difference_variance(table)
    half = 0.5 * table.sensing.slip_threshold
    law.slip_level = half if table.sensing.true_phases == 0.0 else -np.inf
    for k in range(unknowns.count):
        law.adaptation_gains[k] = controller.adaptation_gain[k]
        usual = _INERTIA_DEVIATION if unknowns.kinds[k] == OBJECT_INERTIA else _DEVIATION
        deviation = _or(controller.initial_deviation[k], usual)
        law.prior_variances[k] = deviation * deviation


@compiled
def _difference_variance(table: Record) -> float:
    """Variance of filtered velocity differences for the noise that the law assumes [m^2/s^4].

    White noise of variance s^2, differenced over T and filtered with coefficient a:
    (a/T)^2 s^2 2/(2 - a).
    """
    sensing, controller = table.sensing, table.controller
    if sensing.true_accelerations > 0.0 or controller.control_period == 0.0:
        return 0.0
    whole = sensing.acceleration_filter_time + controller.control_period
    share = controller.control_period / whole
    noise = controller.velocity_noise
    return 2.0 * noise * noise / (whole * whole * (2.0 - share))


@compiled
def _pack_world(table: Record, model: Record) -> None:
    """Packs the sensors and the actuator limits."""
    sensing, sensors, actuators = table.sensing, model.sensors, model.actuators
    sensors.position_noise = sensing.position_noise
    sensors.velocity_noise = sensing.velocity_noise
    sensors.acceleration_noise = sensing.acceleration_noise
    noise = sensing.position_noise + sensing.velocity_noise + sensing.acceleration_noise
    sensors.noisy = 1 if noise > 0.0 else 0
    sensors.seed = int(table.simulation.seed)
    sensors.true_accelerations = int(sensing.true_accelerations)
    sensors.filter_time = sensing.acceleration_filter_time
    sensors.true_phases = int(sensing.true_phases)
    sensors.slip_threshold, sensors.slip_delay = sensing.slip_threshold, sensing.slip_delay
    sensors.sums_slip = 1 if sensing.slip_detector == _CUMULATIVE else 0
    expected, sensors.least_sum = table.controller.velocity_noise, 0.0
    if sensing.slip_threshold > 0.0:
        sensors.least_sum = 20.0 * expected * expected / sensing.slip_threshold
    true = sensors.true_accelerations * sensors.true_phases
    sensors.perfect = true * (1 - sensors.noisy) if model.law.knows_lengths else 0
    sensors.slip_delay_deviation = sensing.slip_delay_deviation
    sensors.force_noise, sensors.force_filter_time = sensing.force_noise, sensing.force_filter_time
    for axis in range(2):
        sensors.force_bias[axis] = sensing.force_bias[axis]
    actuators.torque_limit = _or(table.actuation.torque_limit, np.inf)
    actuators.torque_rate_limit = _or(table.actuation.torque_rate_limit, np.inf)


@compiled
def _pack_numerics(simulation: Record, numerics: Record) -> None:
    numerics.relative_tolerance = simulation.relative_tolerance
    numerics.absolute_tolerance = simulation.absolute_tolerance
    numerics.max_step = simulation.max_step
    numerics.max_steps = int(simulation.max_steps)
    numerics.output_rate = simulation.output_rate
    numerics.chatter_changes = int(simulation.chatter_changes)
    numerics.chatter_window = simulation.chatter_window
