"""A run with sampled control: torques held over each period, fixed steps of Runge-Kutta."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tests.references.hybrid import (
    Flow,
    Guard,
    Run,
    at_rest,
    guards,
    initial_vector,
    select_phases,
    unpack,
)
from tests.references.world import World

__all__ = ["run_sampled"]

Array = NDArray[np.float64]


def run_sampled(world: World, period: float, t_final: float, times: list[float]) -> Run:
    """Torques held over each period; estimates advance by one projected Euler step per tick.

    Pulses and patches come and go at ticks.
    """
    plain = world.plain
    z, path = initial_vector(plain), np.zeros(len(plain.hand.fingers))
    phase: tuple[int, ...] = (0,) * len(path)
    changes, record = [(0.0, phase)], {}
    for tick in range(round(t_final / period)):
        t = tick * period
        record.update({time: z for time in times if abs(time - t) < 0.1 * period})
        loop = world.loop(t, world.sides(t, z))
        state, estimates = unpack(loop, z)
        desired = loop.trajectory.desired(t)
        now = loop.evaluate(state, phase, estimates, desired)
        flow = _select_one(Flow(loop, phase, t, torques=now.torques), t, z)
        measured = flow.motion(t, z).acceleration
        rates = loop.estimate_rates(now.kin, state, phase, estimates, desired, measured)
        z = z.copy()
        z[6 + 2 * len(path) :] = np.clip(
            estimates + period * rates, loop.law.minimum, loop.law.maximum
        )
        z, flow, path = _advance_held(world, flow, t, period, z, path, changes)
        phase = flow.phase
    return Run(changes, path, times, [record[time] for time in times])


def _select_one(flow: Flow, t: float, z: Array) -> Flow:
    phases = select_phases(lambda p: replace(flow, phase=p), flow.loop, t, z)
    assert len(phases) == 1, f"{phases} are consistent at t = {t}"
    return replace(flow, phase=phases[0])


def _advance_held(
    world: World,
    flow: Flow,
    start: float,
    period: float,
    z: Array,
    path: Array,
    changes: list[tuple[float, tuple[int, ...]]],
) -> tuple[Array, Flow, Array]:
    """One period under held torques, through the events inside it."""
    t, end, n = start, start + period, len(flow.phase)
    while True:
        if flow.phase != changes[-1][1]:
            changes.append((t, flow.phase))
        sides = world.sides(start, z)
        flow = replace(flow, loop=world.loop(start, sides))
        watched = [*guards(flow), *world.edge_guards(sides)]
        after = _runge_kutta(flow, t, z, end - t)
        fired = [g for g in watched if g(end, after) < 0.0]
        part = end - t
        if fired:
            part = min(_locate(flow, g, t, z, end - t) for g in fired)
            after = _runge_kutta(flow, t, z, part)
        path = path + np.abs(after[6 : 6 + n] - z[6 : 6 + n])
        t, z = t + part, after
        if not fired:
            return z, flow, path
        z = at_rest(flow.loop, z)
        flow = replace(flow, loop=world.loop(start, world.sides(start, z)))
        flow = _select_one(flow, t, z)


def _locate(flow: Flow, guard: Guard, t: float, z: Array, step: float) -> float:
    """Time after t at which a guard falls through zero, by bisection on one step."""
    low, high = 0.0, step
    while high - low > 1e-14:
        middle = 0.5 * (low + high)
        if guard(t + middle, _runge_kutta(flow, t, z, middle)) < 0.0:
            high = middle
        else:
            low = middle
    return high


def _runge_kutta(flow: Flow, t: float, z: Array, step: float) -> Array:
    """One classical step of order four."""
    k1 = flow.derivative(t, z)
    k2 = flow.derivative(t + step / 2, z + step / 2 * k1)
    k3 = flow.derivative(t + step / 2, z + step / 2 * k2)
    k4 = flow.derivative(t + step, z + step * k3)
    return z + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
