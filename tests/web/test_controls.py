"""Controls are made from the definitions of the parameters, by one function."""

from __future__ import annotations

from dataclasses import replace
from time import monotonic

import pytest
import viser

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import (
    load_scenario,
    parameter_definitions,
)
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.disturbances import push_at
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.editing import Gesture
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.parameter_groups import (
    Entry,
    control_label,
    disturbance_groups,
    group_parameters,
)
from slipgrasp.web.model.slider_range import slider_range
from slipgrasp.web.model.view import RunStage, RunStatus, ViewState
from slipgrasp.web.panels.controls_panel import ControlsPanel
from slipgrasp.web.panels.parameter_inputs import as_text, parse_text
from tests.web.reducing import AT_REST, first_view

NAMES = ("left", "right")
GAIN, MASS = "controller.position_gain", "object.mass"


def view_of(draft: Draft, time: float = 0.0) -> ViewState:
    return first_view(draft=draft, playback=replace(AT_REST, time=time))


def refused(draft: Draft) -> ViewState:
    with pytest.raises(ScenarioError) as caught:
        draft.scenario()
    return replace(view_of(draft), status=RunStatus.refused(caught.value))


def keys(entries: tuple[Entry, ...]) -> set[str]:
    return {entry.parameter.key for entry in entries}


def panel_of(server: ViewerServer, scenario: Scenario) -> tuple[ControlsPanel, list[Intent]]:
    sent: list[Intent] = []
    panel = ControlsPanel(server.gui, sent.append)
    panel.update(view_of(Draft.starting_from("what a test needs", scenario)))
    return panel, sent


@pytest.mark.parametrize("preset", ["paper-case-1", "paper-case-2"])
def test_every_parameter_has_a_place_and_the_main_ones_a_part_that_shows_them(preset: str) -> None:
    definitions = parameter_definitions(load_scenario(preset))
    groups = group_parameters(definitions, NAMES)
    assert set().union(*(keys(group.entries) for group in groups)) == {
        *definitions,
        "controller.lyapunov_matrix",
        "object.corners",
        "trajectory.set_points",
        "trajectory.table",
    }
    assert [(group.title, group.part) for group in groups if group.part] == [
        ("Object", "object"),
        ("Left finger", "fingers.0"),
        ("Right finger", "fingers.1"),
        ("Control law", "controller"),
    ]
    labels = [(group.title, entry.label) for group in groups for entry in group.entries]
    assert len(set(labels)) == len(labels)


@pytest.mark.parametrize("preset", ["paper-case-1", "paper-case-2"])
def test_every_slider_holds_its_value_inside_its_bounds(preset: str) -> None:
    definitions = parameter_definitions(load_scenario(preset))
    for parameter in definitions.values():
        if not parameter.changeable or not isinstance(parameter.value, float):
            continue
        low, high, step = slider_range(parameter, definitions, parameter.value)
        assert low <= parameter.value <= high
        assert 0.0 < step < high - low
        assert parameter.minimum is None or low >= parameter.minimum
        assert parameter.maximum is None or high <= parameter.maximum


def test_an_estimate_moves_in_the_typical_range_of_what_it_estimates() -> None:
    definitions = parameter_definitions(load_scenario("paper-case-2"))
    mass = slider_range(definitions["estimates.2.initial"], definitions, 0.5)
    friction = slider_range(definitions["estimates.0.initial"], definitions, 0.3)
    assert (mass.low, mass.high) == definitions["object.mass"].typical
    assert (friction.low, friction.high) == (0.05, 1.2)


def test_a_value_beyond_the_typical_range_widens_the_slider_and_keeps_its_steps() -> None:
    definitions = parameter_definitions(load_scenario("paper-case-1"))
    usual = slider_range(definitions[MASS], definitions, 1.0)
    heavy = slider_range(definitions[MASS], definitions, 40.0)
    assert (usual.high, heavy.high, heavy.low) == (3.0, 40.0, usual.low)
    assert heavy.step == usual.step


def test_labels_say_what_and_in_which_unit() -> None:
    definitions = parameter_definitions(load_scenario("paper-case-2"))

    def label(key: str) -> str:
        return control_label(definitions[key], definitions, NAMES)

    assert label("object.inertia") == "inertia [kg m²]"
    assert label("fingers.1.link_masses.1") == "link mass 2 [kg]"
    assert label("fingers.1.base.1") == "base y [m]"
    assert label("estimates.1.initial") == "right friction"
    assert label("estimates.2.minimum") == "object mass, minimum [kg]"
    assert label("controller.control_period") == "control period [s]"
    assert label("title") == "title"


def test_numbers_are_written_and_read_to_the_last_digit() -> None:
    for value in (1.2345, 1 / 12, 1e-10, 5.0, (100.0, 0.1, 1 / 3)):
        assert parse_text(as_text(value)) == (list(value) if isinstance(value, tuple) else value)
    assert as_text(5.0) == "5"
    assert parse_text("100, many") == "100, many"
    assert (parse_text(" "), as_text(None)) == (None, "")


