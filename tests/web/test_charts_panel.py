"""The charts on the page: what is sent, and what is said about them."""

from __future__ import annotations

import html
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from viser._messages import GuiUpdateMessage, GuiUplotMessage

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import CHART_TABS, charts_of
from slipgrasp.web.model.charts_view import ChartsView
from slipgrasp.web.model.intents.picture import ToggleLine
from slipgrasp.web.model.playback import (
    TimeWindow,
    WindowChoice,
    slip_window,
    whole_window,
)
from slipgrasp.web.model.view import Ghost, RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.panels.charts_panel import ChartsPanel, is_reading_due
from slipgrasp.web.reducers.charts import ChartsReducer
from tests.web import reducing
from tests.web.listening_gui import ListeningClient
from tests.web.reducing import AT_REST, at


def view_of(result: RunResult, window: TimeWindow | None = None) -> ViewState:
    return reducing.view_of(
        result,
        status=RunStatus(RunStage.PREVIEW),
        choice=WindowChoice.SLIP,
        playback=replace(AT_REST, time=0.05, window=window or slip_window(result)),
        charts=ChartsView(seen=frozenset(CHART_TABS)),
    )


class Page:
    """The charts on a real viewer server, read back as they are sent."""

    def __init__(self, server: ViewerServer) -> None:
        self.client = ListeningClient(server)
        self.panel = ChartsPanel(self.client.handle, 150)

    def readings(self) -> dict[str, list[str]]:
        """The values in the legends, by chart."""
        values: dict[str, list[str]] = {}
        for text in self.client.texts:
            if "data-sg-readings" in text:
                values |= json.loads(html.unescape(text.split("'")[1]))["values"]
        return values

    def notes(self) -> str:
        texts = self.client.texts
        return " ".join(t for t in texts if "data-sg-" not in t)

    def head(self, key: str) -> str:
        return next(text for text in self.client.texts if f"data-sg-chart='{key}'" in text)

    def labels(self, index: int) -> list[str | None]:
        """What the lines of a chart are called, time and slipping first."""
        series = self.client.plots[index].series
        return [line.get("label") for line in series if line.get("show", True)]

    def columns(self, index: int) -> list[bytes]:
        return [np.asarray(column).tobytes() for column in self.client.plots[index].data]


