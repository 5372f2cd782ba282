"""Runs scenarios to the end, and prepares the kernel."""

from __future__ import annotations

from collections.abc import Callable

from slipgrasp.core.awake_clock import AwakeClock
from slipgrasp.core.kernel.compilation.compiler import prepare_units, share_ready
from slipgrasp.core.run.engine import engine_of
from slipgrasp.core.run.result import RunResult, RunSummary
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.space import PLANAR, Space
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.interruptions import describe_stop, describe_wall_limit


def simulate(
    scenario: Scenario,
    *,
    progress: Callable[[float], None] | None = None,
    should_stop: Callable[[], bool] | None = None,
    wall_limit: float | None = None,
) -> RunResult:
    """Runs a scenario to the end.

    Args:
        scenario: Scenario to simulate.
        progress: Called with the simulated fraction, 0 to 1, after every chunk.
        should_stop: Called after every chunk; True ends the run as ``stopped``.
        wall_limit: Elapsed time, without suspensions, after which the run ends as ``limit`` [s].

    Returns:
        The run; physics never raises exceptions, see ``outcome`` and ``reason``.

    Raises:
        ScenarioError: If the scenario cannot be simulated.
    """
    simulation = Simulation(scenario)

    def watch(simulation: Simulation) -> None:
        if progress is not None:
            progress(simulation.progress)

    run_to_end(simulation, watch, should_stop=should_stop, wall_limit=wall_limit)
    return simulation.result()


def run_to_end(
    simulation: Simulation,
    watch: Callable[[Simulation], None],
    *,
    should_stop: Callable[[], bool] | None = None,
    wall_limit: float | None = None,
) -> None:
    """Advances a simulation until it has ended.

    Args:
        simulation: Run to advance.
        watch: Called after every chunk, including the last; it may end the run.
        should_stop: Called after every chunk; True ends the run as ``stopped``.
        wall_limit: Elapsed time, without suspensions, after which the run ends as ``limit`` [s].
    """
    clock = AwakeClock()
    while not simulation.finished:
        simulation.advance()
        watch(simulation)
        if simulation.finished:
            break
        if should_stop is not None and should_stop():
            simulation.end(Outcome.STOPPED, describe_stop(simulation.time))
        elif wall_limit is not None and clock.read() > wall_limit:
            simulation.end(Outcome.LIMIT, describe_wall_limit(simulation.time, wall_limit))


def summarise(scenario: Scenario, should_stop: Callable[[], bool]) -> RunSummary:
    """Runs a scenario to the end without keeping its trace.

    Args:
        scenario: Scenario to simulate.
        should_stop: Called after every chunk; True ends the run as ``stopped``.
    """
    simulation = Simulation(scenario, keep_trace=False)
    run_to_end(simulation, lambda _: None, should_stop=should_stop)
    return simulation.summary()


def prepare_kernel(
    progress: Callable[[float], None] | None = None,
    space: Space = PLANAR,
    *,
    machine_code: bool = False,
) -> None:
    """Loads the kernel; compiles it on first use, in the background if a fallback can run then.

    Args:
        progress: Called with the completed fraction, 0 to 1.
        space: Kind of hand; the kernel of planar hands is always loaded.
        machine_code: Whether to wait for the compiler, as custom laws must.
    """
    engine_of(space)
    prepare_units(progress, machine_code=machine_code)


def kernel_progress(*, machine_code: bool = False) -> float:
    """Fraction of the kernel that can run without being compiled, 0 to 1.

    Args:
        machine_code: Whether machine code is needed, as with a custom law.
    """
    return share_ready(machine_code=machine_code)


def kernel_is_cached(space: Space = PLANAR, *, machine_code: bool = False) -> bool:
    """Whether the next run need not wait for the compiler.

    Args:
        space: The kind of hand of that run.
        machine_code: Whether it needs machine code, as with a custom law.
    """
    engine_of(space)
    return share_ready(machine_code=machine_code) == 1.0
