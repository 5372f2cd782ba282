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


def test_finger_masses_and_friction_cannot_be_unknown_at_once():
    extra = {"parameter": "fingers.0.friction", "initial": 0.5}
    wrong = mapping()
    wrong["estimates"].append(extra)
    with pytest.raises(ScenarioError, match="bilinear") as caught:
        scenario_from_mapping(wrong)
    assert [e.field for e in caught.value.errors] == ["estimates"]


@pytest.mark.parametrize("count", [0, 1, 7, 100])
def test_the_number_of_fingers_is_bounded(count):
    wrong = mapping()
    wrong["fingers"] = [wrong["fingers"][0]] * count
    wrong["estimates"] = []
    with pytest.raises(ScenarioError) as caught:
        scenario_from_mapping(wrong)
    assert any("fingers" in e.field for e in caught.value.errors)


def weights(**entries):
    rows = np.eye(10)
    for place, value in entries.items():
        j, k = map(int, place.removeprefix("at_").split("_"))
        rows[j, k] = value
    return {"controller.lyapunov_matrix": rows.tolist()}


def change(parameter, value=None, time=1.0):
    given = {} if value is None else {"value": value}
    return {"changes": [{"time": time, "parameter": parameter, **given}]}


def of_patch(face, **values):
    patch = {"face": face, "centre": 0.05, "half_length": 0.05, **values}
    return {f"patches.0.{name}": value for name, value in patch.items()}


