"""Desired motions: against scipy, closed forms and their own derivatives; and what is refused."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import MAX_SET_POINTS, MAX_TABLE_ROWS
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from tests.references.trajectory import trajectory_of
from tests.state_evaluation import evaluate_motion

START = (1.466, 0.366, 0.0)
NEXT = (1.5, 0.4, 0.1)

MOTIONS = {
    "coast": {"acceleration": (0.1, 0.2, 0.3), "acceleration_time": 0.5, "coast_time": 0.5},
    "set-points": {
        "set_points": [
            {"time": 0.1, "duration": 0.5, "pose": NEXT},
            {"time": 0.6, "duration": 0.4, "pose": (1.45, 0.38, -0.05)},
            {"time": 1.2, "duration": 0.3, "pose": START},
        ]
    },
    "circle": {"acceleration_time": 0.7, "period": 1.0, "cycles": 2.0, "radius": 0.04},
    "rotation": {"acceleration_time": 0.3, "period": 1.2, "cycles": 1.0, "angle": 0.2},
    "shake": {
        "acceleration_time": 0.8,
        "period": 0.4,
        "cycles": 4.25,
        "amplitude": (0.01, 0.02, 0.05),
    },
    "table": {
        "table": [(0.0, *START), (0.4, *NEXT), (0.9, 1.44, 0.38, 0.0), (1.7, 1.46, 0.36, -0.1)]
    },
}
OVER = 3.0  # all of them rest by then [s]


def moving(kind, **values):
    """Case I with known masses and some distance from the cones, moved in another way."""
    mapping = load_scenario("paper-case-1").to_mapping()
    mapping["estimates"] = []
    mapping["controller"] |= {"grip_safety": 1.5}
    mapping["simulation"] |= {"duration": OVER}
    mapping["trajectory"] = {"kind": kind, "start": START, **(values or MOTIONS[kind])}
    return scenario_from_mapping(mapping)


poses = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


@st.composite
def trajectories(draw):
    """Any motion that a user may ask for, as plain values."""
    kind = draw(st.sampled_from(list(MOTIONS)))
    if kind == "coast":
        return {
            "kind": kind,
            "acceleration": draw(poses),
            "acceleration_time": draw(st.floats(0.01, 2.0)),
            "coast_time": draw(st.floats(0.0, 2.0)),
        }
    if kind == "set-points":
        gap, length = st.one_of(st.just(0.0), st.floats(1e-6, 1.0)), st.floats(0.05, 2.0)
        points, now = [], 0.0
        for _ in range(draw(st.integers(1, 6))):
            time, duration = now + draw(gap), draw(length)
            points.append({"time": time, "duration": duration, "pose": draw(poses)})
            now = time + duration
        return {"kind": kind, "set_points": points}
    if kind == "table":
        rows = draw(st.lists(st.tuples(st.floats(0.05, 1.0), poses), min_size=1, max_size=12))
        times = np.cumsum([step for step, _ in rows]).tolist()
        later = [(t, *pose) for t, (_, pose) in zip(times, rows, strict=True)]
        return {"kind": kind, "table": [(0.0, *START), *later]}
    period, cycles = draw(st.floats(0.1, 3.0)), draw(st.floats(0.3, 5.0))
    return {
        "kind": kind,
        "period": period,
        "cycles": cycles,
        "acceleration_time": cycles * period * draw(st.one_of(st.just(1.0), st.floats(0.1, 0.99))),
        "radius": draw(st.floats(0.0, 0.3)),
        "angle": draw(st.floats(-1.0, 1.0)),
        "amplitude": draw(poses),
    }


SHORT_REST = {
    "kind": "set-points",
    "set_points": [
        {"time": start, "duration": 1.0, "pose": (0.0, 0.0, 0.0)}
        for start in (1e-5, 1.00001, 2.00001)
    ],
}


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(trajectories(), st.lists(st.floats(0.0, 1.2), min_size=1, max_size=8))
@example(SHORT_REST, [5.960464477539063e-08])
def test_any_motion_is_that_of_scipy_and_continuous_at_all_its_breaks(values, shares):
    scenario = moving(**values)
    reference = trajectory_of(scenario.trajectory)
    for k, t in enumerate(reference.breaks):
        before, after = (evaluate_motion(scenario, float(t), piece) for piece in (k, k + 1))
        np.testing.assert_allclose(before[:2], after[:2], rtol=1e-9, atol=1e-9)
    ends = np.concatenate(([0.0], reference.breaks))
    for share in shares:
        t = share * float(ends[-1])
        if np.min(np.abs(ends - t)) > 1e-8:
            expected = np.array(reference.desired(t))
            scale = 1.0 + np.max(np.abs(expected), axis=1, keepdims=True)
            error = np.abs(evaluate_motion(scenario, t) - expected) / scale
            # SciPy's polynomial of a short piece rounds its pose, and that twice over its length.
            piece = min(max(int(np.searchsorted(ends, t)), 1), len(ends) - 1)
            length = ends[piece] - ends[piece - 1]
            rounding = np.finfo(float).eps / np.array([1.0, length, length**2])
            assert (error <= 1e-9 + rounding[:, None]).all(), error


@pytest.mark.parametrize("kind", MOTIONS)
def test_motion_begins_at_rest_at_the_start_and_ends_at_rest(kind):
    scenario = moving(kind)
    begin, end = evaluate_motion(scenario, 0.0), evaluate_motion(scenario, OVER)
    np.testing.assert_array_equal(begin[0], START)
    np.testing.assert_array_equal(begin[1], 0.0)
    np.testing.assert_array_equal(end[1:], 0.0)
    np.testing.assert_array_equal(evaluate_motion(scenario, 100.0), end)


def test_a_move_between_set_points_has_the_least_jerk():
    """Half way at half time, at 15/8 of the mean speed, with no acceleration there or at the ends.

    The second move begins when the first is over, but for rounding: no rest between them.
    """
    points = [
        {"time": 0.1, "duration": 0.2, "pose": NEXT},
        {"time": 0.3, "duration": 1.0, "pose": START},
    ]
    scenario = moving("set-points", set_points=points)
    way = np.subtract(START, NEXT)
    middle = evaluate_motion(scenario, 0.8)
    np.testing.assert_allclose(middle[0], np.add(START, NEXT) / 2.0, atol=1e-12)
    np.testing.assert_allclose(middle[1], 15.0 / 8.0 * way, atol=1e-12)
    for piece, t in ((0, 0.1), (1, 0.1), (1, 0.3), (2, 0.3), (2, 0.8), (2, 1.3), (3, 1.3)):
        np.testing.assert_allclose(evaluate_motion(scenario, t, piece)[2], 0.0, atol=1e-11)
    greatest = max(evaluate_motion(scenario, t)[2][1] for t in np.linspace(0.301, 1.299, 2001))
    assert greatest == pytest.approx(10.0 / 3.0**0.5 * abs(way[1]), rel=1e-5)


def test_a_circle_is_round_begins_at_its_bottom_and_has_its_period():
    scenario = moving("circle")
    x, y, _ = START
    for t in np.linspace(0.0, OVER, 100):
        pose, velocity, acceleration = evaluate_motion(scenario, t)
        arm = pose[:2] - (x, y + 0.04)
        assert np.hypot(*arm) == pytest.approx(0.04, rel=1e-12)
        assert velocity[:2] @ arm == pytest.approx(0.0, abs=1e-12)
        if 0.7 < t < 2.0:
            assert np.hypot(*velocity[:2]) == pytest.approx(2.0 * np.pi * 0.04, rel=1e-12)
            np.testing.assert_allclose(acceleration[:2], -((2.0 * np.pi) ** 2) * arm, rtol=1e-9)
    assert evaluate_motion(scenario, 0.5)[1, 0] > 0.0  # counter-clockwise
    np.testing.assert_allclose(evaluate_motion(scenario, OVER)[0], START, atol=1e-12)


def test_a_rotation_turns_to_its_angle_and_back_on_the_spot():
    scenario = moving("rotation")
    angles = [evaluate_motion(scenario, t)[0, 2] for t in np.linspace(0.0, OVER, 3001)]
    assert max(angles) == pytest.approx(0.2, abs=1e-6)
    assert min(angles) >= 0.0
    np.testing.assert_allclose(evaluate_motion(scenario, OVER)[0], START, atol=1e-12)


def test_a_shake_may_end_at_its_turning_point():
    """A quarter of a cycle on top of whole ones."""
    end = evaluate_motion(moving("shake"), OVER)[0]
    np.testing.assert_allclose(end, np.add(START, (0.01, 0.02, 0.05)), atol=1e-12)


def test_a_table_of_one_row_rests():
    scenario = moving("table", table=[(0.0, *START)])
    np.testing.assert_array_equal(evaluate_motion(scenario, 2.0), [START, (0,) * 3, (0,) * 3])


def test_as_many_rows_and_moves_as_are_allowed_fit():
    times = 0.01 * np.arange(MAX_TABLE_ROWS)
    table = [(t, 1.466 + 0.01 * np.sin(t) ** 2, 0.366, 0.0) for t in times.tolist()]
    scenario = moving("table", table=table)
    np.testing.assert_allclose(evaluate_motion(scenario, 100.0)[0], table[-1][1:], atol=1e-13)
    moves = [{"time": 2.0 * k + 1, "duration": 1.0, "pose": NEXT} for k in range(MAX_SET_POINTS)]
    scenario = moving("set-points", set_points=moves)
    np.testing.assert_allclose(evaluate_motion(scenario, 300.0)[0], NEXT, atol=1e-13)


@pytest.mark.parametrize("kind", MOTIONS)
def test_a_hand_that_knows_everything_follows_any_motion(kind):
    """Identity 5: without an error at the start there is none later, but for the integration's."""
    fine = {"simulation.relative_tolerance": 1e-11, "simulation.absolute_tolerance": 1e-13}
    scenario = with_values(moving(kind), fine)
    result = simulate(scenario)
    assert result.metrics.held
    assert result.phase_changes == ()
    trace = result.trace
    np.testing.assert_allclose(trace.tracking_error, 0.0, atol=1e-10)
    reference = trajectory_of(scenario.trajectory)
    desired = [reference.desired(float(t))[0] for t in trace.times]
    np.testing.assert_allclose(trace.desired_pose, desired, atol=1e-10)
    assert np.ptp(trace.object_pose, axis=0).max() > 0.01


