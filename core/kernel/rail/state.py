"""Discrete state and workspace of a run on a rail.

The integrated state is that of a planar hand with one finger, whose object moves along x only:
position x, slip s of the fingertip, which moves by -t s relative to the object, their velocities,
the estimate of the mass, if any, and supplied and dissipated energy.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.planar.kinematics import KINEMATICS

# Indices of `slipgrasp.core.kernel.planar.state` for one finger.
POSITION, SPEED, SLIP, SLIP_SPEED, MASS = 0, 3, 6, 7, 8

# State that is constant between jumps.
DISCRETE = np.dtype(
    [
        ("phases", np.int64, (2,)),  # signs of s' and x' while they are not 0
        ("piece", np.int64),  # of the desired motion
        ("diagnostics", np.float64, (1,)),  # of a custom law; none
    ],
    align=True,
)

# Intermediate values of an evaluation; those of the latest one remain available.
WORKSPACE = np.dtype(
    [
        ("kin", KINEMATICS),
        ("inertia", np.float64, (3,)),  # Lambda of the fingertip: xx, xy, yy [kg]
        ("bias", np.float64, (2,)),  # f_0 [N]
        ("tip_force", np.float64, (2,)),  # J^-T tau [N]
        ("torques", np.float64, (2,)),  # [N m]
        ("acceleration", np.float64, (2,)),  # x'' and s'' [m/s^2]
        ("forces", np.float64, (2, 2)),  # tangential and normal, on the object [N]
        ("rate", np.float64),  # of the estimate [kg/s]
        ("lyapunov", np.float64),
        ("determinant", np.float64),  # of the equations of motion; 1 if nothing slips
        ("room", np.dtype([("error", np.float64, (1,))])),  # of the desired motion [m]
    ],
    align=True,
)
