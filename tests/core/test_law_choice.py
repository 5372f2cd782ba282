"""A law is chosen with the settings it needs and is meant for, and with no others."""

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import CONTROL_LAWS, Change
from slipgrasp.core.scenario.field_errors import template_keys
from slipgrasp.core.scenario.law_choice import (
    SettingChange,
    choose_law,
    describe_settings,
    law_keys,
    law_settings,
    with_law,
)
from slipgrasp.core.scenario.loading import (
    load_scenario,
    preset_names,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.types import Outcome

CASE_2 = load_scenario("paper-case-2")
PAIRS = [(name, kind) for name in preset_names() for kind in CONTROL_LAWS]


@pytest.mark.parametrize(("name", "kind"), PAIRS)
def test_every_preset_takes_every_law_and_keeps_all_else(name, kind):
    scenario = load_scenario(name)
    chosen = with_law(scenario, kind)
    assert chosen.controller.kind == kind
    assert scenario_from_mapping(chosen.to_mapping()) == chosen
    back = {key: value for key, value, _ in choose_law(scenario, kind).settings}
    restored = with_values(chosen, {"controller.kind": scenario.controller.kind, **back})
    assert restored == scenario


# Law: outcome, held, longest slip path [mm].
CASE_2_UNDER = {
    "theorem-3": (Outcome.COMPLETED, True, 47.23),
    "theorem-4": (Outcome.COMPLETED, True, 47.23),
    "certainty-equivalence": (Outcome.LEFT_FACE, False, 145.8),
    "pd-gravity": (Outcome.COMPLETED, True, 0.0),
    "grip-reflex": (Outcome.COMPLETED, True, 0.0),
    "composite": (Outcome.COMPLETED, True, 0.04),
}


@pytest.mark.parametrize("kind", CASE_2_UNDER)
def test_case_2_shows_what_each_law_can_do(kind):
    outcome, held, path = CASE_2_UNDER[kind]
    result = simulate(with_law(CASE_2, kind))
    assert (result.outcome, result.metrics.held) == (outcome, held)
    assert 1e3 * max(result.metrics.slip_path) == pytest.approx(path, abs=0.005)


@pytest.mark.parametrize("name", preset_names())
def test_the_composite_law_holds_every_preset_it_is_chosen_for(name):
    result = simulate(with_law(load_scenario(name), "composite"))
    assert result.metrics.held
    assert max(result.metrics.slip_path) < 0.002


@pytest.mark.parametrize("name", ["wide-object", "unequal-fingers"])
def test_a_fixed_grip_is_made_firm_enough_for_the_object(name):
    chosen = with_law(load_scenario(name), "pd-gravity")
    fingers, body = chosen.fingers, chosen.object
    needed = body.mass * 9.81 / (len(fingers) * min(finger.friction for finger in fingers))
    assert 1.5 * needed <= chosen.controller.grip_force < 1.5 * needed + 1.0
    assert simulate(chosen).metrics.held


def test_what_suits_a_law_already_stays():
    own = {
        "controller.control_period": 0.002,
        "controller.grip_safety": 1.2,
        "controller.slip_stop": 0.3,
        "controller.grip_force": 55.0,
        "estimates.0.maximum": 1.5,
    }
    scenario = with_values(CASE_2, own)
    assert {key for key, _, _ in choose_law(scenario, "composite").settings} == {
        f"estimates.{i}.{bound}" for i in range(4) for bound in ("minimum", "maximum")
    } - {"estimates.0.maximum"} | {"controller.distribution"}
    for kind in ("theorem-3", "certainty-equivalence", "pd-gravity", "grip-reflex"):
        assert choose_law(scenario, kind).settings == ()


def test_sampled_torques_on_the_edge_of_the_cones_get_a_margin_and_continuous_ones_need_none():
    paper = {"controller.velocity_gain": 10.0, "controller.distribution": "exact"}
    exact = with_values(load_scenario("poured-mass"), {"controller.grip_safety": 1.0, **paper})
    plain = simulate(with_values(exact, {"controller.kind": "theorem-4"}))
    assert plain.outcome is not Outcome.COMPLETED
    chosen = choose_law(exact, "theorem-4")
    assert chosen.settings == (SettingChange("controller.grip_safety", 1.0, 1.05),)
    assert simulate(chosen.scenario).metrics.held
    assert law_settings(CASE_2, "theorem-3") == {}


def test_bounds_leave_room_for_what_is_believed_and_for_what_there_is():
    unusual = with_values(
        CASE_2,
        {"object.mass": 15.0, "estimates.0.initial": 2.5, "estimates.3.initial": 0.001},
    )
    unusual = replace(unusual, changes=(Change(time=1.0, parameter="object.mass", value=20.0),))
    bounds = [(e.minimum, e.maximum) for e in with_law(unusual, "composite").estimates]
    assert bounds == [(0.05, 5.0), (0.05, 2.0), (0.05, 40.0), (0.0005, 0.2)]


def test_a_first_belief_that_nothing_physical_has_gets_no_bounds():
    scenario = with_values(CASE_2, {"estimates.2.initial": -1.0})
    bounds = [(e.minimum, e.maximum) for e in with_law(scenario, "composite").estimates]
    assert bounds == [(0.05, 2.0), (0.05, 2.0), (None, None), (0.002, 0.2)]


@pytest.mark.parametrize("kind", ["pd-gravity", "grip-reflex"])
def test_a_grip_does_not_exceed_the_greatest_force_that_is_allowed(kind):
    limited = with_values(CASE_2, {"controller.maximum_normal_force": 25.0})
    chosen = choose_law(limited, kind)
    assert chosen.scenario.controller.grip_force == 25.0
    assert SettingChange("controller.grip_force", 30.0, 25.0) in chosen.settings


def test_a_law_for_the_whole_run_ends_the_changes_of_law_and_keeps_the_other_changes():
    changes = (
        Change(time=1.0, parameter="controller.kind", value="composite"),
        Change(time=1.0, parameter="controller.control_period", value=0.001),
        Change(time=1.0, parameter="object.mass", value=1.2),
        Change(time=2.0, parameter="controller.grip_safety", value=1.3),
    )
    scenario = replace(CASE_2, changes=changes)
    for kind in ("pd-gravity", "theorem-4"):
        assert with_law(scenario, kind).changes == changes[2:]
        assert with_law(scenario, kind).controller.control_period == 0.0


def test_what_rules_a_law_out_is_named_with_the_way_out():
    change = Change(time=1.0, parameter="controller.control_period", value=0.0)
    with pytest.raises(ScenarioError) as caught:
        with_law(replace(CASE_2, changes=(change,)), "grip-reflex")
    (error,) = caught.value.errors
    assert error.field == "changes.0.value"
    assert "'grip-reflex', which needs sampled control; set controller.control" in error.message


def test_the_settings_are_told_in_words_and_only_those_that_changed():
    assert describe_settings(choose_law(CASE_2, "composite").settings) == (
        "control every 1 ms, grip safety 1.05, distribution hold, estimates within physical bounds"
    )
    assert describe_settings(choose_law(CASE_2, "pd-gravity").settings) == ""
    wide = choose_law(load_scenario("wide-object"), "pd-gravity").settings
    assert describe_settings(wide) == "grip force 48 N for the true mass and friction"
    back = [
        SettingChange("controller.control_period", 0.001, 0.0),
        SettingChange("controller.slip_stop", 0.5, 1.0),
        SettingChange("controller.grip_safety", 1.0, 1.0),
        SettingChange("estimates.0.minimum", 0.05, None),
        SettingChange("estimates.1.minimum", 0.05, None),
    ]
    assert (
        describe_settings(back) == "continuous control, slip stop 1 m/s², estimates without bounds"
    )


def test_every_setting_of_every_law_is_among_the_keys_of_laws():
    keys = set(law_keys(CASE_2))
    for name, kind in PAIRS:
        scenario = load_scenario(name)
        assert {key for key, _, _ in choose_law(scenario, kind).settings} <= set(law_keys(scenario))
    assert {"controller.control_period", "controller.slip_stop", "estimates.3.maximum"} <= keys


def test_what_only_some_kinds_use_names_kinds_that_there_are():
    parameters = template_keys()
    of_kinds = {key: parameter for key, parameter in parameters.items() if parameter.used_by}

    for key, parameter in of_kinds.items():
        part = "fingers.0" if key.startswith("fingers.") else key.partition(".")[0]
        kinds = parameters[f"{part}.kind"].choices
        assert set(parameter.used_by) <= set(kinds)
        assert parameter.text.startswith(f"{', '.join(parameter.used_by)}: ")
    assert of_kinds["controller.grip_force"].used_by == ("pd-gravity", "grip-reflex", "gripper")


OTHER_VALUES = {"adaptation_gain": 0.37, "grasp_force": "none", "grip_safety": 1.37}


@pytest.mark.parametrize("kind", CONTROL_LAWS)
@pytest.mark.parametrize("preset", ["paper-case-2", "spatial-prism"])
def test_a_law_reads_exactly_the_parameters_that_are_declared_for_it(preset, kind):
    begun = with_values(load_scenario(preset), {"simulation.duration": 0.1})
    scenario = with_law(begun, kind)
    usual, parameters = simulate(scenario).trace, template_keys(scenario.space)
    for name, value in OTHER_VALUES.items():
        key = f"controller.{name}"
        other = simulate(with_values(scenario, {key: value})).trace
        changed = {
            signal.name
            for signal in SIGNALS
            if not np.array_equal(
                getattr(usual, signal.name), getattr(other, signal.name), equal_nan=True
            )
        }
        # Of the function, every run has the value, whether its law knows it or not.
        assert bool(changed - {"lyapunov_value"}) == (kind in parameters[key].used_by), key
