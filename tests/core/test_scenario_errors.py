"""Bad input: one clear error per wrong field, naming field, value and limit."""

import json
import math
import re

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values

CASE = load_scenario("paper-case-1")


def errors_of(values):
    with pytest.raises(ScenarioError) as caught:
        with_values(CASE, values)
    return caught.value.errors


def mapping():
    return json.loads(json.dumps(CASE.to_mapping()))


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, -math.inf, 1e-310, 1e300])
@pytest.mark.parametrize("key", ["object.mass", "object.inertia", "fingers.0.link_masses.1"])
def test_masses_must_be_positive_finite_and_within_bounds(key, value):
    (error,) = errors_of({key: value})
    assert error.field == key
    assert error.limit is not None
    assert key in error.message
    assert str(error.limit) in error.message


@pytest.mark.parametrize("value", ["1.0", True, None, [1.0], {"a": 1}, 10**4000])
def test_a_number_must_be_a_number(value):
    (error,) = errors_of({"object.inertia": value} if value is not None else {"object.mass": "x"})
    assert error.field in ("object.inertia", "object.mass")
    assert len(error.message) < 500


def test_an_unknown_key_is_answered_with_the_nearest_name():
    (error,) = errors_of({"object.masss": 1.0})
    assert "object.masss" in error.message
    assert "did you mean 'object.mass'?" in error.message


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"pulses": [{"time": 0.1, "force": [1.0, 2.0]}]},
            "unknown parameter 'pulses'; a rail scenario has title, object, rail, finger, "
            "trajectory, controller, simulation, changes",
        ),
        ({"trajectory.start": [0.0, 0.1]}, "trajectory.start has 2 items; allowed: at most 1"),
    ],
)
def test_what_a_rail_lacks_is_answered_with_what_it_has(values, message):
    with pytest.raises(ScenarioError) as caught:
        with_values(load_scenario("push-slider"), values)
    assert str(caught.value) == message


def test_an_unknown_field_in_a_file_is_answered_with_the_nearest_name():
    wrong = mapping()
    wrong["controller"]["grip_safty"] = 1.2
    with pytest.raises(ScenarioError) as caught:
        scenario_from_mapping(wrong)
    (error,) = caught.value.errors
    assert error.field == "controller.grip_safty"
    assert "grip_safety" in error.message


def test_every_wrong_field_is_reported_at_once():
    errors = errors_of({"object.mass": -1.0, "fingers.1.friction": -0.1, "fingers.0.face": "front"})
    assert {e.field for e in errors} == {"object.mass", "fingers.1.friction", "fingers.0.face"}


@pytest.mark.parametrize(
    "key",
    [
        "fingers.2.friction",
        "fingers.x.friction",
        "object.mass.0",
        "",
        ".",
        "object..mass",
        "estimates.7.initial",
        "x" * 5000,
        "\ud800",
        "object",
    ],
)
def test_keys_that_lead_nowhere_are_refused(key):
    errors = errors_of({key: 1.0})
    assert errors
    assert all(len(e.message) < 500 for e in errors)


def test_a_pose_out_of_reach_is_refused_with_distance_and_reach():
    (error,) = errors_of({"fingers.0.base": [-5.0, 0.0]})
    assert error.field == "fingers.0.base"
    assert error.limit == "0 … 2 m"
    assert error.value == pytest.approx(math.hypot(6.366, 0.366), rel=1e-3)
    assert "cannot reach" in error.message


def test_a_straight_arm_at_the_start_is_refused_as_singular():
    (error,) = errors_of({"fingers.0.base": [1.366 - 2.0 + 1e-9, 0.366]})
    assert error.field == "fingers.0.base"
    assert "singular" in error.message


def test_finger_masses_and_friction_cannot_be_unknown_at_once():
    extra = {"parameter": "fingers.0.friction", "initial": 0.5}
    wrong = mapping()
    wrong["estimates"].append(extra)
    with pytest.raises(ScenarioError, match="bilinear") as caught:
        scenario_from_mapping(wrong)
    assert [e.field for e in caught.value.errors] == ["estimates"]


def test_only_masses_inertia_and_friction_can_be_estimated():
    (error,) = errors_of({"estimates.0.parameter": "object.half_width"})
    assert error.field == "estimates.0.parameter"
    assert "fingers.N.friction" in str(error.limit)


