"""The tour of the presets, and the layout for a lecture hall."""

from __future__ import annotations

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import (
    all_preset_names,
    load_scenario,
    parameter_definitions,
)
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.editing import Reach
from slipgrasp.web.model.intents.picture import ToggleLecture
from slipgrasp.web.model.intents.scenario import AddDisturbance, ChoosePreset, SetParameter
from slipgrasp.web.model.intents.tour import ToggleTour, VisitStop
from slipgrasp.web.model.page_layout import panel_sizes
from slipgrasp.web.model.slider_range import slider_range
from slipgrasp.web.model.tour import TOUR, Stop
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.page.keys import keys_of
from slipgrasp.web.panels.tour_panel import tour_html
from tests.web.reducing import after, view_of


@pytest.fixture
def view(case_2: RunResult) -> ViewState:
    return view_of(case_2)


def test_it_visits_every_preset_once() -> None:
    names = [stop.preset for stop in TOUR]
    assert sorted(names) == sorted(all_preset_names())


@pytest.mark.slow
@pytest.mark.usefixtures("kernel")
@pytest.mark.parametrize("stop", TOUR, ids=lambda stop: stop.preset)
def test_the_control_of_a_stop_can_be_moved_and_makes_another_run(stop: Stop) -> None:
    draft = Draft.from_preset(stop.preset)
    definitions = parameter_definitions(draft.base)
    parameter = definitions[stop.control]
    if parameter.kind == "choice":
        other = next(choice for choice in parameter.choices if choice != parameter.value)
    else:
        assert isinstance(parameter.value, float) and parameter.changeable
        low, high, _ = slider_range(parameter, definitions, parameter.value)
        other = 0.5 * (parameter.value + (high if parameter.value < high else low))
    moved = draft.edited(stop.control, other).scenario()
    assert state_hash(simulate(moved)) != state_hash(simulate(load_scenario(stop.preset)))


def test_its_controls_act_on_the_whole_run_and_leaving_it_keeps_what_was_done(
    view: ViewState,
) -> None:
    begun = after(view, ToggleTour())
    assert begun.stop is TOUR[0]
    assert begun.draft == Draft.from_preset(TOUR[0].preset)
    assert begun.editing.reach is Reach.WHOLE_RUN
    moved = after(begun, SetParameter(TOUR[0].control, 0.8))
    assert moved.stop is TOUR[0]
    assert moved.draft.scenario().object.mass == 0.8
    left = after(moved, ToggleTour())
    assert left.stop is None
    assert left.draft == moved.draft


def test_beyond_its_end_there_is_nothing_and_another_preset_is_beside_the_way(
    view: ViewState,
) -> None:
    last = after(view, VisitStop(len(TOUR) - 1))
    assert last.stop is TOUR[-1]
    assert after(last, VisitStop(len(TOUR))) is last
    aside = after(last, ChoosePreset("paper-case-1"))
    assert aside.stop is None
    assert after(aside, ToggleTour()).stop is TOUR[0]


def test_the_card_has_the_title_the_question_and_the_ways_that_are_open() -> None:
    first, last = tour_html(0, "It <slips>."), tour_html(len(TOUR) - 1, "")
    assert "It &lt;slips&gt;." in first and TOUR[0].question in first
    assert "Back" not in first and "Next" in first
    assert "Back" in last and "Next" not in last
    assert f"{len(TOUR)} of {len(TOUR)}" in last


def test_keys_of_a_lecture_are_in_the_list() -> None:
    keys = {keys_of(AddDisturbance(kind)) for kind in DisturbanceKind}
    assert len({*keys, keys_of(ToggleLecture()), keys_of(ToggleTour())}) == 5


def test_a_lecture_has_one_chart_half_as_high_as_the_page() -> None:
    desk, hall = panel_sizes(1440, 900), panel_sizes(1440, 900, lecture=True)
    assert hall.chart > 2 * desk.chart
    assert hall.results > desk.results
