"""Layout of the equations of soft contacts, four rows each: tangents, turn, normal."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.records import MAX_FINGERS

ROWS, TURN, NORMAL = 4, 2, 3  # rows per contact, index of the turn and of the normal
# Kinds of contacts: may stick or slip, slips in a given direction, sticks.
FREE, MOVING, STUCK = range(3)
MAX_WRENCH = ROWS * MAX_FINGERS

# Terms of w = G F + c; moments are divided, spins multiplied by the eccentricity.
TORSION = np.dtype(
    [
        ("turning", np.float64, (MAX_FINGERS, 3)),  # k = J^-T J_omega^T n, spin per tip velocity
        ("gyration", np.float64, (MAX_FINGERS,)),  # psi'' at zero accelerations [rad/s^2]
        ("wrenches", np.float64, (MAX_WRENCH, 6)),  # columns of W
        ("pulls", np.float64, (MAX_WRENCH, 3)),  # B: -B^T F is the equivalent tip force
        ("responses", np.float64, (MAX_WRENCH, 6)),  # columns of M_o^-1 W
        ("turn_inverse", np.float64, (6,)),  # (R I_b R^T)^-1: xx, xy, xz, yy, yz, zz
        ("fall", np.float64, (6,)),  # M_o^-1 (load - h_o)
        ("mobility", np.float64, (MAX_WRENCH, MAX_WRENCH)),  # G
        ("offset", np.float64, (MAX_WRENCH,)),  # c
        ("creep", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # penalty on given moments, part of G
        ("twists", np.float64, (MAX_FINGERS, 6)),  # m, wrench per F_tau / e in stick
        ("presses", np.float64, (MAX_FINGERS, 6)),  # w, wrench per F_n in slip
        ("yields", np.float64, (MAX_FINGERS, 3)),  # Lambda^-1 q
        ("gives", np.float64, (MAX_FINGERS,)),  # d
        ("free", np.float64, (MAX_FINGERS, 3)),  # from joints: force (stick), acceleration (slip)
        ("sigma", np.float64, (6, 6)),  # LU factors
        ("sigma_order", np.int64, (6,)),
        ("load", np.float64, (6,)),
        ("motion", np.float64, (6,)),
        ("num_holders", np.int64),  # contacts that stick and resist turning
        ("holders", np.int64, (MAX_FINGERS,)),
        ("moves", np.float64, (MAX_FINGERS, 6)),  # Sigma^-1 m of each
        ("turns", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # e psi'' per F_tau / e of these
        ("symmetric", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # symmetric part, diagonalized
        ("modes", np.float64, (MAX_FINGERS, MAX_FINGERS)),  # its eigenvectors, in columns
        ("num_determined", np.int64),  # number of determined modes, which are first
        ("wanted", np.float64, (MAX_FINGERS,)),  # e psi'' without moments
        ("amounts", np.float64, (MAX_FINGERS,)),  # of every mode [N]
        (
            "shift",
            np.float64,
            (MAX_FINGERS,),
        ),  # change of the amounts of undetermined modes by relief [N]
        (
            "most",
            np.float64,
            (MAX_FINGERS,),
        ),  # friction of holders over F_n before relief
        # (F_x, F_y, F_tau / e, F_n) of the holders per amount of an undetermined mode
        ("reliefs", np.float64, (MAX_FINGERS, MAX_FINGERS, 4)),
        ("held", np.float64, (MAX_FINGERS,)),  # F_tau / e of the holders [N]
        ("some_slip", np.int64),  # 1 if any contact slips
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
        ("bounds", np.float64, (MAX_FINGERS,)),  # friction coefficients of free contacts
        ("slides", np.float64, (MAX_FINGERS, 3)),  # directions of moving contacts
        ("responding", np.float64, (6 + 2 * MAX_FINGERS,)),  # accelerations per tip force
        ("no_slide", np.float64, (MAX_FINGERS, 3)),  # zero: slip without friction
    ],
    align=True,
)