MOST = {"controller.maximum_normal_force": 5.0}
TRIANGLE = ((-0.1, -0.1), (0.1, -0.1), (0.0, 0.1))
Q, TWO = "controller.lyapunov_matrix", {"fingers.1.static_friction": 0.3}
FACES, SIDES = "left, right, bottom, top", "side-0, side-1, side-2, top, bottom"
ROW = {f"trajectory.table.0.{k}": 0.0 for k in range(4)}
SPATIAL = load_scenario("spatial-prism")
SAMPLED = load_scenario("composite-case-2")
BOX = load_scenario("spatial-box")
PADS = {f"fingers.{i}.pad_radius": 0.015 for i in range(3)}
# What is wrong: the field that is named first, and words of the sentence about it.
REFUSED = [
    (
        CASE,
        [
            ({"object.masss": 1.0}, "object.masss", "did you mean 'object.mass'?"),
            ({"fingers.0.base": [-5.0, 0.0]}, "fingers.0.base", "0 … 2 m"),
            ({"fingers.0.base": [1.366 - 2.0 + 1e-9, 0.366]}, "fingers.0.base", "singular"),
            (
                *({"estimates.0.parameter": "object.half_width"}, "estimates.0.parameter"),
                "fingers.N.friction",
            ),
            (
                {"estimates.1.parameter": "fingers.0.link_masses.0"},
                *("estimates.1.parameter", "twice"),
            ),
            ({"estimates.4.minimum": 0.6}, "estimates.4.initial", "0.5"),
            (
                {**MOST, "controller.minimum_normal_force": 6.0},
                *("controller.minimum_normal_force", "5 N"),
            ),
            (
                {**MOST, "controller.kind": "pd-gravity", "controller.grip_force": 6.0},
                *("controller.grip_force", "5 N"),
            ),
            (
                *({"controller.grasp_force": "most"}, "controller.grasp_force"),
                "is 'most'; allowed: one of minimum, none",
            ),
            (
                *(weights(at_0_3=0.5), f"{Q}.0.3"),
                f"is 0.5 and {Q}.3.0 is 0; Q is symmetric, give both the same value",
            ),
            (
                *(weights(at_0_3=2.0, at_3_0=2.0), Q),
                "has the eigenvalue -1 next to 3; Q must be positive definite: raise its diagonal",
            ),
            ({Q: [[1.0]]}, Q, "1 instead of 10 rows; give 10 rows of 10 numbers"),
            ({Q: [[1.0] * 10] * 9 + [[1.0] * 9]}, Q, "9 instead of 10 numbers"),
            ({Q: [[1e7] + [0.0] * 9] + [[0.0] * 10] * 9}, f"{Q}.0.0", ""),
            (
                {"simulation.duration": 600.0, "simulation.output_rate": 1e4},
                *("simulation.output_rate", ""),
            ),
            (change("object.mass", 2.0, 7.0), "changes.0.time", ""),
            (change("object.mass", 2.0, 0.0), "changes.0.time", ""),
            (change("object.mas", 2.0), "changes.0.parameter", "did you mean"),
            (change("object.half_width", 0.2), "changes.0.parameter", ""),
            (change("object.mass", -2.0), "changes.0.value", ""),
            (change("controller.kind", "pid"), "changes.0.value", ""),
            (change("object.mass"), "changes.0.value", ""),
            ({"controller.control_period": 1e-5}, "controller.control_period", "0"),
            ({"controller.control_period": -0.001}, "controller.control_period", "0"),
            ({"controller.velocity_gain": 0.0}, "controller.velocity_gain", "1e-12 … 1e+06 1/s"),
            ({"controller.velocity_gain": [10.0] * 2}, "controller.velocity_gain", "5"),
            ({"controller.velocity_gain": 5e-324}, "controller.velocity_gain", "is 5e-324"),
            ({"controller.position_gain": [100.0, -1.0, 9.0]}, "controller.position_gain.1", ""),
            ({"controller.slip_position_gain": 1e-6}, "controller.slip_position_gain", ""),
            ({"controller.adaptation_gain": [1.0, 1.0]}, "controller.adaptation_gain", "5"),
            ({"controller.grip_safety": 0.9}, "controller.grip_safety", "1"),
            ({"controller.kind": "theorem-5"}, "controller.kind", "theorem-4"),
            ({"simulation.duration": 1e9}, "simulation.duration", "600 s"),
            ({"simulation.max_steps": 1.5}, "simulation.max_steps", ""),
            ({"fingers.0.contact_offset": 0.2}, "fingers.0.contact_offset", "beyond the end"),
            ({**ROW, "trajectory.start.1": 1e6}, "trajectory.start.1", "-1000 … 1000 m"),
            ({**ROW, "trajectory.start.2": 1e6}, "trajectory.start.2", "-3.2 … 3.2 rad"),
            ({**ROW, "trajectory.acceleration.1": 1e6}, "trajectory.acceleration.1", "100 m/s²"),
            ({**ROW, "trajectory.table.0.0": 1e6}, "trajectory.table.0.0", "0 … 600 s"),
            ({**ROW, "trajectory.table.0.3": 1e6}, "trajectory.table.0.3", "-3.2 … 3.2 rad"),
            ({"trajectory.start.3": 1.0}, "trajectory.start.3", "unknown"),
            ({"fingers.0.base.2": 1.0}, "fingers.0.base.2", "unknown"),
            ({"fingers.0.static_friction": 0.2}, "fingers.0.static_friction", "less than"),
            (
                {"fingers.0.static_friction": 0.3, **change("fingers.0.friction", 0.31)},
                *("changes.0.value", "less than"),
            ),
            (of_patch("edge-0"), "patches.0.face", FACES),
            (of_patch("left", start_time=7.0), "patches.0.start_time", "7 s"),
            (of_patch("left", start_time=2.0, end_time=2.0), "patches.0.end_time", "not after"),
            ({"pulses.0.time": 7.0}, "pulses.0.time", "not before the end"),
        ],
    ),
    (
        with_values(SAMPLED, {"object.shape": "circle"}),
        [
            ({"object.corners": TRIANGLE}, "object.corners", "circle"),
            ({"fingers.0.face": "edge-0"}, "fingers.0.face", FACES),
            ({"patches.0.face": "left"}, "patches.0.face", "curved faces do not support patches"),
        ],
    ),
    (
        with_values(BOX, {"object.shape": "cylinder"}),
        [
            ({"object.corners": TRIANGLE}, "object.corners", "cylinder"),
            ({"fingers.0.face": "side-4"}, "fingers.0.face", "side-0, side-1, side-2, side-3, top"),
            ({"fingers.0.contact_offset": (0.2, 0.0)}, "fingers.0.contact_offset", "beyond the"),
            ({"patches.0.face": "side-3"}, "patches.0.face", "curved faces do not support patches"),
        ],
    ),
    (
        with_values(BOX, {"object.shape": "sphere"}),
        [({"fingers.0.contact_offset": (0.15, 0.06)}, "fingers.0.contact_offset", "of side-3")],
    ),
    (
        SPATIAL,
        [
            ({"fingers.0.base.2": 5.0}, "fingers.0.base", "the finger reaches 0 … 2 m"),
            ({"fingers.0.base.0": -0.1}, "fingers.0.base", "from the vertical axis"),
            ({"object.inertias.0": 3.0}, "object.inertias.0", "impossible for a rigid body"),
            ({"object.inertias.1": -1.0}, "object.inertias.1", "allowed: 1e-06 … 1000 kg m²"),
            ({"trajectory.start.3": 0.5}, "trajectory.start.3", "a rotation has length 1"),
            ({"fingers.2.face": "side-5"}, "fingers.2.face", SIDES),
            (
                {"fingers.1.contact_offset.0": 0.16},
                *("fingers.1.contact_offset", "0.01 m beyond the edge"),
            ),
            ({"controller.control_period": 0.0}, "controller.control_period", "continuous control"),
            ({"controller.velocity_gain": [1.0, 2.0]}, "controller.velocity_gain", "or 12"),
            ({"object.inertia": 0.1}, "object.inertia", "did you mean 'object.inertias."),
            ({"patches.0.face": "side-7"}, "patches.0.face", SIDES),
            (
                {"fingers.1.static_friction": 0.2},
                *("fingers.1.static_friction", "less than the sliding friction 0.25; raise it"),
            ),
            ({**TWO, **change("fingers.1.friction", 0.31, 0.1)}, "changes.0.value", "less than"),
        ],
    ),
    (
        with_values(load_scenario("spatial-composite"), PADS),
        [
            ({key: value}, key, "which is not computed for soft fingertips yet; ")
            for key, value in (
                ("simulation.friction", "pyramid"),
                ("sensing.true_phases", False),
                ("controller.distribution", "exact"),
                ("controller.kind", "theorem-4"),
                ("controller.kind", "theorem-3"),
            )
        ],
    ),
    (
        with_values(load_scenario("paper-case-2"), {"controller.control_period": 0.0}),
        [
            *(
                ({key: value}, key, "set controller.control_period")
                for key, value in (
                    ("controller.kind", "composite"),
                    ("controller.kind", "grip-reflex"),
                    ("controller.latency", 0.002),
                    ("controller.link_length_ratio", 1.1),
                    ("sensing.position_noise", 1e-5),
                    ("sensing.velocity_noise", 1e-3),
                    ("sensing.acceleration_noise", 0.1),
                    ("sensing.true_accelerations", False),
                    ("sensing.true_phases", False),
                    ("actuation.torque_limit", 50.0),
                    ("actuation.torque_rate_limit", 50.0),
                )
            ),
            ({"controller.initial_deviation": [3.0]}, "controller.initial_deviation", "or 4"),
        ],
    ),
    (
        SAMPLED,
        [(change("controller.control_period", 0.0, 0.1), "changes.0.value", "sampled control")],
    ),
]


@pytest.mark.parametrize(
    ("base", "values", "field", "words"),
    [(base, *row) for base, rows in REFUSED for row in rows],
)
def test_what_is_wrong_is_named_with_its_field_and_limit(base, values, field, words):
    with pytest.raises(ScenarioError) as caught:
        with_values(base, values)
    named = {error.field: error for error in caught.value.errors}
    assert field in named, [*named]
    assert words in named[field].message
    assert field.rpartition(".")[0] in named[field].message and len(str(caught.value)) < 1000
    assert str(caught.value) == "; ".join(error.message for error in caught.value.errors)


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
