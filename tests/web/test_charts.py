"""What the charts show."""

from __future__ import annotations

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.web.charts.chart import Chart, Line
from slipgrasp.web.charts.charts import charts_of, rate_of_change
from slipgrasp.web.charts.columns import Drawing
from slipgrasp.web.charts.drawn import DrawnChart
from slipgrasp.web.model.playback import TimeWindow


def chart_of(result: RunResult, key: str) -> Chart:
    """The chart of a run with a key."""
    return next(
        chart for charts in charts_of(result).values() for chart in charts if chart.key == key
    )


def test_every_chart_and_every_line_has_a_key_of_its_own(case_2: RunResult) -> None:
    charts = [chart for charts in charts_of(case_2).values() for chart in charts]
    assert len({chart.key for chart in charts}) == len(charts)
    for chart in charts:
        assert len({line.key for line in chart.lines}) == len(chart.lines)
        assert all(len(line.values) == len(case_2.trace) for line in chart.lines)


def test_charts_are_in_the_units_of_their_titles(case_2: RunResult) -> None:
    slip, velocity = chart_of(case_2, "slip"), chart_of(case_2, "slip-velocity")
    assert (slip.unit, velocity.unit) == ("mm", "mm/s")
    assert max(line.values.max() for line in slip.lines) == pytest.approx(47.23, abs=0.01)


def test_every_finger_has_its_force_and_the_limit_that_it_is_held_against(
    case_1: RunResult,
) -> None:
    forces = chart_of(case_1, "forces")
    assert [line.dashed for line in forces.lines] == [False, False, True, True]
    used, limit = forces.lines[0], forces.lines[2]
    assert used.colour == limit.colour
    slipping = case_1.trace.phase[:, 0] != 0
    np.testing.assert_allclose(used.values[slipping], limit.values[slipping], atol=1e-9)


def test_the_band_of_a_finger_is_its_friction_margin(case_2: RunResult) -> None:
    forces = chart_of(case_2, "forces")
    lines = {line.key: line.values for line in forces.lines}
    margins = [lines[upper] - lines[lower] for upper, lower in forces.bands]
    np.testing.assert_allclose(np.stack(margins, axis=1), case_2.trace.friction_margin, atol=1e-9)


def test_estimates_are_charted_by_unit_beside_the_truth(case_2: RunResult) -> None:
    charts = charts_of(case_2)["Estimates"]
    assert [chart.title for chart in charts] == [
        "Friction estimates and true values",
        "Mass estimates and true values",
        "Inertia estimates and true values",
    ]
    mass = charts[1]
    assert [line.label for line in mass.lines] == ["object mass", "true"]
    assert set(mass.lines[1].values) == {1.0}


def test_small_estimates_are_told_in_thousandths(case_2: RunResult) -> None:
    inertia = chart_of(case_2, "estimates-inertia")
    assert inertia.unit == "10⁻³ kg m²"
    assert set(inertia.lines[1].values) == {10.42}


@pytest.mark.parametrize(
    ("step", "expected"), [(1e-15, (1.998, 2.002)), (0.0, None), (0.1, None)], ids=str
)
def test_lines_that_differ_by_rounding_are_drawn_flat(
    case_2: RunResult, step: float, expected: tuple[float, float] | None
) -> None:
    values = np.full(len(case_2.trace), 2.0)
    values[len(values) // 2 :] += step
    line = Line("mass", "mass", (0, 0, 0), values)
    chart = Chart("mass", "Mass", "kg", "", (line,))
    window = TimeWindow(0.0, case_2.end_time)
    drawn = DrawnChart(chart, frozenset(), Drawing.of(case_2.trace, chart, window))
    wanted = None if expected is None else pytest.approx(expected)
    assert drawn.flat_range == wanted


def test_a_run_without_unknowns_has_no_charts_of_estimates() -> None:
    scenario = with_values(
        load_scenario("paper-case-2"), {"estimates": [], "simulation.duration": 0.01}
    )
    assert charts_of(simulate(scenario))["Estimates"] == ()


def test_the_energy_ledger_balances(case_2: RunResult) -> None:
    lines = {line.key: line.values for line in chart_of(case_2, "energy").lines}
    stored = lines["kinetic"] - lines["kinetic"][0] + lines["potential"]
    np.testing.assert_allclose(
        stored - lines["supplied"] + lines["dissipated"], lines["error"], atol=1e-12
    )
    assert lines["dissipated"][-1] > 0.0


def test_the_rate_of_a_parabola_is_exact_between_uneven_rows() -> None:
    times = np.array([0.0, 0.1, 0.15, 0.4, 1.0])
    rate = rate_of_change(times, 3.0 * times**2)
    np.testing.assert_allclose(rate[1:-1], 6.0 * times[1:-1], rtol=1e-12)


def test_no_rate_is_taken_over_an_event() -> None:
    times = np.array([0.0, 1.0, 1.0, 2.0])
    values = np.array([0.0, 2.0, 100.0, 97.0])
    assert rate_of_change(times, values).tolist() == [2.0, 2.0, -3.0, -3.0]


def test_a_single_row_has_no_rate() -> None:
    assert rate_of_change(np.zeros(2), np.array([1.0, 5.0])).tolist() == [0.0, 0.0]
