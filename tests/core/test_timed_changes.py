"""Parameters that change at a stated time during a run."""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome

CASE_2 = load_scenario("paper-case-2")


def change(t, parameter, value, index=0):
    key = f"changes.{index}"
    return {f"{key}.time": t, f"{key}.parameter": parameter, f"{key}.value": value}


def grid_rows(trace, t_from, t_to):
    """Rows of the output grid that are no event, by index."""
    on_grid = np.abs(trace.times * 200.0 - np.round(trace.times * 200.0)) < 1e-6
    single = np.ones(len(trace), dtype=bool)
    twice = np.flatnonzero(np.diff(trace.times) == 0.0)
    single[twice] = single[twice + 1] = False
    return np.flatnonzero(on_grid & single & (trace.times > t_from) & (trace.times < t_to))


@pytest.mark.parametrize("period", [0.0, 0.001])
def test_slip_starts_when_friction_drops(period):
    drop = change(3.0, "fingers.0.friction", 0.1)
    values = {**drop, "controller.control_period": period, "simulation.duration": 3.05}
    result = simulate(with_values(CASE_2, values))
    plain = simulate(with_values(CASE_2, {"controller.control_period": period}))
    late = [c for c in result.phase_changes if c.time > 1.0]
    assert late[0].time == 3.0
    assert late[0].contact == 0
    assert late[0].to_phase is not ContactPhase.STICK
    trace = result.trace
    assert np.all(trace.friction_coefficient[trace.times < 3.0] == 0.25)
    assert np.all(trace.friction_coefficient[trace.times > 3.0, 0] == 0.1)
    at = np.flatnonzero(trace.times == 3.0)
    assert trace.friction_coefficient[at[0], 0] == 0.25
    assert trace.friction_coefficient[at[-1], 0] == 0.1
    assert trace.phase[at[0], 0] == ContactPhase.STICK
    assert trace.phase[at[-1], 0] == late[0].to_phase
    mine, other = grid_rows(trace, 0.0, 3.0), grid_rows(plain.trace, 0.0, 3.0)
    np.testing.assert_allclose(
        trace.object_pose[mine], plain.trace.object_pose[other], rtol=0.0, atol=1e-12
    )


@pytest.mark.parametrize("period", [0.0, 0.001])
@pytest.mark.parametrize("t", [0.0505, 3.0])
def test_a_change_to_the_same_value_changes_nothing(period, t):
    values = {"controller.control_period": period}
    plain = simulate(with_values(CASE_2, values)).trace
    same = simulate(with_values(CASE_2, {**values, **change(t, "object.mass", 1.0)})).trace
    mine, other = grid_rows(same, t, 7.0), grid_rows(plain, t, 7.0)
    rows = np.intersect1d(np.round(same.times[mine], 6), np.round(plain.times[other], 6))
    mine = mine[np.isin(np.round(same.times[mine], 6), rows)]
    other = other[np.isin(np.round(plain.times[other], 6), rows)]
    assert len(rows) > 500
    for name in ("object_pose", "slip", "estimates", "normal_force", "tracking_error"):
        np.testing.assert_allclose(
            getattr(same, name)[mine], getattr(plain, name)[other], rtol=1e-7, atol=1e-8
        )


def test_the_controller_can_be_changed_too():
    values = {
        **change(1.5, "controller.kind", "theorem-3", 0),
        **change(1.5, "controller.position_gain", 200.0, 1),
        **change(2.5, "controller.control_period", 0.001, 2),
        **change(3.5, "controller.control_period", 0.0, 3),
        **change(4.5, "controller.grip_safety", 1.5, 4),
        **change(5.5, "estimates.2.initial", 1.0, 5),
    }
    result = simulate(with_values(CASE_2, values))
    trace = result.trace
    assert result.outcome is Outcome.COMPLETED
    assert result.metrics.held
    squeeze = trace.normal_force[:, 0]
    before, after = squeeze[trace.times < 4.5][-1], squeeze[trace.times > 4.6][0]
    assert after == pytest.approx(1.5 * before, rel=0.02)
    at = np.flatnonzero(trace.times == 5.5)
    assert trace.estimates[at[-1], 2] == 1.0
    assert trace.estimates[at[0], 2] != 1.0


def test_changes_take_effect_in_order_of_time_however_they_are_listed():
    a = {**change(1.0, "object.mass", 1.2, 0), **change(2.0, "object.mass", 0.9, 1)}
    b = {**change(2.0, "object.mass", 0.9, 0), **change(1.0, "object.mass", 1.2, 1)}
    first, second = (simulate(with_values(CASE_2, values)).trace for values in (a, b))
    assert first.to_rows().tobytes() == second.to_rows().tobytes()


def test_several_changes_at_one_instant_act_together():
    values = {
        **change(1.0, "fingers.0.friction", 0.4, 0),
        **change(1.0, "fingers.1.friction", 0.4, 1),
    }
    result = simulate(with_values(CASE_2, values))
    assert result.metrics.held
    late = [c for c in result.phase_changes if c.time > 0.5]
    assert late == []
