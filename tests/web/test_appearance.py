"""What a user may choose of the picture, and how much room the page gives it."""

from __future__ import annotations

import asyncio
import math
from dataclasses import asdict, dataclass, replace

import pytest
import viser

from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import MeasurePage, SetAppearance, ToggleDark
from slipgrasp.web.model.page_layout import (
    MARGIN,
    Arrangement,
    PageLayout,
    guess_layout,
    panel_sizes,
)
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.model.view import RunStage, RunStatus, ViewState
from slipgrasp.web.page.intents_schema import PageGestures
from slipgrasp.web.panels.appearance_panel import AppearancePanel
from slipgrasp.web.reducers.picture import PictureReducer
from slipgrasp.web.scene.camera import FrontCamera

LAYOUT = PageLayout(1440, 900, 740, 900, 220)


@pytest.fixture
def view() -> ViewState:
    draft = Draft("paper-case-1", load_scenario("paper-case-1"))
    return ViewState(draft, RunStatus(RunStage.REPLAY), WindowChoice.SLIP)


@dataclass
class Camera:
    """What a viewer's camera is told."""

    image_width: int = 1000
    image_height: int = 800


@pytest.fixture
def reducer() -> PictureReducer:
    return PictureReducer(FrontCamera(Camera()))


@pytest.mark.parametrize(
    ("asked", "drawn"), [(2.0, 2.0), (1e9, 4.0), (-3.0, 0.5), (math.nan, 1.0), (math.inf, 1.0)]
)
def test_a_force_scale_that_cannot_be_drawn_is_moved_into_bounds(
    reducer: PictureReducer, view: ViewState, asked: float, drawn: float
) -> None:
    assert (
        reducer.reduce(SetAppearance(Appearance(force_scale=asked)), view).appearance.force_scale
        == drawn
    )


def test_the_page_is_as_dark_as_its_browser_prefers_until_its_user_chooses(
    reducer: PictureReducer, view: ViewState
) -> None:
    dark = reducer.reduce(MeasurePage(LAYOUT, prefers_dark=True), view)
    assert dark.appearance.dark
    bright = reducer.reduce(ToggleDark(), dark)
    resized = reducer.reduce(MeasurePage(replace(LAYOUT, width=1024), prefers_dark=True), bright)
    assert not resized.appearance.dark
    assert resized.page_layout is not None
    assert resized.page_layout.width == 1024


def test_the_panel_shows_what_is_chosen_and_sends_nothing_by_itself(
    viewer_server: ViewerServer, view: ViewState
) -> None:
    sent: list[Intent] = []
    panel = AppearancePanel(viewer_server.gui, view.appearance, sent.append)
    panel.update(replace(view, appearance=Appearance(dark=True, force_scale=2.5, lenses=False)))
    shown = {field: widget.value for field, widget in panel.inputs.items()}
    assert (shown["dark"], shown["force_scale"], shown["lenses"]) == (True, 2.5, False)
    assert sent == []


def test_one_switch_asks_for_the_whole_look(viewer_server: ViewerServer, view: ViewState) -> None:
    sent: list[Intent] = []
    panel = AppearancePanel(viewer_server.gui, view.appearance, sent.append)
    panel.update(replace(view, appearance=Appearance(force_scale=1.5, cones=False)))
    press(panel.inputs["dark"])
    assert sent == [SetAppearance(Appearance(dark=False, force_scale=1.5, cones=False))]


def press(widget: viser.GuiCheckboxHandle) -> None:
    """Calls back as if a user of the page had changed a widget."""
    event = viser.GuiEvent(client=None, client_id=1, target=widget)
    for callback in widget._impl.update_cb:
        answer = callback(event)
        assert answer is not None
        asyncio.run(answer)


def test_what_the_page_measures_becomes_an_intent() -> None:
    posted = {
        "kind": "measure-page",
        "layout": asdict(LAYOUT),
        "prefers_dark": True,
    }
    assert PageGestures.model_validate([posted]).intents() == [MeasurePage(LAYOUT, True)]
    for hostile in ({"width": -1}, {"covered": 1e9}, {"scene_width": 7.5}, {"depth": 1}):
        with pytest.raises(ValueError, match="measure-page"):
            PageGestures.model_validate([posted | {"layout": asdict(LAYOUT) | hostile}])
    with pytest.raises(ValueError, match="measure-page"):
        PageGestures.model_validate([posted | {"prefers_dark": 1}])


@pytest.mark.parametrize(("width", "height"), [(1024, 700), (1440, 900), (2560, 1440)])
def test_the_scene_keeps_its_share_of_every_page(width: int, height: int) -> None:
    sizes = panel_sizes(width, height)
    assert width - sizes.results - sizes.scenario > 0.45 * width
    assert sizes.study >= sizes.results


@pytest.mark.parametrize(
    ("width", "arrangement"),
    [
        (360, Arrangement.SHEET),
        (576, Arrangement.SHEET),
        (577, Arrangement.ONE_COLUMN),
        (799, Arrangement.ONE_COLUMN),
        (800, Arrangement.TWO_COLUMNS),
        (3840, Arrangement.TWO_COLUMNS),
    ],
)
def test_panels_go_where_a_page_has_room_for_them(width: int, arrangement: Arrangement) -> None:
    assert replace(LAYOUT, width=width).arrangement is arrangement


def test_the_playback_panel_spans_the_scene_with_a_margin() -> None:
    assert LAYOUT.playback == LAYOUT.scene_width - 2 * MARGIN
    assert replace(LAYOUT, scene_width=10).playback > 200


def test_a_fine_screen_is_not_taken_for_a_large_page() -> None:
    assert guess_layout(2880, 1800) == guess_layout(1440, 900)


@pytest.mark.parametrize("width", [800, 1024, 1280, 1440])
def test_the_width_of_a_page_follows_from_that_of_its_scene(width: int) -> None:
    sizes = panel_sizes(width, 900)
    edges = 8
    guessed = guess_layout(width - sizes.results - sizes.scenario - edges, 900)
    assert guessed.width == pytest.approx(width, abs=3)  # widths of columns are whole pixels
    assert guessed.arrangement is Arrangement.TWO_COLUMNS
