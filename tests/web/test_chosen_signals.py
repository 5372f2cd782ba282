"""Any recorded signal in a chart: found by its name, drawn with its unit, taken out again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.web.charts.chosen import CHOSEN_TAB, chosen_charts, search_html
from slipgrasp.web.charts.drawn import ChartedRun
from slipgrasp.web.charts.xy import XY_TAB
from slipgrasp.web.model.charts_view import MOST_CHOSEN
from slipgrasp.web.model.intents.picture import ToggleLine, ToggleSignal
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.charts import ChartsReducer
from tests.web.test_charts_panel import view_of


def chosen(view: ViewState, *names: str) -> ViewState:
    for name in names:
        view = ChartsReducer().reduce(ToggleSignal(name), view)
    return view


def test_a_part_of_a_name_finds_the_first_signal_that_is_not_chosen_yet(
    case_2: RunResult,
) -> None:
    view = view_of(case_2)
    for part in ("Torque", "torque", "", "no such signal"):
        view = ChartsReducer().reduce(ToggleSignal(part), view)
    assert view.charts.chosen == ("torque_0_0", "torque_0_1")


def test_every_column_of_the_tables_can_be_charted_with_its_values_and_unit(
    case_2: RunResult,
) -> None:
    for column in columns_of(case_2.trace)[1:]:
        (chart,) = chosen_charts(case_2, [column.name])
        (line,) = chart.lines
        assert (line.label, chart.unit) == (column.name, column.unit or "1")
        np.testing.assert_array_equal(line.values, column.values)


def test_signals_of_one_unit_share_a_chart_in_the_order_in_which_they_were_chosen(
    case_2: RunResult,
) -> None:
    names = ["torque_1_0", "slip_0", "torque_0_0", "no such signal"]
    charts = chosen_charts(case_2, names)
    assert [[line.key for line in chart.lines] for chart in charts] == [
        ["torque_1_0", "torque_0_0"],
        ["slip_0"],
    ]


def test_a_signal_is_added_once_and_taken_out_again_and_its_line_can_be_hidden(
    case_2: RunResult,
) -> None:
    view = chosen(view_of(case_2), "slip_0", "lyapunov_value")
    assert view.charts.chosen == ("slip_0", "lyapunov_value")
    assert chosen(view, "slip_0").charts.chosen == ("lyapunov_value",)
    assert chosen(view, "no such signal") is view
    hidden = ChartsReducer().reduce(ToggleLine("signals-m", "slip_0"), view)
    assert hidden.charts.hidden_in("signals-m") == {"slip_0"}


def test_there_is_an_end_to_what_can_be_chosen(case_2: RunResult) -> None:
    names = [column.name for column in columns_of(case_2.trace)[1:]]
    view = chosen(view_of(case_2), *names)
    assert view.charts.chosen == tuple(names[:MOST_CHOSEN])


def test_a_run_that_lacks_a_signal_shows_the_others(case_1: RunResult, case_2: RunResult) -> None:
    view = chosen(view_of(case_2), "estimate_fingers.0.friction", "slip_0")
    other = ChartedRun.of(case_1, view=view.charts)
    assert [chart.key for chart in other.tabs[CHOSEN_TAB]] == ["signals-m"]
    back = replace(view, shown=view_of(case_1).shown)
    assert chosen(back, "slip_0").charts.chosen == ("estimate_fingers.0.friction",)


def test_the_field_offers_what_is_not_chosen_and_says_what_it_is(case_2: RunResult) -> None:
    html = search_html(case_2.trace, ("slip_0",))
    assert "<option value='slip_1'>" in html
    assert "<option value='slip_0'>" not in html
    assert "slip_0 ✕" in html


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_on_the_page_a_signal_is_found_by_name_and_drawn_against_another(page: Page) -> None:
    page.get_by_role("tab", name=CHOSEN_TAB, exact=True).click()
    field = page.get_by_label("Add a signal")
    for name in ("torque_0_1", "commanded_torque_0_1"):
        field.fill(name)
        field.press("Enter")
        expect(page.locator(".sg-chip", has_text=name).first).to_be_visible()
    head = page.locator("[data-sg-chart='signals-N m']")
    expect(head).to_contain_text("commanded_torque_0_1")
    expect(head.locator("[data-sg-value]").first).not_to_be_empty()
    page.get_by_role("button", name="torque_0_1 ✕", exact=True).click()
    expect(head.locator("[data-sg-value]")).to_have_count(1)

    page.locator(".u-over:visible").first.click(modifiers=["Shift"])
    expect(head).to_contain_text("Δ")
    page.get_by_role("tab", name=XY_TAB, exact=True).click()
    page.get_by_label("Chosen signals against").select_option("slip_0")
    chart = page.get_by_role("img", name="Chosen signals against slip_0")
    for spots in ("[data-sg-spot]", "[data-sg-marked]"):
        expect(chart.locator(spots)).to_have_attribute("r", "4.5")
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("m")
    expect(chart.locator("[data-sg-marked]")).not_to_have_attribute("r", "4.5")
