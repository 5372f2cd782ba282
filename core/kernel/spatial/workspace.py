"""Discrete state and intermediate values of an evaluation for spatial hands."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.records import MAX_FINGERS
from slipgrasp.core.kernel.spatial.chain import SEED
from slipgrasp.core.kernel.spatial.dynamics import TIP_DYNAMICS, UNIT_DYNAMICS
from slipgrasp.core.kernel.spatial.kinematics import KINEMATICS
from slipgrasp.core.kernel.spatial.model import MAX_COORDINATES, TRUTH
from slipgrasp.core.kernel.spatial.plant import SYSTEM
from slipgrasp.core.kernel.spatial.state import BODY_STATES
from slipgrasp.core.kernel.spatial.torsion_layout import TORSION
from slipgrasp.core.scenario import MAX_DIAGNOSTICS, MAX_UNKNOWNS

# `slipgrasp.core.trace.types.ContactPhase`; to the last, 3 and 1 times the slip signs are added.
STICK, SLIP, SLIPS_ALONG_TANGENTS = 0, 2, 7
MAX_FORCES = 3 * MAX_FINGERS
MAX_ASKED = 4 * MAX_FINGERS  # components of a command: forces, moments of soft contacts
MAX_ROWS = MAX_COORDINATES

# State that is constant between jumps.
DISCRETE = np.dtype(
    [
        ("phases", np.int64, (MAX_FINGERS,)),  # of the plant
        ("beliefs", np.int64, (MAX_FINGERS,)),  # phases the controller acts on
        ("slips", np.float64, (MAX_FINGERS, 2)),  # 1 if the contact slips along the tangent
        ("directions", np.float64, (MAX_FINGERS, 3)),  # g at slip onset; signs in the pyramid
        # Part of the velocity of a soft slip at onset that is due to creep and impulses [m/s]
        ("crept", np.float64, (MAX_FINGERS, 3)),
        ("frozen", np.int64, (MAX_FINGERS, 2)),  # per slip mode: not 0 while g is held
        ("torques", np.float64, (MAX_FINGERS, 3)),  # held [N m]
        ("commanded", np.float64, (MAX_FINGERS, 3)),  # at the last tick, before limits [N m]
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("violation", np.float64),  # of the grasp limits by the last command [N]
        ("seeds", SEED, (MAX_FINGERS,)),  # of chains, of the last tick
        ("added_grip", np.float64),  # by the grip reflex [N]
        ("closing_force", np.float64),  # of the jaws of a gripper [N]
        ("diagnostics", np.float64, (MAX_DIAGNOSTICS,)),  # of a custom law
        ("piece", np.int64),  # of the desired motion
    ],
    align=True,
)

# Intermediate values of the law.
LAW_ROOM = np.dtype(
    [
        ("error", np.float64, (MAX_COORDINATES,)),  # e
        ("error_rate", np.float64, (MAX_COORDINATES,)),
        ("demand", np.float64, (MAX_COORDINATES,)),  # v
        ("slip_demand", np.float64, (MAX_FINGERS, 2)),  # its part for slips
        ("rotation", np.float64, (3, 3)),  # A(rho), which maps rho' to omega
        ("known_time", np.float64),  # time of the errors of the object [s]; NaN if invalid
        ("known_piece", np.int64),  # segment of the desired motion then
        ("known_state", np.float64, (BODY_STATES,)),  # pose and velocity of the object then
        ("slips", np.float64, (MAX_FINGERS, 2)),  # estimated
        ("gamma", np.float64, (MAX_FINGERS, 3)),  # estimated directions, spin last
        ("own_force", np.float64, (MAX_FINGERS, 3)),  # f^ of the demand, world axes
        ("weights", np.float64, (MAX_COORDINATES,)),  # E^T P xi
        ("weighted", np.float64, (MAX_COORDINATES,)),  # r of Eq. 46
        ("bias", np.float64, (6,)),  # h_o, or an intermediate vector
        ("turn", np.float64, (3, 3)),  # desired attitude of a gripper
        ("arm", np.float64, (3,)),  # target of a jaw relative to the desired position [m]
        ("jaws", np.float64, (MAX_FINGERS, 3)),  # directions in which jaws close
    ],
    align=True,
)

# The grasp force as a program with cones: F = origin + basis . lambda.
GRASP = np.dtype(
    [
        ("rows", np.float64, (MAX_ROWS, MAX_ASKED + 1)),  # [G | d], then orthogonal
        # Length of F: three per contact and, for soft fingertips, F_tau / e of each.
        ("size", np.int64),
        ("soft", np.int64),  # 1 if any fingertip is soft
        ("fingers", np.int64),
        ("rank", np.int64),
        ("free", np.int64),  # length of lambda
        ("softens", np.int64),  # 1: weak rows of G are met approximately
        ("weak", np.int64),  # number of weak rows
        ("origin", np.float64, (MAX_ASKED,)),
        ("basis", np.float64, (MAX_ASKED, MAX_ASKED)),  # in columns
        ("ways", np.int64),  # slip modes per contact
        ("cones", np.float64, (MAX_FINGERS, 2)),  # mu / safety; negative: no bound
        ("least", np.float64),  # limits of the normal force [N]
        ("most", np.float64),
        ("force", np.float64, (MAX_ASKED,)),
        ("point", np.float64, (MAX_ASKED + 1,)),  # lambda, and the violation
        ("active", np.int64, (4 * MAX_FINGERS,)),  # 1 for active limits
        ("multipliers", np.float64, (4 * MAX_FINGERS,)),
        ("matrix", np.float64, (4 * MAX_FORCES, 4 * MAX_FORCES)),
        ("order", np.int64, (4 * MAX_FORCES,)),
        ("right", np.float64, (4 * MAX_FORCES,)),
        ("step", np.float64, (4 * MAX_FORCES,)),
        ("gradient", np.float64, (MAX_ASKED + 1,)),
        ("trial", np.float64, (MAX_ASKED + 1,)),
        ("warm", np.int64),  # 1 if the active set of a tick is available
    ],
    align=True,
)

# Intermediate values of an evaluation; those of the latest one remain available.
WORKSPACE = np.dtype(
    [
        ("kin", KINEMATICS),
        ("dynamics", TIP_DYNAMICS),
        ("system", SYSTEM),
        ("gamma", np.float64, (MAX_FINGERS, 3)),  # directions of slip, spin last
        ("tip_forces", np.float64, (MAX_FINGERS, 3)),  # u = J^-T tau, world axes
        ("available", np.float64, (MAX_FINGERS, 3)),  # force at zero acceleration, world axes
        ("acceleration", np.float64, (6,)),  # nu'
        ("slip_acceleration", np.float64, (MAX_FINGERS, 2)),  # s''
        ("spin_acceleration", np.float64, (MAX_FINGERS,)),  # e psi'' [m/s^2]
        ("forces", np.float64, (MAX_FINGERS, 3)),  # F = (F_x, F_y, F_n), contact frame
        ("moments", np.float64, (MAX_FINGERS,)),  # F_tau / e of soft fingertips [N]
        ("torsion", TORSION),
        ("column", np.float64, (6,)),
        ("unit", UNIT_DYNAMICS),
        ("believed", TRUTH),
        ("believed_dynamics", TIP_DYNAMICS),
        ("believed_system", SYSTEM),
        ("room", LAW_ROOM),
        ("grasp", GRASP),
        ("rates", np.float64, (MAX_UNKNOWNS,)),  # of the estimates
        ("at_start", np.int64),  # 1 if evaluated at the start of the next step
    ],
    align=True,
)
