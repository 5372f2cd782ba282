from argparse import Namespace

import pytest

from slipgrasp.cli.arguments import parse_assignments, parse_value, read_scenario
from slipgrasp.cli.status import CommandError
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions

DEFINITIONS = parameter_definitions(load_scenario("paper-case-2"))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1),
        ("1.5", 1.5),
        ("-2e-3", -0.002),
        (".5", 0.5),
        ("+1.", 1.0),
        ("true", True),
        ("[1, 2.5]", [1, 2.5]),
        ("theorem-3", "theorem-3"),
        ("'theorem-3'", "theorem-3"),
        ("", ""),
        ("2020-01-01", "2020-01-01"),
        ("1\nother = 2", "1\nother = 2"),
    ],
)
def test_values_are_toml_or_numbers_or_the_text_itself(text, value):
    parsed = parse_value(text, None)

    assert (parsed, type(parsed)) == (value, type(value))


def test_text_parameters_take_what_looks_like_a_number():
    assert parse_value("5", DEFINITIONS["title"]) == "5"
    assert parse_value('"five"', DEFINITIONS["title"]) == "five"


def test_none_removes_an_optional_parameter_and_is_a_word_elsewhere():
    assert parse_value("none", DEFINITIONS["estimates.0.maximum"]) is None
    assert parse_value("none", DEFINITIONS["controller.grasp_force"]) == "none"


@pytest.mark.parametrize(("text", "value"), [("true", True), ("False", False), ("maybe", "maybe")])
def test_a_boolean_is_written_in_any_case(text, value):
    assert parse_value(text, DEFINITIONS["sensing.true_phases"]) == value


def test_everything_behind_the_first_equals_sign_is_the_value():
    assert parse_assignments(["title=a = b"], DEFINITIONS) == {"title": "a = b"}


def test_the_last_of_several_values_holds():
    assert parse_assignments(["object.mass=1", "object.mass=2"], DEFINITIONS) == {"object.mass": 2}


@pytest.mark.parametrize("text", ["object.mass", "=1", ""])
def test_what_is_no_assignment_is_refused(text):
    with pytest.raises(CommandError, match="--set needs KEY=VALUE"):
        parse_assignments([text], DEFINITIONS)


def test_a_star_stands_for_every_finger():
    chosen = Namespace(scenario="three-fingers", law=None, assignments=["fingers.*.friction=0.3"])
    assert [finger.friction for finger in read_scenario(chosen).fingers] == [0.3] * 3
