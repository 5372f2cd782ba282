"""Constants of a run that are common to planar and spatial hands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Layout, Record
from slipgrasp.core.scenario import CONTROL_LAWS, MAX_UNKNOWNS
from slipgrasp.core.scenario.custom_laws import OUTSIDE, law_of
from slipgrasp.core.scenario.laws import facts_read_for
from slipgrasp.core.scenario.space import Space

OBJECT_MASS, OBJECT_INERTIA, FRICTION, LINK_MASS = range(4)

# Estimated entries of TRUTH, and the bounds of the estimates.
UNKNOWNS = np.dtype(
    [
        ("count", np.int64),
        ("kinds", np.int64, (MAX_UNKNOWNS,)),
        ("fingers", np.int64, (MAX_UNKNOWNS,)),  # -1 if none
        ("links", np.int64, (MAX_UNKNOWNS,)),  # -1 if none
        ("minimum", np.float64, (MAX_UNKNOWNS,)),  # -inf if none
        ("maximum", np.float64, (MAX_UNKNOWNS,)),  # inf if none
    ],
    align=True,
)


def make_true_value(object_value: Any) -> Any:
    """Creates the function that returns the true value of an unknown.

    Args:
        object_value: Returns the mass or the inertia of the object that an unknown estimates.
    """

    @compiled
    def true_value(truth: Record, unknowns: Record, k: int) -> float:
        """True value of unknown ``k``."""
        kind, finger = unknowns.kinds[k], unknowns.fingers[k]
        if kind == FRICTION:
            return truth.friction[finger]
        if kind == LINK_MASS:
            return truth.link_masses[finger, unknowns.links[k]]
        return object_value(truth, unknowns, k)

    return true_value


def facts_layout(space: Space) -> np.dtype:
    """Facts of a control law for the kernel of a kind of hand."""
    return np.dtype([(fact, np.bool_) for fact in facts_read_for(space)], align=True)


def facts_table(space: Space) -> np.ndarray:
    """Facts of every law by its index; custom laws are last."""
    laws, facts = (*CONTROL_LAWS.values(), law_of(OUTSIDE)), facts_read_for(space)
    rows = [tuple(getattr(law, fact) for fact in facts) for law in laws]
    return np.array(rows, facts_layout(space))


def law_layout(facts: Layout, num_coordinates: int, more: Sequence[tuple[Any, ...]]) -> Layout:
    """Gains and settings of the control law.

    Args:
        facts: Layout of the facts of the law.
        num_coordinates: Number of reduced coordinates of the largest hand.
        more: Additional fields for this kind of hand.
    """
    each, both = (num_coordinates,), (2 * num_coordinates, 2 * num_coordinates)
    fields = [
        ("facts", facts),
        ("period", np.float64),  # [s], 0 = continuous
        ("position_gains", np.float64, each),  # K_p
        ("velocity_gains", np.float64, each),  # K_v
        ("adaptation_gains", np.float64, (MAX_UNKNOWNS,)),  # Gamma
        ("lyapunov_11", np.float64, each),  # diagonal blocks of P, Eq. 25
        ("lyapunov_12", np.float64, each),
        ("lyapunov_22", np.float64, each),
        ("couples", np.bool_),  # whether P has entries between different coordinates
        ("link_mass_ratio", np.float64),  # ratio of assumed to true masses
        ("grip_safety", np.float64),
        ("minimum_normal_force", np.float64),  # [N]
        ("maximum_normal_force", np.float64),  # inf if none [N]
        ("grip_force", np.float64),  # [N]
        ("grip_rate", np.float64),  # [N/s]
        ("jaw_stiffness", np.float64),  # [N/m]
        ("jaw_damping", np.float64),  # [N s/m]
        ("force_rate", np.float64),  # [N/s]
        ("force_share", np.float64),  # filter coefficient of the force lag per period
        ("estimate_norm_bound", np.float64),  # phi_0
        ("slip_stop", np.float64),  # K_f [m/s^2]
        ("probing", np.float64),  # [1/s]
        ("predicts", np.bool_),  # commands for the state predicted for the time of action
        ("latency", np.float64),  # [s]
        ("forgetting", np.float64),  # per control period
        ("force_variance", np.float64),  # [N^2]
        ("acceleration_variance", np.float64),  # assumed, of filtered differences [m^2/s^4]
        ("slip_level", np.float64),  # above which slip is certain; -inf: known phases [m/s]
        ("prior_variances", np.float64, (MAX_UNKNOWNS,)),
        *more,
        ("couplings", np.float64, both),  # by e, then e'
    ]
    return np.dtype(fields, align=True)


# Measurements and their accuracy.
SENSORS = np.dtype(
    [
        ("perfect", np.int64),  # 1: perfect measurements and known link lengths
        ("noisy", np.int64),
        ("seed", np.int64),  # of the noise
        ("position_noise", np.float64),  # standard deviations, SI units
        ("velocity_noise", np.float64),
        ("acceleration_noise", np.float64),
        ("true_accelerations", np.int64),
        ("filter_time", np.float64),  # [s]
        ("true_phases", np.int64),
        ("sums_slip", np.int64),  # 1: detection by cumulative sums, 0: by duration
        ("slip_threshold", np.float64),  # [m/s]
        ("slip_delay", np.float64),  # [s]
        ("slip_delay_deviation", np.float64),  # [s]
        ("least_sum", np.float64),  # lower bound of the detection limit, above noise [m/s]
        ("force_noise", np.float64),  # of measured contact forces [N]
        ("force_bias", np.float64, (2,)),  # along the face, normal [N]
        ("force_filter_time", np.float64),  # [s]
    ],
    align=True,
)

# Limits of the joint torques.
ACTUATORS = np.dtype(
    [
        ("torque_limit", np.float64),  # inf if none [N m]
        ("torque_rate_limit", np.float64),  # inf if none [N m/s]
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
