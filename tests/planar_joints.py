"""Where the joints of planar fingers stand."""

import numpy as np


def joint_points(finger, angles):
    """Base, elbow and tip ``(..., 3, 2)`` [m] at joint angles ``(..., 2)`` [rad]."""
    absolute = np.cumsum(angles, axis=-1)
    directions = np.stack([np.cos(absolute), np.sin(absolute)], axis=-1)
    points = np.asarray(finger.link_lengths)[:, None] * directions
    return finger.base + np.insert(np.cumsum(points, axis=-2), 0, 0.0, axis=-2)
