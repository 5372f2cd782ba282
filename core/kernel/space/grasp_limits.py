"""Limits of the contact forces in space: cones, least and greatest normal forces."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compiler import compiled
from slipgrasp.core.kernel.elementary import square
from slipgrasp.core.kernel.records import Record

FEASIBLE = 1e-10  # [N], and share of the forces
CONE, LEAST, MOST = range(3)


@compiled
def set_force(grasp: Record, n: int) -> None:
    """Forces at ``point``."""
    for k in range(3 * n):
        total = grasp.origin[k]
        for j in range(grasp.free):
            total += grasp.basis[j, k] * grasp.point[j]
        grasp.force[k] = total


@compiled
def tangential(grasp: Record, i: int) -> float:
    """Size of the tangential force of contact ``i`` [N]."""
    force = grasp.force
    return np.sqrt(square(force[3 * i]) + square(force[3 * i + 1]))


@compiled
def limit(grasp: Record, c: int) -> float:
    """How far a force is inside limit ``c`` [N]; inf where there is no such limit."""
    i, kind = c // 3, c % 3
    normal = grasp.force[3 * i + 2]
    if kind == CONE:
        if grasp.cones[i] < 0.0:
            return np.inf
        return grasp.cones[i] * normal - tangential(grasp, i)
    return normal - grasp.least if kind == LEAST else grasp.most - normal


@compiled
def gradient_entry(grasp: Record, c: int, k: int) -> float:
    """Derivative of limit ``c`` along force component ``k`` of its contact."""
    i, kind = c // 3, c % 3
    if kind != CONE:
        return 0.0 if k < 2 else (1.0 if kind == LEAST else -1.0)
    if k == 2:
        return grasp.cones[i]
    return -grasp.force[3 * i + k] / max(tangential(grasp, i), 1e-300)


@compiled
def slope_of_limit(grasp: Record, c: int, j: int) -> float:
    """Derivative of limit ``c`` along free number ``j``."""
    i, total = c // 3, 0.0
    for k in range(3):
        total += gradient_entry(grasp, c, k) * grasp.basis[j, 3 * i + k]
    return total


@compiled
def allowed(grasp: Record, n: int) -> float:
    """By how much a limit may be missed and count as met [N]."""
    total = 0.0
    for k in range(3 * n):
        total += square(grasp.force[k])
    return FEASIBLE * (1.0 + np.sqrt(total))
