"""Selecting a part of the scenario: its controls, and the search among all."""

from __future__ import annotations

from dataclasses import replace

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.intents.scenario import (
    AddDisturbance,
    ChooseLaw,
    RemoveChanges,
    Undo,
)
from slipgrasp.web.model.intents.selection import FindParameters, Select, ToggleAllParameters
from slipgrasp.web.model.selection import Selection, parts_of
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.panels.controls_panel import ControlsPanel, parts_html
from slipgrasp.web.reducers.scenario import ScenarioReducer
from slipgrasp.web.reducers.selection import SelectionReducer
from tests.web.reducing import view_of


@pytest.fixture
def view(case_2: RunResult) -> ViewState:
    return view_of(case_2)


def after(view: ViewState, *intents: object) -> ViewState:
    """What the reducers of a session make of intents."""
    reducers = (ScenarioReducer(), SelectionReducer())
    for intent in intents:
        for reducer in reducers:
            view = reducer.pass_time(0.0, view)
        for reducer in reducers:
            view = reducer.reduce(intent, view)
    return reducers[1].pass_time(0.0, view)


def test_a_part_is_selected_and_one_that_the_scenario_lacks_is_not(view: ViewState) -> None:
    assert view.selection.part == "object"
    assert after(view, Select("fingers.1")).selection == Selection("fingers.1")
    assert after(view, Select("fingers.1")).selection.finger == 1
    for wrong in ("fingers.2", "pulses.0", "", "changes.0"):
        assert after(view, Select(wrong)).selection == view.selection


def test_a_new_push_and_a_new_patch_are_selected_until_they_are_gone(view: ViewState) -> None:
    pushed = after(view, AddDisturbance(DisturbanceKind.PUSH))
    assert pushed.selection.part == "pulses.0"
    wet = after(pushed, AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH))
    assert wet.selection.part == "patches.0"
    assert after(wet, Undo()).selection.part == "object"
    assert after(wet, RemoveChanges()).selection.part == "object"
    assert after(view, AddDisturbance(DisturbanceKind.POUR)).selection == view.selection


def test_a_law_that_is_chosen_shows_its_controls(view: ViewState) -> None:
    assert after(view, ChooseLaw("composite")).selection.part == "controller"


def test_a_selected_part_has_few_controls_and_typing_finds_the_others(
    view: ViewState, viewer_server: ViewerServer
) -> None:
    panel = ControlsPanel(viewer_server.gui, lambda _: None)

    def shown(selection: Selection) -> set[str]:
        panel.update(replace(view, selection=selection))
        return panel.shown_keys

    for part, _ in parts_of(view.draft):
        assert 2 <= len(shown(Selection(part))) <= 6
    assert "fingers.1.friction" in shown(Selection("fingers.1"))
    assert shown(Selection(search="friction left")) >= {"fingers.0.friction"}
    assert shown(Selection(search="kg m²")) >= {"object.inertia"}
    assert shown(Selection(search="control_period")) == {"controller.control_period"}
    assert shown(Selection(search="no such parameter")) == set()
    assert len(shown(Selection(all=True))) > 40


def test_the_search_and_the_fold_are_taken(view: ViewState) -> None:
    found = after(view, FindParameters(" gain "))
    assert found.selection.search == "gain"
    assert after(found, Select("object")).selection == Selection()
    assert after(view, ToggleAllParameters()).selection.all
    assert "aria-pressed='true'" in parts_html(Selection(), parts_of(view.draft))
