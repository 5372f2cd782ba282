"""A run with continuous control: scipy integrates each phase and locates its end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.references.closed_loop import ClosedLoop
from tests.references.hand import Kinematics
from tests.references.hybrid import (
    REST_SPEED,
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
from tests.references.world import World

Array = NDArray[np.float64]


class Mode(NamedTuple):
    """Phase of the plant, and the belief that the controller holds until a time, if any."""

    phase: tuple[int, ...]
    belief: tuple[int, ...] | None
    until: float


def run_continuous(
    world: World,
    t_final: float,
    times: list[float],
    recognition_time: float = 1e-3,
    stage: Stage | None = None,
    t_start: float = 0.0,
) -> Run:
    """The law acts inside the right-hand side and knows the phase.

    Where no phase is consistent under its own torque, the controller keeps the phase it
    believes in for the recognition time and the plant selects under that torque. A run may go on
    from the stage at which another way of control has left it.
    """
    plain = world.plain
    z, phase, path, changes = initial_stage(plain) if stage is None else stage
    record: dict[float, Array] = {}
    t, mode = t_start, Mode(phase, None, np.inf)
    instants = {*plain.trajectory.breaks, *world.instants()}
    for stop in [*sorted(b for b in instants if t_start < b < t_final), t_final]:
        middle = 0.5 * (t + stop)
        begin = t
        while t < stop:
            sides = world.sides(begin, z)
            loop = world.loop(begin, sides)
            if t >= mode.until:
                mode = _recognise(loop, mode, t, z, middle, recognition_time)
            mode = _select(loop, mode, t, z, middle, recognition_time)
            if mode.phase != changes[-1][1]:
                changes.append((t, mode.phase))
            flow = Flow(loop, mode.phase, middle, belief=mode.belief)
            before = unpack(loop, z)[0].slip
            events = [*guards(flow), *world.edge_guards(sides)]
            t, z = _flow_to_event(flow, t, z, min(stop, mode.until), events, times, record)
            path = path + np.abs(unpack(loop, z)[0].slip - before)
    end = Stage(z, mode.phase, path, changes)
    return Run(changes, path, times, [record[time] for time in times], end)


def _select(
    loop: ClosedLoop, mode: Mode, t: float, z: Array, piece_time: float, recognition_time: float
) -> Mode:
    known: dict[bytes, Kinematics] = {}
    if mode.belief is None:
        phases = select_phases(lambda p: Flow(loop, p, piece_time, known=known), loop, t, z)
        if phases:
            assert len(phases) == 1, f"{phases} are consistent at t = {t}"
            return mode._replace(phase=phases[0])
        mode = Mode(mode.phase, mode.phase, t + recognition_time)
    phases = select_phases(
        lambda p: Flow(loop, p, piece_time, belief=mode.belief, known=known), loop, t, z
    )
    assert len(phases) == 1, f"{phases} are consistent at t = {t}"
    return mode._replace(phase=phases[0])


def _recognise(
    loop: ClosedLoop, mode: Mode, t: float, z: Array, piece_time: float, recognition_time: float
) -> Mode:
    """At the end of a hold the controller learns the plant's phase; it may have to hold that."""
    free = np.abs(unpack(loop, z)[0].slip_velocity) < REST_SPEED
    if Flow(loop, mode.phase, piece_time).is_consistent(t, z, free):
        return Mode(mode.phase, None, np.inf)
    return Mode(mode.phase, mode.phase, t + recognition_time)


def _flow_to_event(
    flow: Flow,
    t: float,
    z: Array,
    stop: float,
    events: list[Guard],
    times: list[float],
    record: dict[float, Array],
) -> tuple[float, Array]:
    solution = solve_ivp(
        flow.derivative,
        (t, stop),
        z,
        method="DOP853",
        rtol=1e-9,
        atol=1e-11,
        events=events,
        dense_output=True,
    )
    end, last = float(solution.t[-1]), solution.y[:, -1].copy()
    record.update({time: solution.sol(time) for time in times if t <= time <= end})
    return end, at_rest(flow.loop, last)
