"""The constants of a run for the kernel.

`slipgrasp.core.kernel.planar.packing` computes them.

Arrays have one item per finger, link, coordinate or unknown; ``n`` fingers give ``N = 3 + n``
reduced coordinates (object pose, then slip), ``p`` unknowns.
"""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.records import MAX_COORDINATES, MAX_FINGERS
from slipgrasp.core.kernel.loop.model import (
    ACTUATORS,
    NUMERICS,
    SENSORS,
    UNKNOWNS,
    facts_layout,
    law_layout,
)
from slipgrasp.core.kernel.loop.motion import motion_layout
from slipgrasp.core.kernel.numerics.methods import MAX_METHODS, METHOD
from slipgrasp.core.kernel.planar.chain import CHAIN
from slipgrasp.core.scenario.space import PLANAR

# Geometry of fingers and contacts.
HAND = np.dtype(
    [
        ("num_fingers", np.int64),
        ("kinds", np.int64, (MAX_FINGERS,)),  # BY_LINKS, ON_SLIDES (along x and y) or BY_CHAIN
        ("link_lengths", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("link_centres", np.float64, (MAX_FINGERS, 2)),  # from the proximal joint [m]
        ("link_moments", np.float64, (MAX_FINGERS, 2)),  # inertia per mass about that joint [m^2]
        ("bases", np.float64, (MAX_FINGERS, 2)),  # [m]
        ("elbows", np.float64, (MAX_FINGERS,)),  # sign of sin q2
        ("anchors", np.float64, (MAX_FINGERS, 2)),  # object frame [m]
        ("tangents", np.float64, (MAX_FINGERS, 2)),  # object frame
        ("radii", np.float64, (MAX_FINGERS,)),  # of round faces about the centre, 0: straight [m]
        ("slip_minimum", np.float64, (MAX_FINGERS,)),  # ends of the face, or of its part
        ("slip_maximum", np.float64, (MAX_FINGERS,)),  # with constant friction [m]
        ("gravity", np.float64),  # [m/s^2]
        ("chains", CHAIN, (MAX_FINGERS,)),
        ("torque_limits", np.float64, (MAX_FINGERS, 2)),  # inf if unlimited [N m, N]
        ("joint_damping", np.float64, (MAX_FINGERS,)),  # of the plant alone [N m s, N s/m]
        ("joint_friction", np.float64, (MAX_FINGERS,)),  # of the plant alone [N m, N]
        ("joints_rub", np.bool_),  # whether any value above is nonzero
    ],
    align=True,
)

# Masses and friction: one set has the true values, another the controller's estimates.
TRUTH = np.dtype(
    [
        ("num_fingers", np.int64),
        ("link_masses", np.float64, (MAX_FINGERS, 2)),  # of slides, all in the first [kg]
        ("object_inertia", np.float64, (3,)),  # m, m, I [kg, kg, kg m^2]
        ("friction", np.float64, (MAX_FINGERS,)),  # while the fingertip slips
        ("static_friction", np.float64, (MAX_FINGERS,)),  # while it sticks; not available to laws
    ],
    align=True,
)

FACTS = facts_layout(PLANAR)

# Constants of the control law (Theorems 3 and 4).
LAW = law_layout(
    FACTS,
    MAX_COORDINATES,
    [
        ("num_fingers", np.int64),
        ("recognition_time", np.float64),  # [s]
        ("grasp_force", np.bool_),
        ("holds", np.bool_),  # keep every contact inside its cone, slipping or not
        ("knows_lengths", np.bool_),  # whether the law uses the true link lengths
    ],
)
MOTION = motion_layout(3)

# Constants of one segment of a run.
MODEL = np.dtype(
    [
        ("num_fingers", np.int64),  # n
        ("num_unknowns", np.int64),  # p
        ("num_states", np.int64),  # of the integrated state
        ("num_diagnostics", np.int64),  # of a custom law
        ("hand", HAND),
        ("nominal", HAND),  # the law's model of the links: only lengths are set
        ("truth", TRUTH),
        ("load", np.float64, (3,)),  # of pulses on the object [N, N, N m]
        ("unknowns", UNKNOWNS),
        ("law", LAW),
        ("motion", MOTION),
        ("sensors", SENSORS),
        ("actuators", ACTUATORS),
        ("numerics", NUMERICS),
        ("num_methods", np.int64),
        ("methods", METHOD, (MAX_METHODS,)),  # in ascending order
    ],
    align=True,
)
