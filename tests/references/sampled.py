"""A run with sampled control: torques held over each period, fixed steps of Runge-Kutta."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import count, pairwise

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from tests.references.closed_loop import ClosedLoop
from tests.references.composite import Composite, stopping
from tests.references.hybrid import (
    Flow,
    Guard,
    Run,
    Stage,
    at_rest,
    guards,
    initial_stage,
    select_phases,
    unpack,
)
from tests.references.noise import normal_numbers
from tests.references.world import World

Array = NDArray[np.float64]

SAME_TICK = 1e-9  # [s], and in periods


def run_sampled(world: World, period: float, t_final: float, times: list[float]) -> Run:
    """Torques held over each period; estimates advance by one projected Euler step per tick.

    Pulses and patches come and go at ticks. The law is one of the theorems, or the composite
    law; it may measure accelerations with noise, and its period may change during the run.
    """
    ticks = tick_times(world.scenario, period, t_final)
    return follow_ticks(world, ticks, times, initial_stage(world.plain))


def tick_times(scenario: Scenario, period: float, t_final: float) -> list[float]:
    """When the controller runs, and the end; a change of its period is a tick, and counts anew."""
    changes = [c for c in scenario.changes if c.parameter == "controller.control_period"]
    starts = [(0.0, period), *((c.time, c.value) for c in changes), (t_final, period)]
    found = [
        start + k * step
        for (start, step), (end, _) in pairwise(starts)
        for k in range(round(np.ceil((end - start) / step - SAME_TICK)))
    ]
    return [*found, t_final]


def follow_ticks(world: World, ticks: Sequence[float], times: list[float], stage: Stage) -> Run:
    """Goes on from a stage, from tick to tick.

    Args:
        world: Hand, law and world.
        ticks: Times of all ticks, and of the end [s].
        times: Ticks at which the state is recorded.
        stage: Where the run is at the first tick.
    """
    z, phase, path, changes = stage
    learn = _Learner(world)
    record = {}
    for t, t_next in pairwise(ticks):
        record.update({time: z for time in times if abs(time - t) < SAME_TICK})
        loop = world.loop(t, world.sides(t, z))
        flow, rates = learn.tick(loop, t, t_next - t, z, phase)
        z = z.copy()
        estimates = z[6 + 2 * len(path) :]
        estimates[:] = np.clip(estimates + (t_next - t) * rates, loop.law.minimum, loop.law.maximum)
        z, flow, path = _advance_held(world, flow, t, t_next - t, z, path, changes)
        phase = flow.phase
    end = Stage(z, phase, path, changes)
    return Run(changes, path, times, [record[time] for time in times], end)


class _Learner:
    """The controller at its ticks: torque, selection, and the rates of the estimates."""

    def __init__(self, world: World) -> None:
        scenario = world.scenario
        self._scenario = scenario
        self._composite = Composite(scenario) if scenario.controller.kind == "composite" else None
        self._noise = acceleration_noise(scenario)

    def tick(
        self, loop: ClosedLoop, t: float, period: float, z: Array, phase: tuple[int, ...]
    ) -> tuple[Flow, Array]:
        """The flow under the torques of the tick, and the rates until the next one."""
        state, estimates = unpack(loop, z)
        desired = loop.trajectory.desired(t)
        added = None
        if self._composite is not None:
            added = stopping(self._scenario, state, phase, period)
        now = loop.evaluate(state, phase, estimates, desired, stopping=added)
        flow = _select_one(Flow(loop, phase, t, torques=now.torques), t, z)
        measured = flow.motion(t, z).acceleration + next(self._noise)
        if self._composite is None:
            rates = loop.estimate_rates(now.kin, state, phase, estimates, desired, measured)
        else:
            rates = self._composite.rates(
                *(loop, now.kin, state, phase, flow.phase, estimates, desired),
                *(now.torques, now.forces, measured, period),
            )
        return flow, rates


def acceleration_noise(scenario: Scenario) -> Iterator[Array]:
    """Errors of the measured accelerations, tick by tick, ``(3 + n,)``."""
    channels = 3 + len(scenario.fingers)
    for tick in count():
        numbers = normal_numbers(scenario.simulation.seed, [tick], 3 * channels)
        yield scenario.sensing.acceleration_noise * numbers[0, 2 * channels :]


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
