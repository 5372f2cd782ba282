"""Linearly implicit Runge-Kutta method ROS34PW2, whose order does not depend on an exact Jacobian.

(I - h gamma J) k_i = f(y + h sum alpha_ij k_j) + h J sum gamma_ij k_j, of order 3 with an embedded
method of order 2. Reference: Rang and Angermann, New Rosenbrock W-methods of order 3 for partial
differential algebraic equations of index 1, BIT 45 (2005).
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.numerics.methods import pack_method

DIAGONAL = 4.3586652150845900e-01  # gamma

# The stages are slopes 1 to 4; slope 5 is at the end.
ROS34PW2 = pack_method(
    roots=2,
    last=5,
    nodes=(0.0, 0.0, 8.7173304301691801e-01, 7.3157995778885238e-01, 1.0, 1.0),
    matrix=(
        (),
        (),
        ((1, 8.7173304301691801e-01),),
        ((1, 8.4457060015369423e-01), (2, -1.1299064236484185e-01)),
        ((3, 1.0),),
        (
            (1, 2.4212380706095346e-01),
            (2, -1.2232505839045147e00),
            (3, 1.5452602553351020e00),
            (4, 4.3586652150845900e-01),
        ),
    ),
    error=(
        0.0,
        2.4212380706095346e-01 - 3.7810903145819369e-01,
        -1.2232505839045147e00 + 9.6042292212423178e-02,
        1.5452602553351020e00 - 5.0000000000000000e-01,
        4.3586652150845900e-01 - 2.1793326075422950e-01,
        0.0,
    ),
    correction=(),
    dense=(),
)

# Gamma below its diagonal: coefficients of earlier stages in the Jacobian term.
COUPLING = np.array(
    [
        [0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0],
        [0.0, -8.7173304301691801e-01, 0.0, 0.0],
        [0.0, -9.0338057013044082e-01, 5.4180672388095326e-02, 0.0],
        [0.0, 2.4212380706095346e-01, -1.2232505839045147e00, 5.4526025533510214e-01],
    ]
)