def test_a_field_beside_a_slider_takes_more_digits_than_the_slider_has_steps(
    viewer_server: ViewerServer,
) -> None:
    panel, sent = panel_of(viewer_server, load_scenario("paper-case-1"))
    slider = panel.control(MASS).input
    assert "The field also accepts values beyond the ends of the slider" in (slider.hint or "")
    assert isinstance(slider, viser.GuiSliderHandle)
    assert (slider.step, slider.precision) == (0.01, 12)
    assert panel.control(MASS).read(1.2345) == 1.2345
    assert panel.control(MASS).read(40.0) == 40.0
    assert slider.max == 40.0
    assert sent == []


def test_a_gain_is_one_number_on_a_slider_or_a_list_in_a_field(
    viewer_server: ViewerServer,
) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, _ = panel_of(viewer_server, draft.base)
    slider, field = panel.control(GAIN, 0), panel.control(GAIN, 1)
    assert isinstance(slider.input, viser.GuiSliderHandle)
    assert (slider.input.visible, field.value) == (True, "100")
    panel.update(view_of(draft.edited(GAIN, [100.0, 90.0, 80.0])))
    assert (slider.input.visible, field.value) == (False, "100, 90, 80")
    assert field.read("100, 90, 80") == [100.0, 90.0, 80.0]
    panel.update(view_of(draft))
    assert (slider.input.visible, slider.value, field.value) == (True, 100.0, "100")


def test_a_field_keeps_the_way_a_user_writes_a_number(viewer_server: ViewerServer) -> None:
    panel, _ = panel_of(viewer_server, load_scenario("paper-case-2"))
    field = panel.control("estimates.0.minimum")
    assert field.value == ""
    assert isinstance(field.input, viser.GuiTextHandle)
    field.input.value = "0.10"
    field.show(0.1)
    assert field.value == "0.10"
    field.show(0.2)
    assert field.value == "0.2"
    field.show(None)
    assert field.value == ""


def test_a_control_that_the_program_sets_sends_nothing(viewer_server: ViewerServer) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, sent = panel_of(viewer_server, draft.base)
    panel.update(view_of(draft.edited(MASS, 1.7)))
    assert panel.control(MASS).value == 1.7
    panel.update(view_of(draft))
    assert panel.control(MASS).value == 1.0
    panel.update(view_of(Draft.from_preset("paper-case-2")))
    assert panel.control("estimates.0.initial").value == 1.2
    assert sent == []


def test_a_control_shows_the_value_that_holds_at_the_play_head(viewer_server: ViewerServer) -> None:
    draft = Draft.from_preset("paper-case-1").edited_from(1.0, MASS, 1.7)
    panel, _ = panel_of(viewer_server, draft.base)
    for time, value in ((0.5, 1.0), (1.0, 1.7), (2.0, 1.7), (0.0, 1.0)):
        panel.update(view_of(draft, time))
        assert panel.control(MASS).value == value


def test_the_control_in_the_users_hand_is_left_alone(viewer_server: ViewerServer) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, _ = panel_of(viewer_server, draft.base)
    moved = view_of(draft.edited(MASS, 1.7).edited("object.inertia", 0.02))
    for age, shown in ((0.0, 1.0), (5.0, 1.7)):
        gesture = Gesture(MASS, 0.0, monotonic() - age)
        panel.update(replace(moved, editing=replace(moved.editing, gesture=gesture)))
        assert panel.control(MASS).value == shown
        assert panel.control("object.inertia").value == 0.02


def test_there_are_no_controls_before_the_first_recording_is_there(
    viewer_server: ViewerServer,
) -> None:
    panel = ControlsPanel(viewer_server.gui, lambda _: None)
    other = view_of(Draft.from_preset("paper-case-2"))
    panel.update(replace(other, status=RunStatus(RunStage.OPENING)))
    with pytest.raises(KeyError):
        panel.control(MASS)
    panel.update(view_of(Draft.from_preset("paper-case-1").edited(MASS, 1.7)))
    assert panel.control(MASS).value == 1.7


def test_what_is_wrong_stands_below_the_field_until_it_is_right(
    viewer_server: ViewerServer,
) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, _ = panel_of(viewer_server, draft.base)
    panel.update(view_of(draft.edited(MASS, 1.7)))
    panel.update(refused(draft.edited(MASS, 1.7).edited("object.inertia", -1.0)))
    assert panel.control(MASS).value == 1.7
    assert len(panel.errors) == 1
    assert "object.inertia is -1.0" in panel.errors[0]
    panel.update(view_of(draft.edited(MASS, 1.7)))
    assert panel.errors == ()


def test_errors_are_escaped(viewer_server: ViewerServer) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, _ = panel_of(viewer_server, draft.base)
    error = FieldError(field="title", value=None, limit=None, message="<img src=x>")
    panel.update(replace(view_of(draft), status=RunStatus.refused(ScenarioError([error]))))
    assert "&lt;img" in panel.errors[0]


