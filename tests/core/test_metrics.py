"""Metrics: against the rows, against finer rows, and whatever the output rate is."""

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from slipgrasp.core.run.metrics import HOLD_WINDOW, metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.space import PLANAR
from slipgrasp.core.trace.types import ContactPhase, Outcome
from tests.core.drawn_scenarios import KINDS, draw_scenario

CASES = [
    ("paper-case-1", {}),
    ("paper-case-2", {}),
    ("paper-case-2", {"controller.control_period": 0.001, "simulation.duration": 0.5}),
    ("paper-case-2", {"fingers.1.friction": 0.3, "controller.control_period": 0.001}),
    ("paper-case-1", {"controller.grasp_force": "none", "simulation.duration": 1.0}),
    ("composite-case-2-noisy", {"simulation.output_rate": 20.0, "simulation.duration": 0.5}),
    ("spatial-composite", {"simulation.duration": 0.3}),
]
RATE = "simulation.output_rate"
ROUNDING = 1e-8  # of the extremes, which are located inside steps
QUADRATURE = 1e-3  # of the trapezoidal rule on rows 0.1 ms apart


@pytest.fixture(params=CASES, ids=lambda case: f"{case[0]}-{len(case[1])}", scope="module")
def run(request):
    name, values = request.param
    return simulate(with_values(load_scenario(name), values))


@pytest.fixture(scope="module")
def fine(run):
    """The same run with a row every 0.1 ms."""
    return simulate(with_values(run.scenario, {RATE: 10_000.0}))


def numbers(values):
    """A figure, or several, as an array; NaN where there is none."""
    return np.atleast_1d(np.array(values, dtype=float))


def least_margins(trace):
    """The least margin of every contact in the rows in stick, without the stick assumed first."""
    sticking = trace.phase[1:] == ContactPhase.STICK
    return np.where(sticking, trace.friction_margin[1:], np.inf).min(axis=0)


def test_no_row_has_a_larger_force_or_a_smaller_margin_than_the_metrics_state(run, fine):
    for trace in (run.trace, fine.trace):
        metrics = (run if trace is run.trace else fine).metrics
        assert (trace.normal_force.max(axis=0) <= metrics.peak_normal_force).all()
        for stated, row in zip(metrics.minimum_friction_margin, least_margins(trace), strict=True):
            assert row == np.inf if stated is None else stated <= row


def test_extremes_are_those_of_the_motion_between_the_rows_too(run, fine):
    peak, margin = run.metrics.peak_normal_force, run.metrics.minimum_friction_margin
    np.testing.assert_allclose(peak, fine.trace.normal_force.max(axis=0), rtol=2e-3)
    expected = [
        None if m == np.inf else pytest.approx(m, abs=0.01) for m in least_margins(fine.trace)
    ]
    assert list(margin) == expected


def test_integrals_are_those_of_much_finer_rows(run, fine):
    trace, metrics = fine.trace, run.metrics
    squared = np.trapezoid(trace.tracking_error**2, trace.times, axis=0)
    rms = np.sqrt(squared / (trace.times[-1] - trace.times[0]))
    np.testing.assert_allclose(metrics.rms_tracking_error, rms, rtol=QUADRATURE, atol=1e-12)
    effort = np.trapezoid((trace.joint_torque**2).sum(axis=1), trace.times)
    assert metrics.torque_effort == pytest.approx(effort, rel=QUADRATURE)


def test_slip_path_and_last_error_are_those_of_the_rows(run):
    trace, metrics = run.trace, run.metrics
    if trace.shape.space is PLANAR:
        path = np.abs(np.diff(trace.slip, axis=0)).sum(axis=0)
        np.testing.assert_allclose(metrics.slip_path, path, rtol=1e-9, atol=1e-15)
    assert list(metrics.final_tracking_error) == trace.tracking_error[-1].tolist()


