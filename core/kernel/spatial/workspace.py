"""What one evaluation in space starts from and leaves behind."""

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

# `slipgrasp.core.trace.types.ContactPhase`; to the last the signs (3, 1) of both slips are added.
STICK, SLIP, SLIPS_ALONG_TANGENTS = 0, 2, 7
MAX_FORCES = 3 * MAX_FINGERS
MAX_ASKED = 4 * MAX_FINGERS  # numbers that a law may ask for: forces, then moments of soft contacts
MAX_ROWS = MAX_COORDINATES

# What stays fixed between two jumps.
DISCRETE = np.dtype(
    [
        ("phases", np.int64, (MAX_FINGERS,)),  # of the plant
        ("beliefs", np.int64, (MAX_FINGERS,)),  # phases the controller acts on
        ("slips", np.float64, (MAX_FINGERS, 2)),  # 1 where a contact slips along a tangent
        ("directions", np.float64, (MAX_FINGERS, 3)),  # g where a slip has just begun; signs
        # Of the velocity of a soft slip that begins, what creep and impulses have made [m/s].
        ("crept", np.float64, (MAX_FINGERS, 3)),
        ("frozen", np.int64, (MAX_FINGERS, 2)),  # of a way: 1 while that is taken for that of s'
        ("torques", np.float64, (MAX_FINGERS, 3)),  # held [N m]
        ("commanded", np.float64, (MAX_FINGERS, 3)),  # at the last tick, before limits [N m]
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("violation", np.float64),  # of the estimated cones by the last command [N]
        ("seeds", SEED, (MAX_FINGERS,)),  # of chains, from the last tick
        ("added_grip", np.float64),  # what the grip reflex has added [N]
        ("closing_force", np.float64),  # of the jaws of a gripper [N]
        ("diagnostics", np.float64, (MAX_DIAGNOSTICS,)),  # of a law of one's own
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
        ("slip_demand", np.float64, (MAX_FINGERS, 2)),  # its last part
        ("rotation", np.float64, (3, 3)),  # A(rho), by which omega follows from rho'
        ("known_time", np.float64),  # of which the errors of the object are [s]; not a number: none
        ("known_piece", np.int64),  # of the desired motion then
        ("known_state", np.float64, (BODY_STATES,)),  # pose and velocity of the object then
        ("slips", np.float64, (MAX_FINGERS, 2)),  # believed
        ("gamma", np.float64, (MAX_FINGERS, 3)),  # believed directions, spin last
        ("own_force", np.float64, (MAX_FINGERS, 3)),  # f^ of the demand, world axes
        ("weights", np.float64, (MAX_COORDINATES,)),  # E^T P xi
        ("weighted", np.float64, (MAX_COORDINATES,)),  # r of Eq. 46
        ("bias", np.float64, (6,)),  # h_o, and what a vector takes meanwhile
        ("turn", np.float64, (3, 3)),  # desired attitude of a gripper
        ("arm", np.float64, (3,)),  # where a jaw belongs, from the object's desired place [m]
        ("jaws", np.float64, (MAX_FINGERS, 3)),  # directions in which jaws close
    ],
    align=True,
)

# The grasp force as a program with cones: F = origin + basis . lambda.
GRASP = np.dtype(
    [
        ("rows", np.float64, (MAX_ROWS, MAX_ASKED + 1)),  # [G | d], then orthogonal
        # Numbers in F: three per contact, and if any is soft F_tau / e of each.
        ("size", np.int64),
        ("soft", np.int64),  # 1 if any is
        ("fingers", np.int64),
        ("rank", np.int64),
        ("free", np.int64),  # numbers in lambda
        ("softens", np.int64),  # 1: weak rows of G are met as far as they are cheap
        ("weak", np.int64),  # how many are
        ("origin", np.float64, (MAX_ASKED,)),
        ("basis", np.float64, (MAX_ASKED, MAX_ASKED)),  # column by column
        ("ways", np.int64),  # that a cone bounds together, or each by itself
        ("cones", np.float64, (MAX_FINGERS, 2)),  # mu / safety; negative: no bound
        ("least", np.float64),  # normal force [N]
        ("most", np.float64),
        ("force", np.float64, (MAX_ASKED,)),
        ("point", np.float64, (MAX_ASKED + 1,)),  # lambda, and the violation
        ("active", np.int64, (4 * MAX_FINGERS,)),  # limits of every contact
        ("multipliers", np.float64, (4 * MAX_FINGERS,)),
        ("matrix", np.float64, (4 * MAX_FORCES, 4 * MAX_FORCES)),
        ("order", np.int64, (4 * MAX_FORCES,)),
        ("right", np.float64, (4 * MAX_FORCES,)),
        ("step", np.float64, (4 * MAX_FORCES,)),
        ("gradient", np.float64, (MAX_ASKED + 1,)),
        ("trial", np.float64, (MAX_ASKED + 1,)),
        ("warm", np.int64),  # 1 once a tick has left its active set
    ],
    align=True,
)

# Intermediate values of one evaluation; the last one evaluated stays readable.
WORKSPACE = np.dtype(
    [
        ("kin", KINEMATICS),
        ("dynamics", TIP_DYNAMICS),
        ("system", SYSTEM),
        ("gamma", np.float64, (MAX_FINGERS, 3)),  # directions of slip, spin last
        ("tip_forces", np.float64, (MAX_FINGERS, 3)),  # u = J^-T tau, world axes
        ("available", np.float64, (MAX_FINGERS, 3)),  # force without acceleration, world axes
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
        ("at_start", np.int64),  # 1 where the plant is evaluated at the start of the next step
    ],
    align=True,
)
