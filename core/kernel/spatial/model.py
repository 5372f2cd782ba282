"""Constants of a spatial run for the kernel, and their computation from a scenario."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record, make_record
from slipgrasp.core.kernel.laws.gripper import lag_share
from slipgrasp.core.kernel.loop.links import BY_CHAIN, ON_SLIDES
from slipgrasp.core.kernel.loop.model import (
    ACTUATORS,
    FRICTION,
    LINK_MASS,
    NUMERICS,
    OBJECT_INERTIA,
    OBJECT_MASS,
    SENSORS,
    UNKNOWNS,
    facts_layout,
    facts_table,
    law_layout,
)
from slipgrasp.core.kernel.numerics.elementary import exp, log
from slipgrasp.core.kernel.numerics.lyapunov import pack_coupling, pack_lyapunov
from slipgrasp.core.kernel.numerics.methods import BS32, DOPRI5, METHOD, RK43
from slipgrasp.core.kernel.numerics.rosenbrock import ROS34PW2
from slipgrasp.core.kernel.spatial.chain import CHAIN
from slipgrasp.core.kernel.spatial.chain_packing import pack_chain
from slipgrasp.core.kernel.spatial.curved_faces import CYLINDER, SPHERE, start_on_face
from slipgrasp.core.kernel.spatial.motion import MOTION, pack_motion
from slipgrasp.core.kernel.spatial.state import (
    count_coordinates,
    count_states,
    number_of_coordinates,
)
from slipgrasp.core.scenario.chain import MAX_LINKS, has_limits
from slipgrasp.core.scenario.custom_laws import law_number
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.core.scenario.spatial import (
    SpatialController,
    SpatialFinger,
    SpatialObject,
    SpatialScenario,
)
from slipgrasp.core.scenario.spatial_geometry import edges_of, has_disc, spatial_contact
from slipgrasp.core.scenario.unknowns import parse_unknown
from slipgrasp.core.scenario.world import MAX_PATCHES

MAX_EDGES = 12
MAX_COORDINATES = number_of_coordinates(MAX_FINGERS)
# Q of Eq. 25.
_MATRIX = np.dtype([("entries", np.float64, (2 * MAX_COORDINATES, 2 * MAX_COORDINATES))])
FORGETTING_TIME = 1e-3  # [s]
INERTIA_DEVIATION, DEVIATION = 0.1, 3.0
_FACTS = facts_table(SPATIAL)

_CURVED_FACES = {"cylinder": CYLINDER, "sphere": SPHERE}
_KINDS = {
    "object_mass": OBJECT_MASS,
    "object_inertia": OBJECT_INERTIA,
    "friction": FRICTION,
    "link_mass": LINK_MASS,
}

# Edge of a round patch, in coordinates of the slip of a fingertip.
RIM = np.dtype(
    [
        ("centre", np.float64, (2,)),  # [m]
        ("radius", np.float64),  # [m]
        ("side", np.float64),  # 1: the fingertip is inside, -1: outside
    ],
    align=True,
)

# Geometry of fingers, contacts and faces; friction of joints.
HAND = np.dtype(
    [
        ("num_fingers", np.int64),
        ("kinds", np.int64, (MAX_FINGERS,)),  # BY_LINKS, ON_SLIDES or BY_CHAIN
        ("has_chains", np.int64),  # 1 if any finger is a chain
        ("has_limits", np.int64),  # 1 if any joint of a chain has a limit
        ("torque_limits", np.float64, (MAX_FINGERS, 3)),  # inf if none [N m, N]
        ("chains", CHAIN, (MAX_FINGERS,)),
        ("link_lengths", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("link_centres", np.float64, (MAX_FINGERS, 2)),  # from the proximal joint [m]
        ("link_moments", np.float64, (MAX_FINGERS, 2)),  # inertia per mass about that joint [m^2]
        ("own_moments", np.float64, (MAX_FINGERS, 2)),  # the same about the centre of mass [m^2]
        ("bases", np.float64, (MAX_FINGERS, 3)),  # [m]
        ("elbows", np.float64, (MAX_FINGERS,)),  # sign of sin q3
        ("least_radii", np.float64, (MAX_FINGERS,)),  # minimum tip radius [m]
        ("anchors", np.float64, (MAX_FINGERS, 3)),  # object frame [m]
        ("frames", np.float64, (MAX_FINGERS, 3, 3)),  # t_x, t_y, n in the object frame
        ("curved_faces", np.int64, (MAX_FINGERS,)),  # FLAT, CYLINDER or SPHERE
        ("radii", np.float64, (MAX_FINGERS,)),  # of curved faces [m]
        ("num_edges", np.int64, (MAX_FINGERS,)),
        ("edges", np.float64, (MAX_FINGERS, MAX_EDGES, 3)),  # a s_x + b s_y + c >= 0 on the face
        ("discs", np.float64, (MAX_FINGERS, 3)),  # round faces: centre, radius; else 0
        ("num_rims", np.int64, (MAX_FINGERS,)),
        ("rims", RIM, (MAX_FINGERS, MAX_PATCHES)),  # edges of the patches on its face
        ("eccentricities", np.float64, (MAX_FINGERS,)),  # e of soft fingertips, 0 if hard [m]
        ("joint_damping", np.float64, (MAX_FINGERS,)),  # of the plant alone [N m s, N s/m]
        ("joint_friction", np.float64, (MAX_FINGERS,)),  # of the plant alone [N m, N]
        ("joints_rub", np.int64),  # 1 if any value above is nonzero
        ("gravity", np.float64),  # [m/s^2]
    ],
    align=True,
)

# Masses and friction: one set has the true values, another the controller's estimates.
TRUTH = np.dtype(
    [
        ("num_fingers", np.int64),
        ("link_masses", np.float64, (MAX_FINGERS, MAX_LINKS)),  # of slides the first [kg]
        ("object_mass", np.float64),  # [kg]
        ("inertias", np.float64, (3,)),  # about the body axes [kg m^2]
        ("friction", np.float64, (MAX_FINGERS,)),
        ("static_friction", np.float64, (MAX_FINGERS,)),  # in stick; not available to laws
    ],
    align=True,
)

LAW = law_layout(
    facts_layout(SPATIAL),
    MAX_COORDINATES,
    [
        ("grasp_force", np.int64),  # 1: smallest inside the cones, 0: none
        ("holds", np.int64),  # 1: keep every contact inside its cone, slipping or not
        ("softens", np.int64),  # 1: no wrench components that need huge forces
    ],
)

IMPLICIT = 3  # rank of the method for creeping slips

# Constants of one segment of a run.
MODEL = np.dtype(
    [
        ("num_fingers", np.int64),  # n
        ("ways", np.int64),  # slip modes of a contact: 1 on the cone, 2 in the pyramid
        ("soft", np.int64),  # 1 if any fingertip resists turning on the object
        ("num_unknowns", np.int64),  # p
        ("num_states", np.int64),  # of the integrated state
        ("num_diagnostics", np.int64),
        ("hand", HAND),
        ("truth", TRUTH),
        ("load", np.float64, (6,)),  # force and moment of pulses [N, N m]
        ("attitude", np.float64, (4,)),  # initial, the reference of the desired rotation
        ("unknowns", UNKNOWNS),  # for an inertia, the link is its axis
        ("law", LAW),
        ("motion", MOTION),
        ("sensors", SENSORS),
        ("actuators", ACTUATORS),
        ("numerics", NUMERICS),
        ("num_methods", np.int64),
        ("methods", METHOD, (IMPLICIT + 1,)),  # in ascending order, then the implicit one
    ],
    align=True,
)


class Rim(NamedTuple):
    """Edge of a patch, and the side of it on which a fingertip is.

    Attributes:
        centre: Centre of the patch in coordinates of the slip [m].
        radius: Radius of the patch [m].
        side: 1 inside, -1 outside.
    """

    centre: tuple[float, float]
    radius: float
    side: float


class Surface(NamedTuple):
    """Surface under a fingertip.

    Attributes:
        factor: Factor of the friction coefficient.
        rims: Edges of all patches on the face.
    """

    factor: float
    rims: tuple[Rim, ...]


@compiled_apart(types.float64, types.float64, types.float64)
def spatial_power(base: float, exponent: float) -> float:
    """Power of a positive number."""
    return exp(exponent * log(base))


@compiled_apart(types.float64, types.float64, types.float64)
def spatial_lag_share(bandwidth: float, period: float) -> float:
    """Fraction of the distance to its target that a first-order lag covers in a period."""
    return lag_share(bandwidth, period)


def pack_model(
    scenario: SpatialScenario, load: list[float], surfaces: Sequence[Surface] = ()
) -> Record:
    """Constants of a segment.

    Args:
        scenario: Scenario during the segment.
        load: Force and moment of the active pulses, six numbers [N, N m].
        surfaces: Surface under each fingertip; faces without patches if empty.
    """
    model = make_record(MODEL)
    n, p = len(scenario.fingers), len(scenario.estimates)
    model.num_fingers = model.hand.num_fingers = model.truth.num_fingers = n
    model.ways = 2 if scenario.friction_cone == "pyramid" else 1
    model.num_unknowns = model.unknowns.count = p
    eccentricities = [finger.eccentricity for finger in scenario.fingers]
    model.hand.eccentricities[:n] = eccentricities
    model.soft = int(any(eccentricities))
    model.num_states = count_states(n, soft=bool(model.soft))
    model.hand.gravity = scenario.simulation.gravity
    model.load[:] = load
    start = scenario.trajectory.start[3:]
    length = math.sqrt(sum(part * part for part in start))
    model.attitude[:] = [part / length for part in start]
    model.truth.object_mass = scenario.object.mass
    model.truth.inertias[:] = scenario.object.inertias
    for i in range(n):
        _pack_finger(scenario, i, model)
    for i, surface in enumerate(surfaces):
        _pack_surface(surface, i, model)
    _pack_unknowns(scenario, model.unknowns)
    _pack_law(scenario, model)
    _pack_sensors(scenario, model)
    _pack_limits(scenario, model)
    _pack_numerics(scenario, model)
    pack_motion(scenario.trajectory, model.motion)
    return model


def _pack_finger(scenario: SpatialScenario, i: int, model: Record) -> None:
    finger, hand, truth = scenario.fingers[i], model.hand, model.truth
    if finger.kind == "slides":
        hand.kinds[i], truth.link_masses[i, 0] = ON_SLIDES, finger.mass
    elif finger.kind == "chain":
        hand.kinds[i], hand.has_chains = BY_CHAIN, 1
        pack_chain(finger, hand.chains[i], truth.link_masses[i])
        hand.has_limits |= int(has_limits(finger.joints))
    else:
        _pack_links(finger, i, hand, truth)
    hand.joint_damping[i], hand.joint_friction[i] = finger.joint_damping, finger.joint_friction
    hand.joints_rub |= int(finger.joint_damping + finger.joint_friction > 0.0)
    hand.bases[i] = finger.base
    _pack_face(scenario.object, finger, i, model)
    truth.friction[i] = finger.friction
    static = finger.static_friction
    truth.static_friction[i] = finger.friction if static is None else static


def _pack_face(body: SpatialObject, finger: SpatialFinger, i: int, model: Record) -> None:
    hand, contact = model.hand, spatial_contact(body, finger)
    is_curved = any(contact.curvatures)
    if has_disc(body, finger):
        x, y = finger.contact_offset
        hand.discs[i] = -x, -y, body.radius
    else:
        edges = edges_of(contact.outline)
        hand.num_edges[i] = len(edges)
        hand.edges[i, : len(edges)] = edges
    if is_curved:
        contact = spatial_contact(body, replace(finger, contact_offset=(0.0, 0.0)))
        hand.curved_faces[i], hand.radii[i] = _CURVED_FACES[body.shape], body.radius
    hand.anchors[i] = contact.anchor
    hand.frames[i] = contact.tangent_x, contact.tangent_y, contact.normal
    if is_curved:
        # By functions of the kernel, which have the same bits on every machine.
        call(spatial_start_on_face, model, i, *finger.contact_offset)


@compiled_apart(types.void, MODEL, types.int64, types.float64, types.float64)
def spatial_start_on_face(model: Record, i: int, first: float, second: float) -> None:
    """Moves the anchor of contact ``i`` along an arc of its curved face."""
    hand = model.hand
    face, radius = hand.curved_faces[i], hand.radii[i]
    start_on_face(face, radius, first, second, hand.frames[i], hand.anchors[i])


def _pack_links(finger: SpatialFinger, i: int, hand: Record, truth: Record) -> None:
    for link in range(2):
        length, fraction = finger.link_lengths[link], finger.link_centre_fractions[link]
        own = finger.link_inertia_fractions[link]
        hand.link_lengths[i, link] = length
        hand.link_centres[i, link] = fraction * length
        hand.own_moments[i, link] = own * (length * length)
        hand.link_moments[i, link] = (fraction * fraction + own) * (length * length)
        truth.link_masses[i, link] = finger.link_masses[link]
    hand.elbows[i] = -1.0 if finger.elbow == "up" else 1.0
    hand.least_radii[i] = 1e-3 * (finger.link_lengths[0] + finger.link_lengths[1])


def _pack_surface(surface: Surface, i: int, model: Record) -> None:
    model.truth.friction[i] *= surface.factor
    model.truth.static_friction[i] *= surface.factor
    model.hand.num_rims[i] = len(surface.rims)
    for k, rim in enumerate(surface.rims):
        packed = model.hand.rims[i, k]
        packed.centre[:], packed.radius, packed.side = rim.centre, rim.radius, rim.side


def _pack_unknowns(scenario: SpatialScenario, unknowns: Record) -> None:
    for k, estimate in enumerate(scenario.estimates):
        unknown = parse_unknown(scenario, estimate.parameter)
        assert unknown is not None, "validated scenarios name only what can be estimated"
        unknowns.kinds[k] = _KINDS[unknown.kind]
        unknowns.fingers[k], unknowns.links[k] = unknown.finger, unknown.link
        unknowns.minimum[k] = -np.inf if estimate.minimum is None else estimate.minimum
        unknowns.maximum[k] = np.inf if estimate.maximum is None else estimate.maximum


def _pack_law(scenario: SpatialScenario, model: Record) -> None:
    controller, law, n = scenario.controller, model.law, model.num_fingers
    law.facts = _FACTS[law_number(controller.kind)]
    law.period = controller.control_period
    size = number_of_coordinates(int(n))
    law.position_gains[:6] = controller.position_gain
    law.position_gains[6:size] = controller.slip_position_gain
    law.velocity_gains[:size] = controller.velocity_gain
    weights = np.broadcast_to(np.asarray(controller.lyapunov_weight), (size,))
    rows = controller.lyapunov_matrix or np.diag(np.tile(weights, 2))
    law.couples = bool(controller.lyapunov_matrix)
    matrix = make_record(_MATRIX)
    matrix.entries[: 2 * size, : 2 * size] = rows
    call(spatial_weights, model, matrix)
    law.grasp_force = int(controller.grasp_force == "minimum")
    law.holds = int(controller.distribution == "hold")
    law.softens = int(controller.distribution == "softened")
    law.link_mass_ratio = controller.link_mass_ratio
    law.grip_safety = controller.grip_safety
    law.minimum_normal_force = controller.minimum_normal_force
    most = controller.maximum_normal_force
    law.maximum_normal_force = np.inf if most is None else most
    law.grip_force, law.grip_rate = controller.grip_force, controller.grip_rate
    law.jaw_stiffness, law.jaw_damping = controller.jaw_stiffness, controller.jaw_damping
    law.force_rate = controller.force_rate
    law.force_share = call(spatial_lag_share, controller.force_bandwidth, law.period)
    law.predicts = controller.prediction > 0.0 and controller.latency > 0.0
    law.estimate_norm_bound = controller.estimate_norm_bound
    law.latency = controller.latency
    _pack_learning(controller, model)


@compiled_apart(types.void, MODEL, _MATRIX)
def spatial_weights(model: Record, matrix: Record) -> None:
    """Packs P of Eq. 25 for the matrix Q ``(12 + 4n, 12 + 4n)``."""
    law, q, size = model.law, matrix.entries, count_coordinates(model.num_fingers)
    for j in range(size):
        pack_lyapunov(law, j, q[j, j], q[j, size + j], q[size + j, size + j])
        for k in range(size):
            if k != j:
                pack_coupling(
                    law,
                    size,
                    j,
                    k,
                    q[j, k],
                    q[j, size + k],
                    q[size + j, k],
                    q[size + j, size + k],
                )


def _pack_learning(controller: SpatialController, model: Record) -> None:
    law, unknowns = model.law, model.unknowns
    has_memory = bool(law.facts.has_memory)
    law.slip_stop = controller.slip_stop if has_memory else 0.0
    law.probing = controller.probing
    spans = controller.control_period / FORGETTING_TIME
    law.forgetting = call(spatial_power, controller.forgetting, spans)
    law.force_variance = controller.force_noise * controller.force_noise
    gains = np.broadcast_to(np.asarray(controller.adaptation_gain), (unknowns.count,))
    law.adaptation_gains[: unknowns.count] = gains
    given = controller.initial_deviation
    for k in range(unknowns.count):
        usual = INERTIA_DEVIATION if unknowns.kinds[k] == OBJECT_INERTIA else DEVIATION
        deviation = given[k] if isinstance(given, tuple) else usual if given is None else given
        law.prior_variances[k] = deviation * deviation


def _pack_sensors(scenario: SpatialScenario, model: Record) -> None:
    """Packs the sensors, and the settings of the law that depend on them."""
    sensing, controller, sensors = scenario.sensing, scenario.controller, model.sensors
    for name in (
        "position_noise",
        "velocity_noise",
        "acceleration_noise",
        "true_accelerations",
        "true_phases",
        "slip_threshold",
        "slip_delay",
        "slip_delay_deviation",
        "force_noise",
        "force_bias",
        "force_filter_time",
    ):
        sensors[name] = getattr(sensing, name)
    noise = sensing.position_noise + sensing.velocity_noise + sensing.acceleration_noise
    sensors.noisy = int(noise > 0.0)
    sensors.perfect = int(sensing.true_accelerations and sensing.true_phases and noise == 0.0)
    sensors.seed = scenario.simulation.seed
    sensors.filter_time = sensing.acceleration_filter_time
    sensors.sums_slip = int(sensing.slip_detector == "cumulative-sum")
    expected = controller.velocity_noise * controller.velocity_noise
    if sensing.slip_threshold > 0.0:
        sensors.least_sum = 20.0 * expected / sensing.slip_threshold
    model.law.slip_level = -np.inf if sensing.true_phases else 0.5 * sensing.slip_threshold
    if model.law.facts.has_memory and not sensing.true_accelerations:
        # Variance of filtered differences of white noise (docs/model.md).
        whole = sensing.acceleration_filter_time + controller.control_period
        share = controller.control_period / whole
        variance = 2.0 * expected / (whole * whole * (2.0 - share))
        model.law.acceleration_variance = variance


def _pack_limits(scenario: SpatialScenario, model: Record) -> None:
    """Packs the actuator limits."""
    for name in ACTUATORS.names or ():
        limit = getattr(scenario.actuation, name)
        model.actuators[name] = np.inf if limit is None else limit
    for k, (_, limit) in enumerate(scenario.torque_limits):
        model.hand.torque_limits[divmod(k, 3)] = np.inf if limit is None else limit


def _pack_numerics(scenario: SpatialScenario, model: Record) -> None:
    simulation, numerics = scenario.simulation, model.numerics
    for name in NUMERICS.names or ():
        numerics[name] = getattr(simulation, name)
    methods = (BS32, RK43, DOPRI5)
    model.num_methods = len(methods)
    for rank, method in enumerate((*methods, ROS34PW2)):
        model["methods"][rank] = method
