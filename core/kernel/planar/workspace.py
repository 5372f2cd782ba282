"""Discrete state and intermediate values of an evaluation of the closed loop."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.records import MAX_COORDINATES, MAX_FINGERS, MAX_SIDE
from slipgrasp.core.kernel.numerics.quadratic import QUADRATIC
from slipgrasp.core.kernel.planar.dynamics import TIP_DYNAMICS, UNIT_DYNAMICS
from slipgrasp.core.kernel.planar.inertia import FACTORS
from slipgrasp.core.kernel.planar.kinematics import KINEMATICS
from slipgrasp.core.kernel.planar.model import TRUTH
from slipgrasp.core.kernel.planar.state import STATE
from slipgrasp.core.scenario import MAX_DIAGNOSTICS, MAX_UNKNOWNS

# State that is constant between jumps.
DISCRETE = np.dtype(
    [
        ("phases", np.int64, (MAX_FINGERS,)),  # of the plant
        ("beliefs", np.int64, (MAX_FINGERS,)),  # phases the controller acts on
        ("clamps", np.int64, (MAX_UNKNOWNS,)),  # -1, 1: estimate at its lower, upper bound
        ("torques", np.float64, (MAX_FINGERS, 2)),  # held by sampled control [N m]
        ("piece", np.int64),  # of the desired motion
        ("added_grip", np.float64),  # by the grip reflex [N]
        ("closing_force", np.float64),  # of the jaws of a gripper [N]
        ("commanded", np.float64, (MAX_FINGERS, 2)),  # at the last tick, before limits [N m]
        ("diagnostics", np.float64, (MAX_DIAGNOSTICS,)),  # of a custom law
    ],
    align=True,
)

# Intermediate values of the law.
LAW_ROOM = np.dtype(
    [
        ("error", np.float64, (MAX_COORDINATES,)),  # e
        ("error_rate", np.float64, (MAX_COORDINATES,)),
        ("demand", np.float64, (MAX_COORDINATES,)),  # v, the commanded acceleration
        (
            "on_cone",
            np.int64,
            (MAX_FINGERS,),
        ),  # slip direction if F^ must be on its cone, else 0
        ("believed_force", np.float64, (MAX_FINGERS, 2)),  # f^ of the demand, inertial frame
        ("contact_force", np.float64, (MAX_FINGERS, 2)),  # F^ that the torque is meant to produce
        ("basis", np.float64, (MAX_SIDE, MAX_SIDE)),  # G or its transpose, then orthonormal
        ("triangle", np.float64, (MAX_SIDE, MAX_SIDE)),
        ("right_side", np.float64, (MAX_SIDE,)),
        ("direction", np.float64, (4,)),  # internal force of two fingers
        ("weighted_error", np.float64, (MAX_COORDINATES,)),  # r of Eq. 46
        ("violation", np.float64),  # of the limits of the grasp force, 0 if all are met [N]
    ],
    align=True,
)

# Validity of the values in the workspace, to avoid repeated computations for the same state. Only
# `slipgrasp.core.kernel.planar.flow` reads and writes it.
CURRENT = np.dtype(
    [
        ("mechanics", np.int64),  # 1: kinematics and dynamics are those of ``state``
        ("state", STATE),
        ("factors", np.int64),  # 1: M~ and h~ belong to this state and ``phases``
        ("phases", np.int64, (MAX_FINGERS,)),
        ("law", np.int64),  # 1: the law's values belong to them and to the values below
        ("time", np.float64),  # [s]
        ("piece", np.int64),
        ("beliefs", np.int64, (MAX_FINGERS,)),
        ("added_grip", np.float64),  # [N]
    ],
    align=True,
)

# Intermediate values of an evaluation; those of the latest one remain available.
WORKSPACE = np.dtype(
    [
        ("current", CURRENT),
        ("kin", KINEMATICS),
        ("unit", UNIT_DYNAMICS),
        ("dynamics", TIP_DYNAMICS),
        ("believed", TRUTH),
        ("believed_dynamics", TIP_DYNAMICS),
        ("room", LAW_ROOM),
        ("inertia", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),  # M~
        ("factors", FACTORS),
        ("estimated_inertia", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),  # M~^
        ("estimated_factors", FACTORS),
        ("bias", np.float64, (MAX_COORDINATES,)),  # h~
        ("tip_forces", np.float64, (MAX_FINGERS, 2)),  # u = J^-T tau, inertial frame
        ("acceleration", np.float64, (MAX_COORDINATES,)),  # x''
        ("forces", np.float64, (MAX_FINGERS, 2)),  # F = (F_x, F_n), contact frame
        ("rates", np.float64, (MAX_UNKNOWNS,)),  # of the estimates, before projection
        ("column", np.float64, (MAX_COORDINATES,)),
        ("shares", np.float64, (3,)),  # of the object's coordinates that torques can produce
        ("quadratic", QUADRATIC),  # the grasp force as a quadratic program
    ],
    align=True,
)
