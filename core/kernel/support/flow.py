"""Friction and motion of a body on a support.

With the limit surface as an ellipsoid, |f| is at most mu N. While the body slides, the friction of
largest dissipation is f = -mu N u / |u|; at rest, f = -A.
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.friction import present_friction
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.support.model import MODEL
from slipgrasp.core.kernel.support.state import (
    DISCRETE,
    DISSIPATED,
    OMEGA,
    PATH,
    STATE,
    STICK,
    SUPPLIED,
    TURNED,
    VX,
    VY,
    WORKSPACE,
    X,
)

MAX_ITERATIONS = 100


@compiled
def sliding_part(model: Record, state: Record, part: int) -> float:
    """Component of u [m/s]."""
    scale = model.hand.radius if part == 2 else 1.0
    return scale * state.x[VX + part]


@compiled
def sliding_speed(model: Record, state: Record) -> float:
    """|u| [m/s]."""
    total = 0.0
    for part in range(3):
        total += square(sliding_part(model, state, part))
    return np.sqrt(total)


@compiled
def load_part(model: Record, part: int) -> float:
    """Component of A [N]: pulses and gravity along the plane; no moment without a radius."""
    if part == 2:
        return model.load[2] / model.hand.radius if model.hand.radius > 0.0 else 0.0
    weight = model.truth.mass * model.hand.fall if part == 0 else 0.0
    return model.load[part] - weight


@compiled
def load_size(model: Record) -> float:
    """|A| [N]."""
    total = 0.0
    for part in range(3):
        total += square(load_part(model, part))
    return np.sqrt(total)


@compiled
def _mass_of(model: Record, part: int) -> float:
    """Mass that a component of f accelerates: I / c² for u_tau [kg]."""
    radius = model.hand.radius
    if part == 2 and radius > 0.0:
        return model.truth.inertia / (radius * radius)
    return model.truth.mass


@compiled_apart(types.void, MODEL, DISCRETE)
def support_onset(model: Record, discrete: Record) -> None:
    """Direction d in which a body at rest begins to slide, with A outside the limit surface.

    (A - mu N d) / m is parallel to d: A = (kappa m + mu N) d, with |d| = 1. Newton's iteration on
    1 / |d| - 1, nearly linear in kappa [m/s²], converges from below.
    """
    bound = model.truth.friction[0] * model.truth.normal_force
    largest = max(_mass_of(model, 0), _mass_of(model, 2))
    kappa, length = (load_size(model) - bound) / largest, 1.0
    for _ in range(MAX_ITERATIONS):
        size = slope = 0.0
        for part in range(3):
            mass = _mass_of(model, part)
            entry = load_part(model, part) / (kappa * mass + bound)
            discrete.direction[part] = entry
            size += entry * entry
            slope += entry * entry * mass / (kappa * mass + bound)
        length = np.sqrt(size)
        change = size / slope * (length - 1.0)
        if not change > 1e-16 * kappa:
            break
        kappa += change
    for part in range(3):
        discrete.direction[part] /= length


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE)
def support_plant(model: Record, discrete: Record, state: Record, work: Record) -> None:
    """Evaluates friction and acceleration at a state."""
    truth, radius, size = model.truth, model.hand.radius, 0.0
    bound = present_friction(model, discrete, 0) * truth.normal_force
    speed = sliding_speed(model, state)
    work.kin.speed = speed
    for part in range(3):
        if discrete.phases[0] == STICK:
            friction = -load_part(model, part)
        elif speed > 0.0:
            friction = -bound * sliding_part(model, state, part) / speed
        else:
            friction = -bound * discrete.direction[part]
        size += square(friction)
        if part == 2:
            work.moment = radius * friction
            # At rest, exactly 0: c A_tau need not equal the moment.
            resists = discrete.phases[0] == STICK and radius > 0.0
            work.acceleration[2] = 0.0 if resists else (model.load[2] + work.moment) / truth.inertia
        else:
            work.forces[0, part] = friction
            work.acceleration[part] = (load_part(model, part) + friction) / truth.mass
    work.forces[0, 2] = truth.normal_force
    work.margin = bound - np.sqrt(size)


@compiled
def set_derivative(model: Record, state: Record, slope: Record, work: Record) -> None:
    """Derivative of an evaluated state."""
    x, forces = state.x, work.forces
    for part in range(3):
        slope.x[X + part] = x[VX + part]
        slope.x[VX + part] = work.acceleration[part]
    slope.x[SUPPLIED] = _power(x, model.load[0], model.load[1], model.load[2])
    slope.x[DISSIPATED] = -_power(x, forces[0, 0], forces[0, 1], work.moment)
    slope.x[PATH] = np.sqrt(square(x[VX]) + square(x[VY]))
    slope.x[TURNED] = abs(x[OMEGA])


@compiled
def _power(x: Floats, fx: float, fy: float, moment: float) -> float:
    """Power of a force and a moment on the body [W]."""
    return fx * x[VX] + fy * x[VY] + moment * x[OMEGA]


@compiled
def stored_energy(hand: Record, truth: Record, _kin: Record, state: Record) -> tuple[float, float]:
    """Kinetic and potential energy of a state [J]."""
    x = state.x
    squared = square(x[VX]) + square(x[VY])
    kinetic = 0.5 * (truth.mass * squared + truth.inertia * square(x[OMEGA]))
    return kinetic, truth.mass * hand.fall * x[X]
