"""Knobs are made from the definitions of the parameters, by one function."""

from __future__ import annotations

from dataclasses import replace

import pytest
import viser

from core.loading import load_scenario, parameter_definitions, with_values
from server.viewer_server import ViewerServer
from web.intents.intent import Intent
from web.panels.parameter_inputs import add_knob, as_text, is_offered, parse_numbers, slider_range
from web.panels.scenario_panel import ScenarioPanel, group_knobs, knob_label
from web.playback import WindowChoice
from web.view import Draft, RunStage, RunStatus, ViewState

WANTED = {
    "object.mass",
    "object.inertia",
    "fingers.0.link_masses.0",
    "fingers.0.link_masses.1",
    "fingers.1.link_masses.0",
    "fingers.1.link_masses.1",
    "fingers.0.friction",
    "fingers.1.friction",
    "estimates.0.initial",
    "estimates.1.initial",
    "estimates.2.initial",
    "estimates.3.initial",
    "controller.kind",
    "controller.position_gain",
    "controller.velocity_gain",
    "controller.adaptation_gain",
    "controller.lyapunov_weight",
    "controller.grip_safety",
    "controller.control_period",
    "controller.grasp_force",
}


def view_of(draft: Draft) -> ViewState:
    return ViewState(draft, RunStatus(RunStage.SIMULATING), WindowChoice.SLIP)


def test_every_parameter_that_the_dashboard_promises_has_a_knob() -> None:
    groups = group_knobs(parameter_definitions(load_scenario("paper-case-2")), ("left", "right"))
    keys = {parameter.key for parameters in groups.values() for parameter in parameters}
    assert keys >= WANTED
    assert list(groups) == [
        "Object",
        "Left finger",
        "Right finger",
        "What the controller believes at first",
        "Controller",
    ]


@pytest.mark.parametrize("preset", ["paper-case-1", "paper-case-2"])
def test_every_slider_holds_its_value_inside_its_bounds(preset: str) -> None:
    definitions = parameter_definitions(load_scenario(preset))
    for parameter in filter(is_offered, definitions.values()):
        if not isinstance(parameter.value, float):
            continue
        low, high, step = slider_range(parameter, definitions)
        assert low <= parameter.value <= high
        assert 0.0 < step < high - low
        assert parameter.minimum is None or low >= parameter.minimum
        assert parameter.maximum is None or high <= parameter.maximum


def test_an_estimate_moves_in_the_typical_range_of_what_it_estimates() -> None:
    definitions = parameter_definitions(load_scenario("paper-case-2"))
    mass = slider_range(definitions["estimates.2.initial"], definitions)
    friction = slider_range(definitions["estimates.0.initial"], definitions)
    assert (mass.low, mass.high) == definitions["object.mass"].typical
    assert (friction.low, friction.high) == (0.05, 1.2)


def test_a_value_beyond_the_typical_range_widens_the_slider() -> None:
    definitions = parameter_definitions(load_scenario("paper-case-1"))
    heavy = replace(definitions["object.mass"], value=40.0)
    assert slider_range(heavy, definitions).high == 40.0


def test_labels_say_what_and_in_which_unit() -> None:
    names = ("left", "right")
    definitions = parameter_definitions(load_scenario("paper-case-2"))
    labels = {key: knob_label(definitions[key], definitions, names) for key in WANTED}
    assert labels["object.inertia"] == "inertia [kg m²]"
    assert labels["fingers.1.link_masses.1"] == "link mass 2 [kg]"
    assert labels["estimates.1.initial"] == "right friction"
    assert labels["controller.control_period"] == "control period [s]"


def test_a_knob_that_the_program_sets_sends_nothing(viewer_server: ViewerServer) -> None:
    sent: list[Intent] = []
    definitions = parameter_definitions(load_scenario("paper-case-1"))
    knob = add_knob(viewer_server.gui, "mass", definitions["object.mass"], definitions, sent.append)
    assert isinstance(knob, viser.GuiSliderHandle)
    knob.value = 2.0
    assert knob.value == 2.0
    assert sent == []


def test_a_gain_per_coordinate_gets_a_text_field(viewer_server: ViewerServer) -> None:
    scenario = with_values(
        load_scenario("paper-case-1"), {"controller.position_gain": [100.0, 90.0, 80.0]}
    )
    definitions = parameter_definitions(scenario)
    gain = definitions["controller.position_gain"]
    knob = add_knob(viewer_server.gui, "K_p", gain, definitions, lambda _: None)
    assert isinstance(knob, viser.GuiTextHandle)
    assert knob.value == "100, 90, 80"
    assert parse_numbers(knob.value) == [100.0, 90.0, 80.0]
    assert parse_numbers("100, many") == "100, many"
    assert as_text((1.0, 2.5)) == "1, 2.5"


def test_the_panel_follows_a_reset_and_another_preset(viewer_server: ViewerServer) -> None:
    sent: list[Intent] = []
    draft = Draft.from_preset("paper-case-1")
    panel = ScenarioPanel(viewer_server.gui, draft, sent.append)
    panel.update(view_of(draft.edited("object.mass", 1.7)))
    mass = panel.knob("object.mass")
    assert mass.value == 1.7
    panel.update(view_of(draft))
    assert mass.value == 1.0
    panel.update(view_of(Draft.from_preset("paper-case-2")))
    assert panel.knob("estimates.0.initial").value == 1.2
    assert sent == []
    panel.remove()


def test_a_value_that_is_not_allowed_leaves_the_knobs_alone(viewer_server: ViewerServer) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel = ScenarioPanel(viewer_server.gui, draft, lambda _: None)
    panel.update(view_of(draft.edited("object.mass", 1.7)))
    panel.update(view_of(draft.edited("object.mass", 1.7).edited("object.inertia", -1.0)))
    assert panel.knob("object.mass").value == 1.7
