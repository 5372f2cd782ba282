"""Places of the close-ups in pictures of a hand."""

from __future__ import annotations

from matplotlib.axes import Axes

from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.face_lens import FaceLens
from slipgrasp.figures.hand_motion import HandMotion
from slipgrasp.figures.moving_lens import Box, MovingLens
from slipgrasp.figures.side_lens import SideLens

# Fractions of the image.
_LOW, _HIGH, _WIDTH = 0.37, 0.9, 0.2
_PLANAR, _SPATIAL = 0.27, 0.2  # heights at most
_LEAST_ASIDE = 0.1  # of a normal that points to a side of the image


def add_lenses(hand: Axes, result: RunResult, motion: HandMotion) -> list[MovingLens]:
    """Adds a close-up of each contact, on the side of its finger; of a spatial hand on the right.

    Args:
        hand: The picture of the hand.
        result: A run of a hand.
        motion: Positions at the times to draw.
    """
    is_planar = result.scenario.space.num_tangents == 1
    columns = _sides(motion) if is_planar else ([], list(range(len(motion.normals[0]))))
    height = min((_HIGH - _LOW) / max(map(len, columns)), _PLANAR if is_planar else _SPATIAL)
    tips = motion.joints[0, :, -1, 1]
    boxes: dict[int, Box] = {
        i: (side * (1.0 - _WIDTH), _HIGH - height * (row + 1), _WIDTH, height)
        for side, contacts in enumerate(columns)
        for row, i in enumerate(sorted(contacts, key=lambda i: -tips[i]))
    }
    kind = SideLens if is_planar else FaceLens
    return [kind(hand, result, i, motion, boxes[i]) for i in sorted(boxes)]


def _sides(motion: HandMotion) -> tuple[list[int], list[int]]:
    """The contacts on the left and on the right; those above or below on the emptier side."""
    left: list[int] = []
    right: list[int] = []
    for i, (across, _) in enumerate(motion.normals[0]):
        is_between = abs(across) <= _LEAST_ASIDE
        is_left = len(left) <= len(right) if is_between else across > 0.0
        (left if is_left else right).append(i)
    return left, right