@pytest.mark.parametrize("kind", MOTIONS)
def test_error_under_sampled_control_is_in_proportion_to_its_period(kind):
    """The torque is held for a period during which the demand moves on."""
    errors = []
    for period in (0.002, 0.001):
        trace = simulate(with_values(moving(kind), {"controller.control_period": period})).trace
        errors.append(np.max(np.abs(trace.tracking_error)))
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)


SET_POINTS = [{"time": 0.0, "duration": 1.0, "pose": NEXT}] * 2
REFUSED = {
    "no set-points": ("set-points", {"set_points": []}, "trajectory.set_points", 0),
    "overlapping": ("set-points", {"set_points": SET_POINTS}, "trajectory.set_points.1.time", 0.0),
    "out of order": (
        "set-points",
        {"set_points": MOTIONS["set-points"]["set_points"][::-1]},
        "trajectory.set_points.1.time",
        0.6,
    ),
    "no table": ("table", {"table": []}, "trajectory.table", 0),
    "late table": ("table", {"table": [(0.5, *START)]}, "trajectory.table.0.0", 0.5),
    "table elsewhere": ("table", {"table": [(0.0, *NEXT)]}, "trajectory.table.0.1", 1.5),
    "standing time": (
        "table",
        {"table": [(0.0, *START), (0.5, *NEXT), (0.5, *START)]},
        "trajectory.table.2.0",
        0.5,
    ),
    "time goes back": (
        "table",
        {"table": [(0.0, *START), (0.5, *NEXT), (0.4, *START)]},
        "trajectory.table.2.0",
        0.4,
    ),
    "no room": ("circle", {"period": 1.0, "cycles": 0.5}, "trajectory.cycles", 0.5),
    "a jerk": ("rotation", {"acceleration_time": 0.0}, "trajectory.acceleration_time", 0.0),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_motion_that_jumps_is_refused_with_field_value_limit_and_way_out(name):
    kind, values, field, value = REFUSED[name]
    with pytest.raises(ScenarioError) as caught:
        moving(kind, **values)
    error = caught.value.errors[0]
    assert (error.field, error.value) == (field, value)
    assert error.limit
    assert field in error.message
    assert ";" in error.message  # what to do instead


def test_fields_of_other_kinds_do_not_matter():
    values = {"cycles": 0.1, "table": [(3.0, *NEXT)], "set_points": SET_POINTS}
    result = evaluate_motion(moving("coast", **values), 0.5)
    np.testing.assert_array_equal(result, evaluate_motion(moving("coast", cycles=1.0), 0.5))


def test_set_points_are_added_by_their_keys():
    base = load_scenario("paper-case-1")
    values = {
        "trajectory.kind": "set-points",
        "trajectory.set_points.0.time": 0.5,
        "trajectory.set_points.0.duration": 1.0,
        "trajectory.set_points.0.pose": list(NEXT),
    }
    (point,) = with_values(base, values).trajectory.set_points
    assert (point.time, point.duration, point.pose) == (0.5, 1.0, NEXT)


@pytest.mark.parametrize(
    ("fields", "kind"),
    [
        ({}, "coast"),
        ({"acceleration_time": 0.5}, "coast"),
        (
            {"set_points": [{"time": 0.1, "duration": 1.0, "pose": [1.466, 0.37, 0.0]}]},
            "set-points",
        ),
        ({"radius": 0.01, "period": 1.0}, "circle"),
    ],
)
def test_a_motion_without_its_kind_is_the_one_that_uses_its_fields(fields, kind):
    mapping = load_scenario("paper-case-1").to_mapping()
    scenario = scenario_from_mapping(mapping | {"trajectory": {"start": START, **fields}})
    assert scenario.trajectory.kind == kind


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"period": 1.0}, "and trajectory has period; choose one of circle, rotation, shake"),
        ({"radius": 0.1, "angle": 0.1}, "has radius, angle; choose one of circle, rotation"),
    ],
)
def test_fields_that_several_kinds_or_none_use_need_a_kind(fields, told):
    with pytest.raises(ScenarioError, match=told):
        scenario_from_mapping({"trajectory": fields})
