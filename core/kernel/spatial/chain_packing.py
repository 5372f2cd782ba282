"""Constants of a chain of joints for the kernel.

Only sums, products, quotients and square roots in a fixed order are used, so that the constants
have the same bits on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.scenario.chain import chain_length, couplings, range_of
from slipgrasp.core.scenario.spatial import SpatialFinger
from slipgrasp.core.scenario.spatial_geometry import rotation_matrix

Row: TypeAlias = Sequence[float]
Matrix: TypeAlias = Sequence[Row]


def pack_chain(finger: SpatialFinger, chain: Record, masses: Any) -> None:
    """Packs a chain of joints and the masses of its links.

    The frames of the scenario are rotated so that z is the joint axis.
    """
    before: Matrix = rotation_matrix(finger.attitude)
    for k, joint in enumerate(finger.joints):
        axes = _frame_along(joint.axis)
        inwards = _transposed(axes)
        attitude = rotation_matrix(joint.attitude)
        chain.places[k] = _apply(before, joint.place)
        chain.turns[k] = _product(before, _product(attitude, axes))
        chain.slides[k] = int(joint.kind == "prismatic")
        chain.centres[k] = _apply(inwards, joint.centre)
        xx, xy, xz, yy, yz, zz = joint.unit_inertia
        turned = _product(inwards, _product(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), axes))
        chain.inertias[k] = (*turned[0], *turned[1][1:], turned[2][2])
        chain.limits[k] = range_of(joint)
        masses[k] = joint.mass
        before = inwards
    chain.tip[:] = _apply(before, finger.tip)
    chain.links, chain.length = len(finger.joints), chain_length(finger.joints, finger.tip)
    ratios, offsets = couplings(finger.joints)
    chain.couples = int(any(joint.follows is not None for joint in finger.joints))
    chain.ratios[: chain.links], chain.offsets[: chain.links] = ratios, offsets


def _frame_along(axis: Row) -> Matrix:
    """Rotation matrix with the given z axis, by the shortest rotation from z or -z."""
    x, y, z = axis
    scale = 1.0 / math.sqrt(x * x + y * y + z * z)
    x, y, z = scale * x, scale * y, scale * z
    sign = 1.0 if z >= 0.0 else -1.0
    share = 1.0 / (1.0 + sign * z)
    return (
        (1.0 - share * x * x, -sign * share * x * y, x),
        (-share * x * y, sign * (1.0 - share * y * y), y),
        (-sign * x, -y, z),
    )


def _transposed(matrix: Matrix) -> Matrix:
    return tuple(zip(*matrix, strict=True))


def _product(a: Matrix, b: Matrix) -> Matrix:
    return tuple(_apply(_transposed(b), row) for row in a)


def _apply(matrix: Matrix, vector: Row) -> Row:
    x, y, z = vector
    return tuple(row[0] * x + row[1] * y + row[2] * z for row in matrix)
