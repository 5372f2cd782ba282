"""Every slip is seen: at least 50 rows, on the way that the run goes without them."""

from __future__ import annotations

import numpy as np
import pytest

from slipgrasp.core.run import computation
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import SPATIAL
from slipgrasp.core.scenario.loading import (
    load_scenario,
    preset_names,
    with_values,
)
from slipgrasp.core.trace.types import ContactPhase, Outcome

LEAST = 50
DOWN = "pulses.0.force"
PUSHED = {"pulses.0.time": 0.4, DOWN: -30.0, "pulses.0.duration": 0.004}
POURED = {"changes.0.time": 0.02, "changes.0.parameter": "object.mass", "changes.0.value": 1.4}


def slips_of(run: RunResult):
    """Contact, begin and end of every slip that has come to its end."""
    begun = {}
    for change in run.phase_changes:
        if change.from_phase is not ContactPhase.STICK:
            yield change.contact, begun.pop(change.contact), change.time
        if change.to_phase is not ContactPhase.STICK:
            begun[change.contact] = change.time


def rows_within(run: RunResult, begin: float, end: float) -> int:
    times = run.trace.times
    return int(((times >= begin) & (times <= end)).sum())


@pytest.mark.parametrize(
    ("name", "values"),
    [
        *((name, {}) for name in (*preset_names(), *preset_names(SPATIAL))),
        *((name, PUSHED) for name in (*preset_names()[::3], *preset_names(SPATIAL)[::3])),
        *((name, POURED) for name in (*preset_names()[1::3], *preset_names(SPATIAL)[1::3])),
    ],
)
def test_every_slip_has_fifty_rows_however_short_it_is(name: str, values: dict) -> None:
    preset = load_scenario(name)
    down = f"{DOWN}.{preset.space.num_positions - 1}"
    values = {down if key == DOWN else key: value for key, value in values.items()}
    scenario = with_values(preset, {"simulation.duration": 4.0, **values})
    slips = list(slips_of(run := simulate(scenario)))
    # A gripper that does not answer to slip loses what is too heavy for it: that slip has no end.
    assert slips or run.outcome is Outcome.LEFT_FACE
    for _, begin, end in slips:
        # Closer than a microsecond no two rows lie.
        wanted = min(LEAST, int((end - begin) / 2e-6))
        assert rows_within(run, begin, end) >= wanted


def test_a_slip_of_milliseconds_is_parabolic_between_its_rows() -> None:
    """Its rows agree with each other: slip is the integral of its velocity."""
    run = simulate(with_values(load_scenario("composite-case-2"), {"simulation.duration": 0.1}))
    trace = run.trace
    for contact, begin, end in slips_of(run):
        assert end - begin < 0.01
        rows = np.flatnonzero((trace.times > begin) & (trace.times < end))
        times, slip = trace.times[rows], trace.slip[rows, contact]
        rate, curve = trace.slip_velocity[rows, contact], trace.slip_acceleration[rows, contact]
        steps = np.diff(times)
        # Hermite's quadrature with end corrections; where a tick lies between two rows, the
        # acceleration jumps, which leaves 1e-8 m.
        by_rate = 0.5 * steps * (rate[1:] + rate[:-1]) + steps**2 / 12 * (curve[:-1] - curve[1:])
        np.testing.assert_allclose(np.diff(slip), by_rate, atol=2e-8)
        assert (np.sign(rate[1:-1]) == trace.phase[rows[1:-1], contact]).all()


def test_the_rows_of_a_slip_lie_where_a_run_with_more_output_has_them() -> None:
    """At one time the run holds one state, whichever rows are written."""
    scenario = with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.2})
    run = simulate(scenario)
    close = simulate(with_values(scenario, {"simulation.output_rate": 200.0 * 2**5}))
    ours, theirs = (each.trace.to_rows()[_apart_from_events(each)] for each in (run, close))
    ours = ours[np.isin(ours[:, 0], theirs[:, 0])]
    theirs = theirs[np.isin(theirs[:, 0], ours[:, 0])]
    assert len(ours) > 60
    np.testing.assert_allclose(ours, theirs, rtol=1e-6, atol=1e-6)


def _apart_from_events(run: RunResult) -> np.ndarray:
    times, counts = np.unique(run.trace.times, return_counts=True)
    return np.isin(run.trace.times, times[counts == 1])


@pytest.mark.parametrize(
    "name",
    ["unequal-fingers", "spatial-composite", "spatial-pyramid", "spinning-slide", "push-slider"],
)
def test_metrics_are_those_of_the_run_that_keeps_no_rows(name: str) -> None:
    scenario = load_scenario(name)
    run = simulate(scenario)
    bare = Simulation(scenario, keep_trace=False)
    while not bare.finished:
        bare.advance()
    assert run.metrics == bare.summary().metrics


def test_a_run_that_slips_at_every_tick_keeps_a_bounded_number_of_rows() -> None:
    values = {"simulation.duration": 2.0, "controller.control_period": 0.001}
    noisy = {"sensing.velocity_noise": 0.02, "sensing.true_phases": False}
    base = with_values(load_scenario("paper-case-2"), values)
    run = simulate(with_values(base, noisy))
    few = len(run.phase_changes) * 3 + 2.0 * 200.0 + 5100
    assert len(run.trace) <= few


def test_rows_that_were_read_while_the_run_goes_on_stay_as_they_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = simulate(load_scenario("paper-case-1")).trace.to_rows()
    monkeypatch.setattr(computation, "_STEPS_PER_PIECE", 3)
    simulation = Simulation(load_scenario("paper-case-1"))
    seen = []
    while not simulation.finished:
        simulation.advance()
        seen.append(simulation.trace_from(sum(map(len, seen))).to_rows())
    np.testing.assert_array_equal(np.concatenate(seen), whole)
    np.testing.assert_array_equal(simulation.result().trace.to_rows(), whole)
