"""Charts of soft fingertips."""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.figures.panels_in_space import spatial_tracking_panels
from slipgrasp.web.charts.chart import moment_limits
from slipgrasp.web.charts.charts import contact_charts
from slipgrasp.web.charts.xy import xy_charts

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def soft_run():
    values = {f"fingers.{i}.pad_radius": 0.015 for i in range(3)}
    scenario = with_values(load_scenario("spatial-composite"), {"simulation.duration": 0.05})
    return simulate(with_values(scenario, values))


def test_a_moment_is_held_against_what_its_tangential_force_leaves(soft_run):
    moments = np.abs(soft_run.trace.torsional_moment)[1:]
    limits = moment_limits(soft_run)[1:]
    slips = soft_run.trace.phase[1:] != 0
    np.testing.assert_allclose(moments[slips], limits[slips], rtol=1e-5, atol=1e-9)
    assert (moments[~slips] < limits[~slips] + 1e-9).all()
    (chart,) = (chart for chart in contact_charts(soft_run) if chart.key == "moments")
    assert chart.lines[0].values[-1] == pytest.approx(1e3 * moments[-1, 0])


def test_soft_fingertips_have_a_chart_of_their_spin_and_a_figure(soft_run):
    (chart,) = (chart for chart in contact_charts(soft_run) if chart.key == "spin")
    assert chart.unit == "mrad"
    np.testing.assert_array_equal(chart.lines[1].values, 1e3 * soft_run.trace.spin[:, 1])
    assert len(spatial_tracking_panels(soft_run)) == 4


def test_moment_over_tangential_force_ends_on_the_circle_where_a_fingertip_slips(soft_run):
    (chart,) = (xy for xy in xy_charts(soft_run) if xy.chart.key == "xy-moment")
    for i, (line, across) in enumerate(zip(chart.chart.lines, chart.across, strict=True)):
        slips = soft_run.trace.phase[:, i] != 0
        slips[0] = False
        np.testing.assert_allclose(np.hypot(line.values, across)[slips], 1.0, rtol=1e-9)
