"""Metrics, which the kernel adds up row by row, against NumPy on the stored trace."""

from dataclasses import asdict

import numpy as np
import pytest

from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome

CASES = [
    ("paper-case-1", {}),
    ("paper-case-2", {}),
    ("paper-case-2", {"controller.control_period": 0.001, "simulation.duration": 0.5}),
    ("paper-case-2", {"fingers.1.friction": 0.3, "controller.control_period": 0.001}),
    ("paper-case-1", {"controller.grasp_force": "none", "simulation.duration": 1.0}),
    ("paper-case-2", {"simulation.duration": 0.1}),
]


@pytest.fixture(params=CASES, ids=lambda case: f"{case[0]}-{len(case[1])}", scope="module")
def run(request):
    name, values = request.param
    return simulate(with_values(load_scenario(name), values))


def without_rows_inside_slips(run):
    """The rows at output times and events, which a run has that keeps no rows of short slips."""
    times = run.trace.times
    ticks = times * run.scenario.simulation.output_rate
    at_output_time = np.abs(ticks - np.round(ticks)) < 1e-9
    at_event = (np.diff(times, prepend=-1.0) == 0.0) | (np.diff(times, append=99.0) == 0.0)
    return run.trace[np.flatnonzero(at_output_time | at_event)]


def assert_close(actual, expected):
    np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-15)


def test_sums_and_extremes_are_those_of_the_rows(run):
    trace, metrics = without_rows_inside_slips(run), run.metrics
    assert_close(metrics.slip_path, np.abs(np.diff(trace.slip, axis=0)).sum(axis=0))
    assert_close(metrics.peak_normal_force, trace.normal_force.max(axis=0))
    squared = np.trapezoid(trace.tracking_error**2, trace.times, axis=0)
    assert_close(metrics.rms_tracking_error, np.sqrt(squared / (trace.times[-1] - trace.times[0])))
    assert_close(metrics.final_tracking_error, trace.tracking_error[-1])
    assert_close(
        metrics.torque_effort,
        np.trapezoid((trace.joint_torque**2).sum(axis=1), trace.times),
    )


def test_least_margin_is_that_of_sticking_rows_after_the_assumed_first(run):
    trace = without_rows_inside_slips(run)
    for contact, least in enumerate(run.metrics.minimum_friction_margin):
        sticking = trace.phase[1:, contact] == ContactPhase.STICK
        margins = trace.friction_margin[1:, contact][sticking]
        assert least == (margins.min() if len(margins) else None)


def test_held_means_completed_and_at_rest_for_half_a_second(run):
    trace, metrics = run.trace, run.metrics
    slipping = (trace.phase != ContactPhase.STICK).any(axis=1)
    late = trace.times > trace.times[-1] - 0.5
    assert metrics.slipping_at_end == slipping[-1]
    assert metrics.held == (run.outcome is Outcome.COMPLETED and not slipping[late].any())
    assert metrics.phase_change_count == len(run.phase_changes)
    ends = [c.time for c in run.phase_changes if c.to_phase is ContactPhase.STICK]
    expected = trace.times[-1] if slipping[-1] else max(ends, default=None)
    assert metrics.last_slip_time == expected


def test_a_stored_trace_gives_the_metrics_that_the_kernel_added_up(run):
    rate = run.scenario.simulation.output_rate
    found = asdict(metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate))
    for name, expected in asdict(run.metrics).items():
        if isinstance(expected, tuple) and None not in expected:
            assert_close(found[name], expected)
        elif isinstance(expected, float):
            assert found[name] == pytest.approx(expected, rel=1e-12)
        else:
            assert found[name] == expected, name
