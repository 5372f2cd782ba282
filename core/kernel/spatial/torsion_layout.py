"""The equations of soft contacts, four rows each: both tangents, turn about the normal, normal."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.records import MAX_FINGERS

ROWS, TURN, NORMAL = 4, 2, 3  # of a contact
# Of a contact in the contact problem: may stick or slip, slips in its direction, sticks anyway.
FREE, MOVING, STUCK = range(3)
MAX_WRENCH = ROWS * MAX_FINGERS

# w = G F + c and what it is made of; moments and spins are over and times the eccentricity.
TORSION = np.dtype(
    [
        ("turning", np.float64, (MAX_FINGERS, 3)),  # k = J^-T J_omega^T n, spin per tip velocity
        ("gyration", np.float64, (MAX_FINGERS,)),  # psi'' without any acceleration [rad/s^2]
        ("wrenches", np.float64, (MAX_WRENCH, 6)),  # W on the object, column by column
        ("pulls", np.float64, (MAX_WRENCH, 3)),  # B: -B^T F is what the joints feel at the tip
        ("responses", np.float64, (MAX_WRENCH, 6)),  # M_o^-1 W, column by column
        ("turn_inverse", np.float64, (6,)),  # (R I_b R^T)^-1: xx, xy, xz, yy, yz, zz
        ("fall", np.float64, (6,)),  # M_o^-1 (load - h_o)
        ("mobility", np.float64, (MAX_WRENCH, MAX_WRENCH)),  # G
        ("offset", np.float64, (MAX_WRENCH,)),  # c
        ("creep", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # added to G of turns, for given moments
        ("twists", np.float64, (MAX_FINGERS, 6)),  # m, wrench per F_tau / e in stick
        ("presses", np.float64, (MAX_FINGERS, 6)),  # w, wrench per F_n in slip
        ("tip_mobilities", np.float64, (MAX_FINGERS, 6)),  # Lambda^-1 where a contact slips
        ("yields", np.float64, (MAX_FINGERS, 3)),  # Lambda^-1 q
        ("gives", np.float64, (MAX_FINGERS,)),  # d
        ("free", np.float64, (MAX_FINGERS, 3)),  # force in stick, acceleration in slip, by joints
        ("sigma", np.float64, (6, 6)),  # LU factors
        ("sigma_order", np.int64, (6,)),
        ("load", np.float64, (6,)),
        ("motion", np.float64, (6,)),
        ("num_holders", np.int64),  # contacts that stick and resist turning
        ("holders", np.int64, (MAX_FINGERS,)),
        ("moves", np.float64, (MAX_FINGERS, 6)),  # Sigma^-1 m of each
        ("turns", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # e psi'' per F_tau / e of these
        ("symmetric", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # the same made symmetric, diagonal
        ("modes", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # its eigenvectors, column by column
        ("num_determined", np.int64),  # of them, which come first
        ("wanted", np.float64, (MAX_FINGERS,)),  # e psi'' without moments
        ("amounts", np.float64, (MAX_FINGERS,)),  # of every mode [N]
        ("shift", np.float64, (MAX_FINGERS,)),  # of the amounts of undetermined modes [N]
        ("most", np.float64, (MAX_FINGERS,)),  # friction of the holders, over F_n, without relief
        # (F_x, F_y, F_tau / e, F_n) of the holders per amount of an undetermined mode
        ("reliefs", np.float64, (MAX_FINGERS, MAX_FINGERS, 4)),
        ("held", np.float64, (MAX_FINGERS,)),  # F_tau / e of the holders [N]
        ("some_slip", np.int64),  # 1 where some contact slips
        ("small", np.float64, (MAX_FINGERS, MAX_FINGERS)),
        ("small_right", np.float64, (MAX_FINGERS,)),
        ("small_order", np.int64, (MAX_FINGERS,)),
        ("force", np.float64, (MAX_WRENCH,)),
        ("opening", np.float64, (MAX_WRENCH,)),  # w
        ("matrix", np.float64, (MAX_WRENCH, MAX_WRENCH)),
        ("right", np.float64, (MAX_WRENCH,)),
        ("step", np.float64, (MAX_WRENCH,)),
        ("order", np.int64, (MAX_WRENCH,)),
        ("kinds", np.int64, (MAX_FINGERS,)),  # of contacts in the contact problem
        ("bounds", np.float64, (MAX_FINGERS,)),  # friction that a free contact has at most
        ("slides", np.float64, (MAX_FINGERS, 3)),  # directions of those that are moving
        ("responding", np.float64, (6 + 2 * MAX_FINGERS,)),  # accelerations per tip force
        ("no_slide", np.float64, (MAX_FINGERS, 3)),  # 0: directions of slip without friction
    ],
    align=True,
)