def test_the_same_unknown_twice_is_refused():
    (error,) = errors_of({"estimates.1.parameter": "fingers.0.link_masses.0"})
    assert error.field == "estimates.1.parameter"
    assert "twice" in error.message


def test_an_initial_estimate_must_lie_within_its_own_bounds():
    (error,) = errors_of({"estimates.4.minimum": 0.6})
    assert error.field == "estimates.4.initial"
    assert error.value == 0.5


@pytest.mark.parametrize("count", [0, 1, 7, 100])
def test_the_number_of_fingers_is_bounded(count):
    wrong = mapping()
    wrong["fingers"] = [wrong["fingers"][0]] * count
    wrong["estimates"] = []
    with pytest.raises(ScenarioError) as caught:
        scenario_from_mapping(wrong)
    assert any("fingers" in e.field for e in caught.value.errors)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("controller.control_period", 1e-5),
        ("controller.control_period", -0.001),
        ("controller.velocity_gain", 0.0),
        ("controller.velocity_gain", [10.0, 10.0]),
        ("controller.position_gain", [100.0, -1.0, 100.0]),
        ("controller.lyapunov_weight", -1.0),
        ("controller.lyapunov_weight", [1.0, 1.0, 1.0]),
        ("controller.slip_position_gain", -1.0),
        ("controller.slip_position_gain", 1e-6),
        ("controller.slip_position_gain", [10.0, 10.0, 10.0]),
        ("controller.lyapunov_matrix", [[1.0]]),
        ("controller.lyapunov_matrix", [[1.0] * 10] * 9),
        ("controller.lyapunov_matrix", [[1.0] * 10] * 9 + [[1.0] * 9]),
        ("controller.lyapunov_matrix", [[1.0] * 10] * 10),
        ("controller.lyapunov_matrix", [[1e7] + [0.0] * 9] + [[0.0] * 10] * 9),
        ("controller.adaptation_gain", [1.0, 1.0]),
        ("controller.adaptation_gain", 0.0),
        ("controller.grip_safety", 0.9),
        ("controller.kind", "theorem-5"),
        ("controller.estimate_norm_bound", 0.0),
        ("simulation.duration", 0.0),
        ("simulation.duration", 1e9),
        ("simulation.output_rate", 0.0),
        ("simulation.max_steps", 0),
        ("simulation.max_steps", 1.5),
        ("fingers.0.contact_offset", 0.2),
        ("object.face_half_length", 0.0),
    ],
)
def test_values_out_of_bounds_name_their_field(key, value):
    errors = errors_of({key: value})
    fields = [e.field for e in errors]
    assert any(field.startswith(key) for field in fields), fields


@pytest.mark.parametrize(
    ("key", "limit"),
    [
        ("trajectory.start.0", "-1000 … 1000 m"),
        ("trajectory.start.1", "-1000 … 1000 m"),
        ("trajectory.start.2", "-3.2 … 3.2 rad"),
        ("trajectory.acceleration.1", "-100 … 100 m/s²"),
        ("trajectory.table.0.0", "0 … 600 s"),
        ("trajectory.table.0.3", "-3.2 … 3.2 rad"),
    ],
)
def test_every_number_of_a_list_has_its_own_limit_and_unit(key, limit):
    row = {f"trajectory.table.0.{k}": 0.0 for k in range(4)}
    (error,) = errors_of({**row, key: 1e6})
    assert error.field == key
    assert error.limit == limit


@pytest.mark.parametrize("key", ["object.corners.0.2", "trajectory.start.3", "fingers.0.base.2"])
def test_no_list_grows_beyond_its_length(key):
    values = {"object.corners.0.0": 1.0, "object.corners.0.1": 1.0, key: 1.0}
    assert any(e.field == key and "unknown" in e.message for e in errors_of(values))


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"controller.minimum_normal_force": 6.0}, "controller.minimum_normal_force"),
        (
            {"controller.kind": "pd-gravity", "controller.grip_force": 6.0},
            "controller.grip_force",
        ),
    ],
)
def test_no_contact_must_be_pressed_harder_than_it_may_be(values, field):
    (error,) = errors_of({**values, "controller.maximum_normal_force": 5.0})
    assert error.field == field
    assert error.limit == "at most 5 N"
    with_values(CASE, {**values, "controller.maximum_normal_force": 6.0})
    with_values(CASE, {"controller.maximum_normal_force": 5.0})


