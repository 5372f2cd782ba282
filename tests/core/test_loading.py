"""Names, files and dotted keys: what goes in comes out again."""

import dataclasses
import tomllib
from itertools import chain

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.geometry import contact_frame, tip_distance
from slipgrasp.core.scenario.loading import (
    load_scenario,
    parameter_definitions,
    preset_names,
    scenario_from_mapping,
    scenario_to_toml,
    settable_parameters,
    with_values,
)
from slipgrasp.core.scenario.parameters import find_parameter
from slipgrasp.core.scenario.space import SPACES

CASE = load_scenario("paper-case-1")
RICH = with_values(
    CASE,
    {
        "title": 'quotes " \\ and\nlines, Zürich',
        "controller.lyapunov_weight": [1.0, 2.0, 3.0, 4.0, 5.0],
        "controller.position_gain": [100.0, 90.0, 80.0],
        "estimates.0.minimum": 0.05,
        "estimates.0.maximum": 10.0,
        "object.mass": 0.1 + 0.2,
        "changes.0.time": 1.0,
        "changes.0.parameter": "object.mass",
        "changes.0.value": 2.0,
        "changes.1.time": 2.0,
        "changes.1.parameter": "controller.kind",
        "changes.1.value": "theorem-4",
        "changes.2.time": 3.0,
        "changes.2.parameter": "controller.position_gain",
        "changes.2.value": [50.0, 50.0, 50.0],
    },
)


@pytest.mark.parametrize("space", SPACES)
def test_presets_are_listed_by_what_they_are_of(space):
    assert {load_scenario(name).space for name in preset_names(space)} == {space}


@pytest.mark.parametrize("scenario", [*map(load_scenario, chain(*map(preset_names, SPACES))), RICH])
def test_a_scenario_survives_toml_and_plain_values(scenario, tmp_path):
    text = scenario_to_toml(scenario)
    assert scenario_from_mapping(tomllib.loads(text)) == scenario
    assert scenario_from_mapping(scenario.to_mapping()) == scenario
    path = tmp_path / "scenario.toml"
    path.write_text(text, encoding="utf-8")
    assert load_scenario(path) == load_scenario(str(path)) == scenario


def test_a_scenario_cannot_be_edited_in_place():
    with pytest.raises(dataclasses.FrozenInstanceError):
        CASE.object.mass = 2.0


def test_dotted_keys_set_values_and_leave_the_base_alone():
    changed = with_values(CASE, {"fingers.1.link_masses.0": 1.5, "controller.grip_safety": 1.2})
    assert changed.fingers[1].link_masses == (1.5, 1.0)
    assert changed.controller.grip_safety == 1.2
    assert CASE.fingers[1].link_masses == (1.0, 1.0)
    assert with_values(CASE, {}) == CASE
    assert with_values(CASE, {"object.mass": 2}).object.mass == 2.0


def test_a_change_is_added_by_its_keys():
    assert RICH.changes[0] == Change(time=1.0, parameter="object.mass", value=2.0)
    assert RICH.changes[2].value == (50.0, 50.0, 50.0)


def test_optional_bounds_can_be_set_and_taken_away():
    assert RICH.estimates[0].minimum == 0.05
    assert with_values(RICH, {"estimates.0.minimum": None}).estimates[0].minimum is None


def test_every_definition_has_key_value_sentence_and_limit():
    definitions = parameter_definitions(RICH)
    for key, parameter in definitions.items():
        assert parameter.key == key
        assert parameter.text.endswith(".")
        assert parameter.limit
    numbers = [p for p in definitions.values() if p.kind == "number" and p.typical]
    assert numbers
    for parameter in numbers:
        low, high = parameter.typical
        assert parameter.minimum is None or parameter.minimum <= low
        assert low < high
        assert parameter.maximum is None or high <= parameter.maximum


def test_one_parameter_is_found_without_describing_the_others():
    for key, parameter in parameter_definitions(RICH).items():
        assert find_parameter(RICH, key) == parameter
    assert find_parameter(RICH, "fingers.9.friction") is None
    assert find_parameter(RICH, "nothing") is None