def test_a_number_beyond_the_slider_survives_a_page_that_cuts_it_off(
    viewer_server: ViewerServer,
) -> None:
    panel, _ = panel_of(viewer_server, load_scenario("paper-case-1"))
    control = panel.control(MASS)
    widest = control.input.max
    assert control.read(4.56789) == 4.56789
    assert control.read(widest) == 4.56789
    assert control.read(1.5) == 1.5


def test_a_slider_is_as_before_once_a_number_that_is_not_allowed_has_been_replaced(
    viewer_server: ViewerServer,
) -> None:
    panel, _ = panel_of(viewer_server, load_scenario("paper-case-1"))
    control = panel.control(MASS)
    before = (control.input.min, control.input.max)
    for refused_value in (-3.0, 2000.0):
        control.read(refused_value)
        assert not before[0] <= refused_value <= before[1]
        assert control.input.min <= refused_value <= control.input.max
        assert control.read(1.2) == 1.2
        assert (control.input.min, control.input.max) == before
    control.read(4.0)
    assert control.read(1.2) == 1.2
    assert control.input.max == 4.0


def test_a_yes_or_no_is_a_checkbox(viewer_server: ViewerServer) -> None:
    panel, sent = panel_of(viewer_server, load_scenario("paper-case-1"))
    control = panel.control("sensing.true_phases")
    assert isinstance(control.input, viser.GuiCheckboxHandle)
    assert control.value is True
    draft = Draft.from_preset("paper-case-1").edited(control.key, False)
    panel.update(view_of(draft))
    assert (control.value, sent) == (False, [])


def test_fields_that_the_chosen_kind_does_not_use_are_out_of_sight(
    viewer_server: ViewerServer,
) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, _ = panel_of(viewer_server, draft.base)
    fields = ("controller.slip_stop", "controller.grip_rate", "trajectory.radius", GAIN)

    def seen() -> list[bool]:
        return [panel.control(key).input.visible for key in fields]

    assert seen() == [False, False, False, True]
    panel.update(view_of(draft.edited("controller.kind", "composite")))
    assert seen() == [True, False, False, True]
    panel.update(view_of(draft.edited("trajectory.kind", "circle")))
    assert seen() == [False, False, True, True]


def test_a_push_has_controls_and_what_is_wrong_with_it_stands_below_them(
    viewer_server: ViewerServer,
) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, _ = panel_of(viewer_server, draft.base)
    pushed = draft.with_disturbance(push_at(0.5))
    panel.update(view_of(pushed))
    force = panel.control("pulses.0.force.1")
    assert force.value == -5.0
    panel.update(view_of(pushed.edited("pulses.0.force.1", -8.0)))
    assert force.value == -8.0
    panel.update(refused(pushed.edited("pulses.0.duration", -1.0)))
    (error,) = panel.errors
    assert "pulses.0.duration is -1.0" in error
    panel.update(view_of(draft))
    with pytest.raises(KeyError):
        panel.control("pulses.0.force.1")
    assert panel.errors == ()


def test_a_push_in_space_has_a_control_for_each_part_of_its_force_and_moment(
    viewer_server: ViewerServer,
) -> None:
    draft = Draft.from_preset("spatial-prism")
    panel, _ = panel_of(viewer_server, draft.base)
    push = push_at(0.5, SPATIAL)
    panel.update(view_of(draft.with_disturbance(push)))
    assert panel.control("pulses.0.moment.2").value == 0.0
    (group,) = disturbance_groups([push], draft.base.finger_names, SPATIAL)
    labels = [entry.label for entry in group.entries if entry.parameter.key.count(".") == 3]
    assert labels == [f"force {c} [N]" for c in "xyz"] + [f"moment {c} [N m]" for c in "xyz"]


def test_lists_of_rows_are_written_in_one_field_each(viewer_server: ViewerServer) -> None:
    draft = Draft.from_preset("paper-case-1")
    panel, _ = panel_of(viewer_server, draft.base)
    corners, moves = panel.control("object.corners"), panel.control("trajectory.set_points")
    assert (corners.value, moves.input.visible) == ("", False)
    square = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]
    text = "-0.1, -0.1; 0.1, -0.1; 0.1, 0.1; -0.1, 0.1"
    assert corners.read(text) == square
    draft = draft.edited("object.corners", square)
    for i, edge in enumerate(("edge-3", "edge-1")):
        draft = draft.edited(f"fingers.{i}.face", edge)
    assert draft.scenario().object.corners == tuple(map(tuple, square))
    panel.update(view_of(draft))
    assert corners.value == text
    move = {"time": 0.5, "duration": 1.0, "pose": [1.466, 0.4, 0.0]}
    assert moves.read("0.5, 1, 1.466, 0.4, 0;") == [move]
    assert moves.read("0.5, 1") == "0.5, 1"
    panel.update(refused(draft.edited("object.corners", "round")))
    assert "object.corners is &#x27;round&#x27;" in panel.errors[0]