def test_a_wrong_word_is_answered_with_the_words_there_are_once():
    (error,) = errors_of({"controller.grasp_force": "most"})
    expected = "controller.grasp_force is 'most'; allowed: one of minimum, none"
    assert error.message == expected


def weights(**entries):
    rows = np.eye(10)
    for place, value in entries.items():
        j, k = map(int, place.removeprefix("at_").split("_"))
        rows[j, k] = value
    return {"controller.lyapunov_matrix": rows.tolist()}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            weights(at_0_3=0.5),
            "controller.lyapunov_matrix.0.3 is 0.5 and controller.lyapunov_matrix.3.0 is 0; Q is "
            "symmetric, give both the same value",
        ),
        (
            weights(at_0_3=2.0, at_3_0=2.0),
            "controller.lyapunov_matrix has the eigenvalue -1 next to 3; Q must be positive "
            "definite: raise its diagonal or lower the elements next to it",
        ),
        (
            {"controller.lyapunov_matrix": [[1.0]]},
            "controller.lyapunov_matrix: 1 instead of 10 rows; give 10 rows of 10 numbers, or none",
        ),
    ],
    ids=["uneven", "indefinite", "small"],
)
def test_a_wrong_full_q_is_told_with_the_way_out(values, message):
    (error,) = errors_of(values)
    assert error.message == message
    with_values(CASE, weights(at_0_3=0.9, at_3_0=0.9))


def test_more_samples_than_fit_are_refused():
    errors = errors_of({"simulation.duration": 600.0, "simulation.output_rate": 1e4})
    assert [e.field for e in errors] == ["simulation.output_rate"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"time": 7.0, "parameter": "object.mass", "value": 2.0}, "changes.0.time"),
        ({"time": 0.0, "parameter": "object.mass", "value": 2.0}, "changes.0.time"),
        ({"time": 1.0, "parameter": "object.mas", "value": 2.0}, "changes.0.parameter"),
        ({"time": 1.0, "parameter": "object.half_width", "value": 0.2}, "changes.0.parameter"),
        ({"time": 1.0, "parameter": "object.mass", "value": -2.0}, "changes.0.value"),
        ({"time": 1.0, "parameter": "controller.kind", "value": "pid"}, "changes.0.value"),
        ({"time": 1.0, "parameter": "object.mass"}, "changes.0.value"),
    ],
)
def test_timed_changes_are_checked_like_any_value(change, field):
    wrong = mapping()
    wrong["changes"] = [change]
    with pytest.raises(ScenarioError) as caught:
        scenario_from_mapping(wrong)
    fields = [e.field for e in caught.value.errors]
    assert fields == [field], caught.value.errors


@pytest.mark.parametrize("wrong", [None, [], 1, "text", {"fingers": None}, {"fingers": {}}])
def test_what_is_not_a_scenario_at_all_is_refused(wrong):
    with pytest.raises(ScenarioError):
        scenario_from_mapping(wrong)


@pytest.mark.parametrize(
    ("given", "way"),
    [
        ("paper-case-1", "load_scenario('paper-case-1')"),
        ({}, "scenario_from_mapping"),
        (None, "load_scenario"),
    ],
)
@pytest.mark.parametrize(
    "take",
    [simulate, lambda given: with_values(given, {}), lambda given: with_law(given, "composite")],
)
def test_what_belongs_where_a_scenario_does_is_told_by_who_takes_it(take, given, way):
    with pytest.raises(ScenarioError, match=re.escape(way)) as caught:
        take(given)
    assert "a Scenario is needed" in str(caught.value)


def test_nesting_without_end_is_refused():
    deep = []
    for _ in range(100_000):
        deep = [deep]
    with pytest.raises(ScenarioError):
        scenario_from_mapping({"fingers": deep})


def test_the_error_text_is_the_sentences_of_all_errors():
    with pytest.raises(ScenarioError) as caught:
        with_values(CASE, {"object.mass": -1.0, "object.inertia": -1.0})
    assert isinstance(caught.value, ValueError)
    assert str(caught.value) == "; ".join(e.message for e in caught.value.errors)
