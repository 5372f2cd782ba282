"""Curves of chosen signals: what is drawn is what the trace holds."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from slipgrasp.cli.main import main
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.figures.panels import finger_colour
from slipgrasp.figures.style import paint

SHORT = {"simulation.duration": 0.2}


@pytest.fixture(scope="module")
def run():
    return simulate(with_values(load_scenario("paper-case-2"), SHORT))


@pytest.fixture(scope="module")
def other():
    return simulate(with_values(with_law(load_scenario("paper-case-2"), "composite"), SHORT))


def lines(axes):
    return {line.get_label(): line for line in axes.get_lines()}


@pytest.mark.parametrize("preset", ["paper-case-2", "spatial-prism"])
def test_every_signal_is_drawn_with_all_its_numbers_and_its_unit(preset):
    result = simulate(with_values(load_scenario(preset), {"simulation.duration": 0.02}))
    columns = columns_of(result.trace)[1:]
    for signal in dict.fromkeys(column.signal for column in columns):
        (axes,) = result.plot(signal).axes
        drawn = lines(axes)
        for column in (c for c in columns if c.signal == signal):
            np.testing.assert_array_equal(drawn[column.name].get_xdata(), result.trace.times)
            np.testing.assert_array_equal(drawn[column.name].get_ydata(), column.values)
            assert column.unit in axes.get_ylabel()


def test_two_runs_share_axes_and_colours(run, other):
    figure = run.plot("slip", "normal_force_1", over=other, time=(0.0, 0.05))
    slip, force = figure.axes
    solid, *_, dashed = slip.get_lines()
    assert to_rgba(solid.get_color()) == to_rgba(paint(finger_colour(0)))
    assert to_rgba(force.get_lines()[0].get_color()) == to_rgba(paint(finger_colour(1)))
    np.testing.assert_array_equal(dashed.get_ydata(), other.trace.slip[:, 1])
    assert dashed.is_dashed() and not solid.is_dashed()
    assert force.get_xlim() == (0.0, 0.05)
    inside = [t.normal_force[t.times <= 0.05, 1] for t in (run.trace, other.trace)]
    shown = np.concatenate(inside)
    low, high = force.get_ylim()
    assert low < shown.min() and shown.max() < high < 1.1 * shown.max()
    assert figure.get_suptitle() == f"solid: {run.name}; dashed: {other.name}"


def test_what_cannot_be_drawn_is_refused_in_a_sentence(run):
    with pytest.raises(ScenarioError, match="no signal 'slp'; did you mean 'slip'"):
        run.plot("slp")
    with pytest.raises(ScenarioError, match="the start must be before the end"):
        run.plot("slip", time=(0.2, 0.1))


def test_the_command_draws_the_same(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chosen = ["figures", "paper-case-2", "--signals", "slip, phase_0", "--format", "svg"]
    assert main([*chosen, "--over", "composite-case-2", "--time", "0,0.2"]) == 0
    (file,) = tmp_path.rglob("*.svg")
    assert file.name == "signals.svg" and str(file.relative_to(tmp_path)) in capsys.readouterr().out
    assert main([*chosen[:2], "--over", "composite-case-2"]) == 2
    assert "--over and --time need --signals" in capsys.readouterr().err
