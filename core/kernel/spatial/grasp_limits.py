"""Limits of the contact forces of spatial hands: cones, least and greatest normal forces."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.ways import size_with_spin, way_of, way_size

FEASIBLE = 1e-10  # [N], and relative to the forces
# Limits of every contact: friction of its slip modes, least and greatest normal force.
PER_CONTACT = 4
FRICTION, _, LEAST, MOST = range(PER_CONTACT)


@compiled
def set_force(grasp: Record, n: int) -> None:
    """Computes the forces at ``point``."""
    for k in range(grasp.size):
        total = grasp.origin[k]
        for j in range(grasp.free):
            total += grasp.basis[j, k] * grasp.point[j]
        grasp.force[k] = total


@compiled
def part_at(grasp: Record, i: int, part: int) -> int:
    """Index of a friction component of contact ``i`` in the forces; component 2 is the moment."""
    return 3 * grasp.fingers + i if part == 2 else 3 * i + part


@compiled
def tangential(grasp: Record, i: int, way: int) -> float:
    """Magnitude of the friction force in a slip mode of contact ``i`` [N]."""
    if grasp.soft == 1:
        moment = grasp.force[3 * grasp.fingers + i]
        return size_with_spin(grasp.force[3 * i], grasp.force[3 * i + 1], moment)
    return way_size(grasp, way, grasp.force[3 * i], grasp.force[3 * i + 1])


@compiled
def exists(grasp: Record, c: int) -> bool:
    """True if limit ``c`` is in use."""
    i, kind = c // PER_CONTACT, c % PER_CONTACT
    if kind < LEAST:
        return grasp.cones[i, kind] >= 0.0
    return kind == LEAST or grasp.most < np.inf


@compiled
def limit(grasp: Record, c: int) -> float:
    """Distance of a force inside limit ``c`` [N]; inf if the limit is not in use."""
    if not exists(grasp, c):
        return np.inf
    i, kind = c // PER_CONTACT, c % PER_CONTACT
    normal = grasp.force[3 * i + 2]
    if kind < LEAST:
        return grasp.cones[i, kind] * normal - tangential(grasp, i, kind)
    return normal - grasp.least if kind == LEAST else grasp.most - normal


@compiled
def gradient_entry(grasp: Record, c: int, k: int) -> float:
    """Derivative of limit ``c`` with respect to force component ``k`` of its contact."""
    i, kind = c // PER_CONTACT, c % PER_CONTACT
    if kind >= LEAST:
        return 0.0 if k < 2 else (1.0 if kind == LEAST else -1.0)
    if k == 2:
        return grasp.cones[i, kind]
    if way_of(grasp, k) != kind:
        return 0.0
    return -grasp.force[3 * i + k] / max(tangential(grasp, i, kind), 1e-300)


@compiled
def gradient_of(grasp: Record, c: int) -> tuple[float, float, float, float]:
    """Derivatives of limit ``c`` with respect to the force and the moment of its contact."""
    i, along_moment = c // PER_CONTACT, 0.0
    if grasp.soft == 1 and c % PER_CONTACT == FRICTION:
        along_moment = -grasp.force[part_at(grasp, i, 2)] / max(tangential(grasp, i, 0), 1e-300)
    return (
        gradient_entry(grasp, c, 0),
        gradient_entry(grasp, c, 1),
        gradient_entry(grasp, c, 2),
        along_moment,
    )


@compiled
def slope_of_limit(
    grasp: Record, c: int, gradient: tuple[float, float, float, float], j: int
) -> float:
    """Derivative of limit ``c`` with respect to free variable ``j``, from its gradient."""
    i, basis = c // PER_CONTACT, grasp.basis
    total = 0.0 + gradient[0] * basis[j, 3 * i]
    total += gradient[1] * basis[j, 3 * i + 1]
    total += gradient[2] * basis[j, 3 * i + 2]
    if grasp.soft == 1 and c % PER_CONTACT == FRICTION:
        total += gradient[3] * basis[j, part_at(grasp, i, 2)]
    return total


@compiled
def allowed(grasp: Record, n: int) -> float:
    """Tolerance within which a limit counts as met [N]."""
    total = 0.0
    for k in range(grasp.size):
        total += square(grasp.force[k])
    return FEASIBLE * (1.0 + np.sqrt(total))