def test_every_definition_can_be_set_to_its_own_value():
    definitions = parameter_definitions(RICH)
    values = {
        key: list(p.value) if isinstance(p.value, tuple) else p.value
        for key, p in definitions.items()
        if p.value is not None
    }
    assert with_values(RICH, values) == RICH


def test_every_list_grows_number_by_number():
    corners = [(-0.2, -0.2), (0.1, -0.1458), (0.1, 0.1458), (-0.1, 0.1458)]
    values = {f"object.corners.{i}.{k}": corners[i][k] for i in range(4) for k in range(2)}
    values |= {"fingers.0.face": "edge-3", "fingers.1.face": "edge-1"}
    pose = [1.466, 0.4, 0.0]
    values |= {"trajectory.kind": "set-points", "trajectory.set_points.0.time": 1.0}
    values |= {f"trajectory.set_points.0.pose.{k}": pose[k] for k in range(3)}
    values |= {"trajectory.set_points.0.duration": 2.0}
    values |= {f"trajectory.table.0.{k}": 0.0 for k in range(4)}
    grown = with_values(CASE, values)
    assert grown.object.corners == tuple(corners)
    assert grown.trajectory.set_points[0].pose == tuple(pose)
    assert grown.trajectory.table == ((0.0, 0.0, 0.0, 0.0),)


def test_every_parameter_that_is_listed_can_be_set():
    keys = settable_parameters(CASE).keys() - parameter_definitions(CASE).keys()
    assert {"object.corners.0.1", "trajectory.set_points.0.pose.2", "pulses.0.force.1"} <= keys
    with pytest.raises(ScenarioError) as caught:
        with_values(CASE, dict.fromkeys(sorted(keys), None))
    assert "unknown parameter" not in str(caught.value)


def test_definitions_name_what_a_change_may_set():
    definitions = parameter_definitions(CASE)
    assert definitions["object.mass"].changeable
    assert definitions["fingers.0.friction"].changeable
    assert not definitions["object.half_width"].changeable
    assert definitions["object.mass"].unit == "kg"
    assert definitions["controller.kind"].choices[:2] == ("theorem-3", "theorem-4")


def test_a_missing_preset_is_answered_with_those_there_are():
    with pytest.raises(ScenarioError, match="paper-case-1"):
        load_scenario("paper-case-3")


@pytest.mark.parametrize(
    "content", [b"", b"object = 1", b"[object\n", b"\xff\xfe\x00", b"[object]\nmass = nan\n"]
)
def test_a_broken_file_is_one_clear_error(content, tmp_path):
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(ScenarioError):
        load_scenario(path)


def test_a_file_that_is_not_there_or_too_large_is_one_clear_error(tmp_path):
    with pytest.raises(ScenarioError, match="no scenario file"):
        load_scenario(tmp_path / "none.toml")
    large = tmp_path / "large.toml"
    large.write_bytes(b"#" * 1_000_001)
    with pytest.raises(ScenarioError, match="1 MB"):
        load_scenario(large)


def test_each_face_has_its_inward_normal_and_its_range():
    body = CASE.object
    for face, reach in (("left", body.face_half_length), ("bottom", body.half_width)):
        finger = dataclasses.replace(CASE.fingers[0], face=face, contact_offset=0.02)
        frame = contact_frame(body, finger)
        assert frame.normal == (frame.tangent[1], -frame.tangent[0])
        x, y = frame.anchor
        assert x * frame.normal[0] + y * frame.normal[1] < 0.0
        assert frame.slip_maximum == pytest.approx(reach - 0.02)
        assert frame.slip_minimum == pytest.approx(-reach - 0.02)


def test_the_paper_s_arms_start_at_sixty_degrees_and_a_right_angle():
    for index in (0, 1):
        assert tip_distance(CASE, index) == pytest.approx(2.0**0.5, abs=1e-4)


def test_definitions_are_the_callers_own_though_they_are_kept():
    scenario = load_scenario("paper-case-1")
    del parameter_definitions(scenario)["object.mass"]
    assert parameter_definitions(scenario)["object.mass"].value == scenario.object.mass