def assert_same_at_every_rate(scenario, exact=()):
    """All metrics to rounding, some to the last bit."""
    runs = [simulate(with_values(scenario, {RATE: rate})) for rate in (20.0, 1000.0, 10_000.0)]
    first = asdict(runs[0].metrics)
    for other in runs[1:]:
        for name, value in asdict(other.metrics).items():
            if name in exact:
                assert value == first[name], name
            else:
                np.testing.assert_allclose(
                    numbers(value), numbers(first[name]), rtol=ROUNDING, atol=ROUNDING
                )


def test_a_margin_is_least_where_the_grasp_force_reaches_a_limit_late_in_a_step():
    """The kink is behind the last slope of the step, so no value taken there shows it."""
    changes: dict[str, Any] = {
        "controller.kind": "certainty-equivalence",
        "controller.control_period": 0.0,
        "controller.minimum_normal_force": 26.9,
        "controller.grip_safety": 2.0,
        "trajectory.kind": "shake",
        "trajectory.amplitude": [0.007, 0.003, 0.003],
        "trajectory.period": 0.18,
        "trajectory.acceleration_time": 0.08,
        "trajectory.cycles": 1.0,
        "simulation.duration": 0.3,
    }
    assert_same_at_every_rate(with_values(load_scenario("paper-case-2"), changes))


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_no_metric_of_a_random_planar_run_depends_on_the_output_rate(kind):
    assert_same_at_every_rate(draw_scenario(kind, 4))


def test_held_means_completed_and_at_rest_for_half_a_second(run):
    trace, metrics = run.trace, run.metrics
    slipping = (trace.phase != ContactPhase.STICK).any(axis=1)
    late = trace.times > trace.times[-1] - HOLD_WINDOW
    assert metrics.slipping_at_end == slipping[-1]
    held = run.outcome is Outcome.COMPLETED and not slipping[late].any()
    assert metrics.held == (None if held and trace.times[-1] < HOLD_WINDOW else held)
    assert metrics.phase_change_count == len(run.phase_changes)
    ends = [c.time for c in run.phase_changes if c.to_phase is ContactPhase.STICK]
    expected = trace.times[-1] if slipping[-1] else max(ends, default=None)
    assert metrics.last_slip_time == expected


@pytest.mark.parametrize(
    ("law", "duration", "held"),
    [
        ("theorem-4", 0.4, False),
        ("pd-gravity", 0.4, None),
        ("pd-gravity", 0.5, True),
        ("pd-gravity", 1.0, True),
    ],
)
def test_a_run_shorter_than_half_a_second_holds_only_if_that_can_be_told(law, duration, held):
    values = {"controller.kind": law, "controller.grip_force": 50.0}
    scenario = with_values(
        load_scenario("paper-case-2"), {**values, "simulation.duration": duration}
    )

    run = simulate(scenario)

    rate = scenario.simulation.output_rate
    stored = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate)
    assert run.outcome is Outcome.COMPLETED
    assert run.metrics.held is stored.held is held


def test_metrics_of_samples_are_sums_and_extremes_of_the_rows_at_output_times_and_events(run):
    rate = run.scenario.simulation.output_rate
    found = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate)
    ticks = run.trace.times * rate
    at_output_time = np.abs(ticks - np.round(ticks)) < 1e-9
    times = run.trace.times
    at_event = (np.diff(times, prepend=-1.0) == 0.0) | (np.diff(times, append=99.0) == 0.0)
    trace = run.trace[np.flatnonzero(at_output_time | at_event)]
    effort = np.trapezoid((trace.joint_torque**2).sum(axis=1), trace.times)
    assert found.torque_effort == pytest.approx(effort, rel=1e-12)
    np.testing.assert_allclose(found.peak_normal_force, trace.normal_force.max(axis=0), rtol=1e-12)
    exact = ("held", "slipping_at_end", "last_slip_time", "phase_change_count")
    assert [getattr(found, name) for name in exact] == [getattr(run.metrics, n) for n in exact]
    assert replace(found, held=None).final_tracking_error == run.metrics.final_tracking_error
