"""Curves of chosen signals: what is drawn is what the trace holds."""

from pathlib import Path

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
from slipgrasp.figures.signals import LONGEST_TITLE
from slipgrasp.figures.style import paint
from slipgrasp.recordings.measured.csv_import import ImportOptions, import_csv
from slipgrasp.recordings.measured.recording import read_measured

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
    assert figure.get_suptitle() == f"solid: {run.name}\ndashed: {other.name}"


def test_a_title_stands_above_the_runs_on_one_line(run, other):
    title = " A lift\n of $3 "
    assert run.plot("slip", title=title).get_suptitle() == "A lift of $3"
    drawn = run.plot("slip", over=other, title=title).get_suptitle()
    assert drawn == f"A lift of $3\nsolid: {run.name}\ndashed: {other.name}"
    figure = run.plot("slip", title="n" * LONGEST_TITLE)
    figure.canvas.draw()
    extent = figure._suptitle.get_window_extent()
    assert extent.x0 >= 0.0 and extent.x1 <= figure.bbox.width
    for wrong in (" ", "n" * (LONGEST_TITLE + 1)):
        with pytest.raises(ScenarioError, match=r"title has \d+ characters; allowed: 1 to 100"):
            run.plot("slip", title=wrong)


def test_what_cannot_be_drawn_is_refused_in_a_sentence(run):
    with pytest.raises(ScenarioError, match="no signal 'slp'; did you mean 'slip'"):
        run.plot("slp")
    with pytest.raises(ScenarioError, match="the start must be before the end"):
        run.plot("slip", time=(0.2, 0.1))


def test_the_command_draws_the_same(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chosen = ["figures", "paper-case-2", "--signals", "slip, phase_0", "--format", "svg"]
    assert main([*chosen, "--over", "composite-case-2", "--time", "0,0.2", "--title", "Slow"]) == 0
    (file,) = tmp_path.rglob("*.svg")
    assert file.name == "signals.svg" and str(file.relative_to(tmp_path)) in capsys.readouterr().out
    assert "Slow" in file.read_text()
    assert main([*chosen, "--title", ""]) == 2
    assert "title has 0 characters" in capsys.readouterr().err
    assert main([*chosen[:2], "--over", "composite-case-2"]) == 2
    assert "--over, --time and --title need --signals" in capsys.readouterr().err


def test_measured_data_are_dots_over_a_run(run, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    times, slips = np.linspace(0.0, 0.05, 7), np.linspace(0.0, 1e-3, 7)
    rows = "".join(f"{t},{1e3 * s}\n" for t, s in zip(times, slips, strict=True))
    Path("data.csv").write_text("time,s\n" + rows)
    maps = {"t": "time:s", "slip_1": "s:mm"}
    import_csv("data.csv", Path("data.mcap"), ImportOptions(mapping=maps))
    figure = run.plot("slip", "normal_force", over=read_measured("data.mcap"))
    dots = [line for line in figure.axes[0].get_lines() if line.get_linestyle() == "None"]
    drawn = [line for line in dots if np.isfinite(line.get_ydata()).any()]
    assert len(drawn) == 1 and to_rgba(drawn[0].get_color()) == to_rgba(paint(finger_colour(1)))
    np.testing.assert_allclose(drawn[0].get_xdata(), times, atol=1e-15)
    np.testing.assert_allclose(drawn[0].get_ydata(), slips, atol=1e-15)
    assert figure.get_suptitle() == f"solid: {run.name}\ndots: data"

    chosen = ["figures", "paper-case-2", "--signals", "slip", "--format", "svg"]
    assert main([*chosen, "--over", "data.csv"]) == 2
    assert "'slipgrasp import' makes a recording of a table" in capsys.readouterr().err
    assert main([*chosen, "--over", "data.mcap"]) == 0
    assert "dots: data" in next(tmp_path.rglob("*.svg")).read_text()
