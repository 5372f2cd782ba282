"""Layout of the state of a body on a support, its discrete state, and its workspace.

The sliding velocity is u = (v_x, v_y, c omega), with the radius c of the limit surface. The load
A = (F_x, F_y, M / c) and the friction f = (f_x, f_y, f_tau) are its dual forces [N].
"""

from __future__ import annotations

import numpy as np

X, Y, THETA, VX, VY, OMEGA, SUPPLIED, DISSIPATED, PATH, TURNED = range(10)
NUM_STATES = 10

STICK, SLIP = 0, 2  # `slipgrasp.core.trace.types.ContactPhase`

# Pose and velocity [m, rad, s]; supplied and dissipated energy [J]; distance slid [m], angle
# turned [rad].
STATE = np.dtype([("x", np.float64, (NUM_STATES,))], align=True)

# State that is constant between jumps.
DISCRETE = np.dtype(
    [
        ("phases", np.int64, (1,)),
        ("direction", np.float64, (3,)),  # u / |u| where |u| is 0: at onset, or at a stop
        ("diagnostics", np.float64, (1,)),  # of a law; none
    ],
    align=True,
)

# Intermediate values of an evaluation; those of the latest one remain available.
WORKSPACE = np.dtype(
    [
        ("kin", np.dtype([("speed", np.float64)])),  # |u| [m/s]
        ("acceleration", np.float64, (3,)),  # of pose
        ("forces", np.float64, (1, 3)),  # f_x, f_y and the normal force [N]
        ("moment", np.float64),  # c f_tau [N m]
        ("margin", np.float64),  # mu N - |f| [N]
        ("room", np.dtype([("error", np.float64, (1,))])),  # of a desired motion; none
    ],
    align=True,
)
