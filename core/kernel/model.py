"""The constants of a run as the kernel reads them, packed from a scenario.

Arrays have one entry per finger, link, coordinate or unknown; ``n`` fingers give
``N = 3 + n`` reduced coordinates (object pose, then slip), ``p`` unknowns.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from slipgrasp.core.kernel.dop853 import DOP853
from slipgrasp.core.kernel.methods import BS32, DOPRI5, MAX_METHODS, METHOD, RK43
from slipgrasp.core.kernel.motion import MOTION, pack_motion
from slipgrasp.core.kernel.records import MAX_COORDINATES, MAX_FINGERS, Floats, Record, make_record
from slipgrasp.core.kernel.state import count_states
from slipgrasp.core.scenario import (
    CONTROL_LAWS,
    LAW_FACTS,
    MAX_UNKNOWNS,
    ControllerParameters,
    Scenario,
)
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.scenario.parameters import kinds_using
from slipgrasp.core.scenario.unknowns import parse_unknown

OBJECT_MASS, OBJECT_INERTIA, FRICTION, LINK_MASS = range(4)
FORGETTING_TIME = 1e-3
# Methods of sampled and of continuous control, in rising order.
SHORT_STEPS, LONG_STEPS = (BS32, RK43, DOPRI5), (DOP853,)
_UNKNOWN_KINDS = {
    "object_mass": OBJECT_MASS,
    "object_inertia": OBJECT_INERTIA,
    "friction": FRICTION,
    "link_mass": LINK_MASS,
}

# Geometry of fingers and contacts.
HAND = np.dtype(
    [
        ("num_fingers", np.int64),
        ("link_lengths", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("link_centres", np.float64, (MAX_FINGERS, 2)),  # from the proximal joint [m]
        ("link_moments", np.float64, (MAX_FINGERS, 2)),  # inertia per mass about that joint [m^2]
        ("bases", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("elbows", np.float64, (MAX_FINGERS,)),  # sign of sin q2
        ("anchors", np.float64, (MAX_FINGERS, 2)),  # object frame [m]
        ("tangents", np.float64, (MAX_FINGERS, 2)),  # object frame
        ("slip_minimum", np.float64, (MAX_FINGERS,)),  # ends of the face, or of the part of it
        ("slip_maximum", np.float64, (MAX_FINGERS,)),  # along which friction is the same [m]
        ("gravity", np.float64),  # [m/s^2]
    ],
    align=True,
)

# Masses and friction; one such set is true, another is what the controller believes.
TRUTH = np.dtype(
    [
        ("num_fingers", np.int64),
        ("link_masses", np.float64, (MAX_FINGERS, 2)),  # [kg]
        ("object_inertia", np.float64, (3,)),  # m, m, I [kg, kg, kg m^2]
        ("friction", np.float64, (MAX_FINGERS,)),  # while the fingertip slips
        ("static_friction", np.float64, (MAX_FINGERS,)),  # while it sticks; no law knows it
    ],
    align=True,
)

# Which entries of TRUTH the controller estimates, and the bounds of its estimates.
UNKNOWNS = np.dtype(
    [
        ("count", np.int64),
        ("kinds", np.int64, (MAX_UNKNOWNS,)),
        ("fingers", np.int64, (MAX_UNKNOWNS,)),  # -1 where none
        ("links", np.int64, (MAX_UNKNOWNS,)),  # -1 where none
        ("minimum", np.float64, (MAX_UNKNOWNS,)),  # -inf where none
        ("maximum", np.float64, (MAX_UNKNOWNS,)),  # inf where none
    ],
    align=True,
)

# Gains and settings of the control law (Theorems 3 and 4).
LAW = np.dtype(
    [
        ("num_fingers", np.int64),
        *((fact, np.bool_) for fact in LAW_FACTS),
        ("period", np.float64),  # [s], 0 = continuous
        ("recognition_time", np.float64),  # [s]
        ("position_gains", np.float64, (MAX_COORDINATES,)),  # K_p
        ("velocity_gains", np.float64, (MAX_COORDINATES,)),  # K_v
        ("adaptation_gains", np.float64, (MAX_UNKNOWNS,)),  # Gamma
        ("lyapunov_11", np.float64, (MAX_COORDINATES,)),  # diagonal blocks of P, Eq. 25
        ("lyapunov_12", np.float64, (MAX_COORDINATES,)),
        ("lyapunov_22", np.float64, (MAX_COORDINATES,)),
        ("grasp_force", np.bool_),
        ("grip_safety", np.float64),
        ("minimum_normal_force", np.float64),  # [N]
        ("maximum_normal_force", np.float64),  # inf where none [N]
        ("torque_limit", np.float64),  # inf where none [N m]
        ("estimate_norm_bound", np.float64),  # phi_0
        ("latency", np.float64),  # [s]
        ("grip_force", np.float64),  # [N]
        ("grip_rate", np.float64),  # [N/s]
        ("slip_stop", np.float64),  # K_f [m/s^2]
        ("forgetting", np.float64),  # per control period
        ("probing", np.float64),  # [1/s]
        ("force_variance", np.float64),  # [N^2]
        ("prior_variances", np.float64, (MAX_UNKNOWNS,)),
    ],
    align=True,
)

# What is measured, and how well.
SENSORS = np.dtype(
    [
        ("perfect", np.int64),  # 1: everything below is off
        ("noisy", np.int64),
        ("position_noise", np.float64),  # standard deviations, SI units
        ("velocity_noise", np.float64),
        ("acceleration_noise", np.float64),
        ("true_accelerations", np.int64),
        ("filter_time", np.float64),  # [s]
        ("true_phases", np.int64),
        ("slip_threshold", np.float64),  # [m/s]
        ("slip_delay", np.float64),  # [s]
    ],
    align=True,
)

# What the joints can give.
ACTUATORS = np.dtype(
    [
        ("torque_limit", np.float64),  # inf where none [N m]
        ("torque_rate_limit", np.float64),  # inf where none [N m/s]
    ],
    align=True,
)

# Accuracy and limits of the integration.
NUMERICS = np.dtype(
    [
        ("relative_tolerance", np.float64),
        ("absolute_tolerance", np.float64),
        ("max_step", np.float64),  # [s]
        ("max_steps", np.int64),
        ("output_rate", np.float64),  # [Hz]
        ("chatter_changes", np.int64),
        ("chatter_window", np.float64),  # [s]
    ],
    align=True,
)

# Everything constant over one stretch of a run.
MODEL = np.dtype(
    [
        ("num_fingers", np.int64),  # n
        ("num_unknowns", np.int64),  # p
        ("num_states", np.int64),  # of the integrated state
        ("hand", HAND),
        ("truth", TRUTH),
        ("load", np.float64, (3,)),  # of pulses on the object [N, N, N m]
        ("unknowns", UNKNOWNS),
        ("law", LAW),
        ("motion", MOTION),
        ("sensors", SENSORS),
        ("actuators", ACTUATORS),
        ("numerics", NUMERICS),
        ("num_methods", np.int64),
        ("methods", METHOD, (MAX_METHODS,)),  # in rising order
    ],
    align=True,
)


def pack_model(scenario: Scenario) -> Record:
    """Packs a validated scenario for the kernel."""
    n, p = len(scenario.fingers), len(scenario.estimates)
    record = make_record(MODEL)
    model = record.view(MODEL)
    model["num_fingers"], model["num_unknowns"], model["num_states"] = n, p, count_states(n, p)
    _pack_hand(scenario, n, model["hand"])
    _pack_truth(scenario, n, model["truth"])
    _pack_unknowns(scenario, p, model["unknowns"])
    _pack_law(scenario.controller, n, p, model["law"])
    _pack_learning(scenario, p, model["law"])
    _pack_sensors(scenario, model["sensors"])
    _pack_actuators(scenario, model["actuators"])
    _pack_limits(scenario, model["law"])
    pack_motion(scenario.trajectory, model["motion"])
    simulation, numerics = scenario.simulation, model["numerics"]
    for name in NUMERICS.names or ():
        numerics[name] = getattr(simulation, name)
    methods = SHORT_STEPS if scenario.controller.control_period > 0.0 else LONG_STEPS
    model["num_methods"] = len(methods)
    for rank, method in enumerate(methods):
        model["methods"][rank] = method
    return record


def _pack_hand(scenario: Scenario, n: int, hand: np.void) -> None:
    fingers = scenario.fingers
    frames = [contact_frame(scenario.object, finger) for finger in fingers]
    lengths = np.array([finger.link_lengths for finger in fingers])
    centres = np.array([finger.link_centre_fractions for finger in fingers])
    inertias = np.array([finger.link_inertia_fractions for finger in fingers])
    hand["num_fingers"] = n
    hand["gravity"] = scenario.simulation.gravity
    hand["link_lengths"][:n] = lengths
    hand["link_centres"][:n] = centres * lengths
    hand["link_moments"][:n] = (centres**2 + inertias) * lengths**2
    hand["bases"][:n] = [finger.base for finger in fingers]
    hand["elbows"][:n] = [-1.0 if finger.elbow == "up" else 1.0 for finger in fingers]
    hand["anchors"][:n] = [frame.anchor for frame in frames]
    hand["tangents"][:n] = [frame.tangent for frame in frames]
    hand["slip_minimum"][:n] = [frame.slip_minimum for frame in frames]
    hand["slip_maximum"][:n] = [frame.slip_maximum for frame in frames]


def _pack_truth(scenario: Scenario, n: int, truth: np.void) -> None:
    body = scenario.object
    truth["num_fingers"] = n
    truth["object_inertia"] = body.mass, body.mass, body.inertia
    truth["link_masses"][:n] = [finger.link_masses for finger in scenario.fingers]
    truth["friction"][:n] = [finger.friction for finger in scenario.fingers]
    truth["static_friction"][:n] = [
        finger.friction if finger.static_friction is None else finger.static_friction
        for finger in scenario.fingers
    ]


def _pack_unknowns(scenario: Scenario, p: int, unknowns: np.void) -> None:
    unknowns["count"] = p
    for k, estimate in enumerate(scenario.estimates):
        unknown = parse_unknown(scenario, estimate.parameter)
        assert unknown is not None, "validated scenarios name only what can be estimated"
        unknowns["kinds"][k] = _UNKNOWN_KINDS[unknown.kind]
        unknowns["fingers"][k] = unknown.finger
        unknowns["links"][k] = unknown.link
        unknowns["minimum"][k] = -np.inf if estimate.minimum is None else estimate.minimum
        unknowns["maximum"][k] = np.inf if estimate.maximum is None else estimate.maximum


def _pack_law(controller: ControllerParameters, n: int, p: int, law: np.void) -> None:
    size = 3 + n
    law["num_fingers"] = n
    for fact in LAW_FACTS:
        law[fact] = getattr(CONTROL_LAWS[controller.kind], fact)
    law["period"] = controller.control_period
    law["recognition_time"] = controller.recognition_time
    law["position_gains"][:3] = controller.position_gain
    law["velocity_gains"][:size] = controller.velocity_gain
    law["adaptation_gains"][:p] = controller.adaptation_gain
    weights = np.broadcast_to(np.asarray(controller.lyapunov_weight, float), (size,))
    blocks = solve_lyapunov(law["position_gains"][:size], law["velocity_gains"][:size], weights)
    for name, block in zip(("lyapunov_11", "lyapunov_12", "lyapunov_22"), blocks, strict=True):
        law[name][:size] = block
    law["grasp_force"] = controller.grasp_force == "minimum"
    law["grip_safety"] = controller.grip_safety
    law["estimate_norm_bound"] = controller.estimate_norm_bound
    law["latency"] = controller.latency
    law["grip_force"], law["grip_rate"] = controller.grip_force, controller.grip_rate


def _pack_learning(scenario: Scenario, p: int, law: np.void) -> None:
    controller = scenario.controller
    brakes = controller.kind in kinds_using(ControllerParameters, "slip_stop")
    law["slip_stop"] = controller.slip_stop if brakes else 0.0
    law["forgetting"] = controller.forgetting ** (controller.control_period / FORGETTING_TIME)
    law["probing"] = controller.probing
    law["force_variance"] = controller.force_noise**2
    deviations: Any = controller.initial_deviation
    if deviations is None:
        keys = [estimate.parameter for estimate in scenario.estimates]
        deviations = [0.1 if key == "object.inertia" else 3.0 for key in keys]
    law["prior_variances"][:p] = np.square(deviations)


def _pack_limits(scenario: Scenario, law: np.void) -> None:
    controller, torque_limit = scenario.controller, scenario.actuation.torque_limit
    largest = controller.maximum_normal_force
    law["minimum_normal_force"] = controller.minimum_normal_force
    law["maximum_normal_force"] = np.inf if largest is None else largest
    law["torque_limit"] = np.inf if torque_limit is None else torque_limit


def _pack_sensors(scenario: Scenario, sensors: np.void) -> None:
    """Writes what is measured, and how well."""
    sensing = scenario.sensing
    noise = sensing.position_noise, sensing.velocity_noise, sensing.acceleration_noise
    sensors["position_noise"], sensors["velocity_noise"], sensors["acceleration_noise"] = noise
    sensors["noisy"] = any(noise)
    sensors["true_accelerations"] = sensing.true_accelerations
    sensors["filter_time"] = sensing.acceleration_filter_time
    sensors["true_phases"] = sensing.true_phases
    sensors["slip_threshold"] = sensing.slip_threshold
    sensors["slip_delay"] = sensing.slip_delay
    sensors["perfect"] = sensing.true_accelerations and sensing.true_phases and not any(noise)


def _pack_actuators(scenario: Scenario, actuators: np.void) -> None:
    """Writes what the joints can give."""
    for name in ACTUATORS.names or ():
        limit = getattr(scenario.actuation, name)
        actuators[name] = np.inf if limit is None else limit


def solve_lyapunov(
    position_gains: Floats, velocity_gains: Floats, weights: Floats
) -> tuple[Floats, Floats, Floats]:
    """Blocks P_11, P_12, P_22 of Eq. 25 for diagonal gains, one entry per coordinate.

    Where K_p = 0 no P > 0 solves Eq. 25; there Q weighs only the velocity error and
    P_11 = P_12 = 0 (docs/model.md, Adaptation).
    """
    held = position_gains > 0.0
    divisor = np.where(held, position_gains, 1.0)
    p12 = np.where(held, weights / (2.0 * divisor), 0.0)
    p22 = (weights / 2.0 + p12) / velocity_gains
    p11 = np.where(held, position_gains * p22 + velocity_gains * p12, 0.0)
    return p11, p12, p22