def gui_messages(
    server: ViewerServer, update: Callable[[], None]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """What an update sends, message by message: of which widget, and its properties."""
    buffer = server._websock_server._broadcast_buffer
    before = buffer.message_counter
    update()
    for number in range(before, buffer.message_counter):
        match buffer.message_from_id.get(number):
            case GuiUplotMessage(uuid=uuid, props=props):
                yield uuid, vars(props)
            case GuiUpdateMessage(uuid=uuid, updates=updates):
                yield uuid, updates


def with_third_finger(scenario: Scenario) -> Scenario:
    mapping = scenario.to_mapping()
    mapping["fingers"] = [*mapping["fingers"], {"base": (1.466, -1.3), "face": "bottom"}]
    mapping["estimates"] = []
    mapping["controller"] |= {"grasp_force": "none"}
    return scenario_from_mapping(mapping)


@pytest.fixture
def page(viewer_server: ViewerServer) -> Page:
    return Page(viewer_server)


def test_every_chart_of_a_run_is_on_the_page(page: Page, case_2: RunResult) -> None:
    page.panel.update(view_of(case_2))
    charts = [chart for charts in charts_of(case_2).values() for chart in charts]
    assert len(page.client.plots) == len(charts) == 12
    for chart in charts:
        assert html.escape(chart.about) in page.head(chart.key)
        assert page.head(chart.key).count("data-sg-value") == len(chart.lines)
    for plot in page.client.plots:
        assert len(plot.data) == len(plot.series)


def test_the_legends_read_the_play_head(page: Page, case_2: RunResult) -> None:
    view = at(view_of(case_2), 0.0501)
    page.panel.update(view)
    slip = 1e3 * np.interp(0.0501, case_2.trace.times, case_2.trace.slip[:, 0])
    assert page.readings()["slip"][0] == f"{slip:.4g}"


def test_moving_the_play_head_sends_no_lines_again(page: Page, case_2: RunResult) -> None:
    view = view_of(case_2)
    page.panel.update(view)
    before = [plot.data for plot in page.client.plots]
    heads = [text for text in page.client.texts if "data-sg-chart" in text]
    page.panel.update(at(view, 0.09))
    assert all(plot.data is data for plot, data in zip(page.client.plots, before, strict=True))
    assert [text for text in page.client.texts if "data-sg-chart" in text] == heads
    assert float(page.readings()["slip"][0]) > 30.0


def test_a_line_is_hidden_and_said_to_be_hidden_and_comes_back(
    page: Page, case_2: RunResult
) -> None:
    shown = view_of(case_2)
    page.panel.update(shown)
    before, notes = page.columns(2), page.notes()
    hidden = ChartsReducer().reduce(ToggleLine("forces", "limit-0"), shown)
    page.panel.update(hidden)
    forces = page.client.plots[2]
    assert "left μFₙ" not in page.labels(2)
    assert len(forces.data) == len(forces.series)
    assert forces.bands is not None
    assert len(forces.bands) == 1
    assert "left μFₙ hidden." in page.notes()
    assert page.head("forces").count("aria-pressed='false'") == 1
    page.panel.update(ChartsReducer().reduce(ToggleLine("forces", "limit-0"), hidden))
    assert page.columns(2) == before
    assert page.notes() == notes


@pytest.mark.parametrize("line", ["limit-7", "", "<script>"])
def test_a_line_that_no_chart_has_cannot_be_hidden(case_2: RunResult, line: str) -> None:
    view = view_of(case_2)
    assert ChartsReducer().reduce(ToggleLine("forces", line), view) is view


def test_a_ghost_is_pale_in_every_chart_and_named(page: Page, case_2: RunResult) -> None:
    view = view_of(case_2)
    page.panel.update(view)
    heavier = simulate(with_values(case_2.scenario, {"object.mass": 1.3}))
    ghosted = replace(view, ghost=Ghost(Shown(2, heavier, 0.01), "run before <it>"))
    page.panel.update(ghosted)
    slip = page.client.plots[0]
    strokes = [str(series.get("stroke")) for series in slip.series[2:]]
    assert len(strokes) == 4
    assert strokes[2] == strokes[0].replace(",1)", ",0.4)")
    assert np.nanmax(np.abs(slip.data[4] - slip.data[2])) > 1.0
    assert "Ghost: run before &lt;it&gt;." in page.notes()
    page.panel.update(view)
    assert [page.labels(index)[2:] for index in (0, 1)] == 2 * [["left", "right"]]
    assert "Ghost" not in page.notes()


def test_no_part_of_an_update_leaves_a_line_without_its_column(
    page: Page, viewer_server: ViewerServer, case_2: RunResult
) -> None:
    """The page may draw after any message: viser sends what is much in parts."""
    three = simulate(with_third_finger(case_2.scenario))
    view = view_of(case_2)
    ghosted = replace(view, ghost=Ghost(Shown(2, case_2, 0.01), "the run before"))
    hidden = ChartsReducer().reduce(ToggleLine("forces", "limit-1"), view)
    drawn: dict[str, dict[str, Any]] = {}
    for each in (view, ghosted, view, hidden, ghosted, view_of(three), view):
        for uuid, changed in gui_messages(viewer_server, lambda each=each: page.panel.update(each)):
            if uuid not in drawn and "series" not in changed:
                continue
            plot = drawn.setdefault(uuid, {})
            plot.update(changed)
            assert len(plot["data"]) >= len(plot["series"])
            numbers = [number for band in plot["bands"] for number in band["series"]]
            assert all(number < len(plot["series"]) for number in numbers)
    assert len(drawn) == 12
    assert max(len(plot["data"]) for plot in drawn.values()) == 2 + 2 * 6


def test_it_is_said_where_not_every_sample_is_drawn(page: Page, case_2: RunResult) -> None:
    scenario = with_values(load_scenario("paper-case-2"), {"simulation.output_rate": 1000.0})
    fine = simulate(scenario)
    page.panel.update(view_of(fine, whole_window(fine)))
    assert f"of {len(fine.trace) - 1} samples: every extreme and every event." in page.notes()
    page.panel.update(view_of(fine))
    assert "samples" not in page.notes()


def test_the_tab_of_estimates_is_there_only_with_estimates(page: Page, case_2: RunResult) -> None:
    without = simulate(with_values(load_scenario("sliding-block"), {"simulation.duration": 0.1}))
    tabs = []
    for run in (case_2, without, case_2):
        page.panel.update(view_of(run))
        tabs.append(page.panel._group._tab_labels)
    assert tabs[0] == tabs[2] and tabs[0].index("Estimates") == 2
    assert tabs[1] == tuple(tab for tab in tabs[0] if tab != "Estimates")


def test_readings_follow_a_moving_play_head_ten_times_a_second() -> None:
    window = TimeWindow(0.0, 0.3)
    assert is_reading_due(0.1, 0.2, window, 0.1)
    assert not is_reading_due(0.1, 0.2, window, 0.09)
    assert not is_reading_due(0.1, 0.1005, window, 5.0)


def test_charts_are_drawn_once_their_tab_is_in_sight(page: Page, case_2: RunResult) -> None:
    view = view_of(case_2)
    page.panel.update(replace(view, charts=ChartsView()))
    contact = len(charts_of(case_2)["Contact"])
    assert len(page.client.plots) == contact
    heavier = simulate(with_values(case_2.scenario, {"object.mass": 1.3}))
    energy = ChartsView(seen=frozenset({"Energy"}))
    page.panel.update(replace(view, charts=energy))
    assert len(page.client.plots) == contact + len(charts_of(case_2)["Energy"])
    before = [plot.data for plot in page.client.plots]
    page.panel.update(replace(view_of(heavier), charts=energy))
    same = [plot.data is data for plot, data in zip(page.client.plots, before, strict=True)]
    assert same == [True] * contact + [False] * (len(before) - contact)
