"""The constants of a run as the kernel reads them.

`slipgrasp.core.kernel.planar.packing` fills them in.

Arrays have one entry per finger, link, coordinate or unknown; ``n`` fingers give
``N = 3 + n`` reduced coordinates (object pose, then slip), ``p`` unknowns.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.records import MAX_COORDINATES, MAX_FINGERS
from slipgrasp.core.kernel.loop.motion import MOTION
from slipgrasp.core.kernel.numerics.methods import MAX_METHODS, METHOD
from slipgrasp.core.scenario import CONTROL_LAWS, MAX_UNKNOWNS
from slipgrasp.core.scenario.laws import facts_read_for
from slipgrasp.core.scenario.own_laws import OUTSIDE, law_of
from slipgrasp.core.scenario.space import PLANAR

OBJECT_MASS, OBJECT_INERTIA, FRICTION, LINK_MASS = range(4)

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
        ("joint_damping", np.float64, (MAX_FINGERS,)),  # of the plant alone [N m s]
        ("joint_friction", np.float64, (MAX_FINGERS,)),  # of the plant alone [N m]
        ("joints_rub", np.bool_),  # whether any of these is not 0
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


def facts_layout(hand: str) -> np.dtype:
    """What is true of a control law, for the kernel of a kind of hands."""
    return np.dtype([(fact, np.bool_) for fact in facts_read_for(hand)], align=True)


def facts_table(hand: str) -> np.ndarray:
    """What is true of every law by its number; those of one's own are the last."""
    laws, facts = (*CONTROL_LAWS.values(), law_of(OUTSIDE)), facts_read_for(hand)
    rows = [tuple(getattr(law, fact) for fact in facts) for law in laws]
    return np.array(rows, facts_layout(hand))


FACTS = facts_layout(PLANAR)

# Gains and settings of the control law (Theorems 3 and 4).
LAW = np.dtype(
    [
        ("num_fingers", np.int64),
        ("facts", FACTS),
        ("period", np.float64),  # [s], 0 = continuous
        ("recognition_time", np.float64),  # [s]
        ("position_gains", np.float64, (MAX_COORDINATES,)),  # K_p
        ("velocity_gains", np.float64, (MAX_COORDINATES,)),  # K_v
        ("adaptation_gains", np.float64, (MAX_UNKNOWNS,)),  # Gamma
        ("lyapunov_11", np.float64, (MAX_COORDINATES,)),  # diagonal blocks of P, Eq. 25
        ("lyapunov_12", np.float64, (MAX_COORDINATES,)),
        ("lyapunov_22", np.float64, (MAX_COORDINATES,)),
        ("couples", np.bool_),  # whether P has entries between different coordinates
        ("grasp_force", np.bool_),
        ("holds", np.bool_),  # every contact inside its cone, slipping or not
        ("link_mass_ratio", np.float64),  # of the masses believed, over the true ones
        ("knows_lengths", np.bool_),  # whether its links are those of the plant
        ("grip_safety", np.float64),
        ("minimum_normal_force", np.float64),  # [N]
        ("maximum_normal_force", np.float64),  # inf where none [N]
        ("torque_limit", np.float64),  # inf where none [N m]
        ("estimate_norm_bound", np.float64),  # phi_0
        ("latency", np.float64),  # [s]
        ("predicts", np.bool_),  # commands for the state when the torque acts
        ("grip_force", np.float64),  # [N]
        ("grip_rate", np.float64),  # [N/s]
        ("slip_stop", np.float64),  # K_f [m/s^2]
        ("forgetting", np.float64),  # per control period
        ("probing", np.float64),  # [1/s]
        ("force_variance", np.float64),  # [N^2]
        ("acceleration_variance", np.float64),  # expected of filtered differences [m^2/s^4]
        ("slip_level", np.float64),  # measured speed above which slip is sure; -inf: told [m/s]
        ("prior_variances", np.float64, (MAX_UNKNOWNS,)),
        ("couplings", np.float64, (2 * MAX_COORDINATES, 2 * MAX_COORDINATES)),  # by e, then e'
    ],
    align=True,
)

# What is measured, and how well.
SENSORS = np.dtype(
    [
        ("perfect", np.int64),  # 1: everything below is off, and the law knows its lengths
        ("noisy", np.int64),
        ("seed", np.int64),  # of the noise
        ("position_noise", np.float64),  # standard deviations, SI units
        ("velocity_noise", np.float64),
        ("acceleration_noise", np.float64),
        ("true_accelerations", np.int64),
        ("filter_time", np.float64),  # [s]
        ("true_phases", np.int64),
        ("sums_slip", np.int64),  # 1: cumulative sums detect it, 0: its duration
        ("slip_threshold", np.float64),  # [m/s]
        ("slip_delay", np.float64),  # [s]
        ("slip_delay_deviation", np.float64),  # [s]
        ("least_sum", np.float64),  # that noise does not reach [m/s]
        ("force_noise", np.float64),  # of measured contact forces [N]
        ("force_bias", np.float64, (2,)),  # along the face, normal [N]
        ("force_filter_time", np.float64),  # [s]
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
        ("num_diagnostics", np.int64),  # of a law of one's own
        ("hand", HAND),
        ("nominal", HAND),  # of which the law believes the links to be: lengths alone are set
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
