"""The picture of two runs shows both, their difference and where it begins."""

import io
from dataclasses import replace

import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.trace import Trace
from slipgrasp.figures.animation import write_gif
from slipgrasp.figures.comparison import draw_comparison
from slipgrasp.figures.files import save_figure, write_figure
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.exceptions import RecordingExistsError
from tests.recordings.reading_figures import axes_of

pytestmark = pytest.mark.slow

CASE_1 = load_scenario("paper-case-1")


@pytest.fixture(scope="module")
def runs():
    changed = with_values(CASE_1, {"fingers.0.friction": 0.2525})
    return simulate(CASE_1), simulate(changed)


@pytest.fixture(scope="module")
def figure(runs):
    return draw_comparison(compare(*runs), *runs, ("before", "after"))


def lines_of(axes, count):
    """The data of curves, without the marks that cross the axes."""
    curves = [line.get_xydata() for line in axes.lines if len(line.get_xydata()) > 2]
    assert len(curves) == count
    return curves


def test_both_runs_are_drawn_over_each_other_sample_by_sample(figure, runs):
    curves = lines_of(axes_of(figure, "b whole"), 4)

    expected = [1e3 * run.trace.slip[1:, contact] for contact in (0, 1) for run in runs]
    for curve, values in zip(curves, expected, strict=True):
        assert curve[:, 1].tobytes() == values.tobytes()


def test_the_difference_is_drawn_at_the_common_instants_only(figure, runs):
    one, other = (dict(zip(r.trace.times, 1e3 * r.trace.slip, strict=True)) for r in runs)
    common = sorted(one.keys() & other.keys())
    curves = lines_of(axes_of(figure, "b difference whole"), 2)

    for contact, curve in enumerate(curves):
        drawn = dict(curve.tolist())
        assert sorted(drawn) == common
        expected = [other[t][contact] - one[t][contact] for t in common]
        assert [drawn[t] for t in common] == pytest.approx(expected, abs=1e-15)


def test_a_dotted_line_marks_where_the_runs_diverge(figure, runs):
    first = compare(*runs).first_divergence["slip_0"]

    dotted = [line for line in axes_of(figure, "b whole").lines if line.get_linestyle() == ":"]
    assert [line.get_xdata()[0] for line in dotted] == [first]


def test_the_phases_of_both_runs_stand_below_each_other(figure, runs):
    for contact in (0, 1):
        for run, name in zip(runs, "ab", strict=True):
            strip = axes_of(figure, f"phases {contact} {name} slip")
            edges = {
                round(x, 9)
                for bars in strip.collections
                for path in bars.get_paths()
                for x in path.vertices[:, 0]
            }
            (stick,) = (
                change.time
                for change in run.phase_changes
                if change.contact == contact and change.time > 0.0
            )
            assert round(stick, 9) in edges


def test_everything_that_is_promised_is_in_the_picture(figure):
    words = " ".join(text.get_text() for axes in figure.axes for text in axes.texts)
    titles = ("phases of the contacts", "fingertip slips", "normal forces", "distance to slip")
    assert all(title in words for title in titles)
    legends = [axes.get_legend() for axes in figure.axes if axes.get_legend()]
    legend = " ".join(text.get_text() for each in legends for text in each.get_texts())
    assert "a: before" in legend and "b: after" in legend


def test_any_two_comparable_runs_can_be_drawn(runs):
    """One of them shorter, and of another rate."""
    other = {"simulation.duration": 2.0, "simulation.output_rate": 30.0}
    run = simulate(with_values(CASE_1, other))

    figure = draw_comparison(compare(runs[0], run), runs[0], run, ("a$b", "x" * 200))

    picture = io.BytesIO()
    save_figure(figure, picture, "png")
    assert picture.getvalue().startswith(b"\x89PNG")
    (low, high) = axes_of(figure, "b whole").get_xlim()
    assert (low, high) == (0.0, 7.0)


def test_cases_with_other_unknowns_are_drawn_with_those_they_share(runs):
    other = simulate(load_scenario("paper-case-2"))

    figure = draw_comparison(compare(runs[0], other), runs[0], other)

    titles = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert any("estimated mass of the object" in title for title in titles)
    assert not any("estimated link masses" in title for title in titles)


def test_equal_comparisons_give_equal_files_and_none_is_replaced_unasked(figure, tmp_path):
    write_figure(figure, tmp_path / "one.svg")
    write_figure(figure, tmp_path / "two.svg")
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()

    with pytest.raises(RecordingExistsError):
        write_figure(figure, tmp_path / "one.svg")
    write_figure(figure, tmp_path / "one.svg", overwrite=True)


def test_numbers_as_large_as_they_get_can_be_drawn(runs):
    rows = runs[0].trace.to_rows()
    columns = [column.name for column in columns_of(runs[0].trace)]
    for name in ("slip_0", "normal_force_1", "x", "theta", "joint_position_0_0"):
        rows[700:, columns.index(name)] = 1.7e308
    run = replace(runs[0], trace=Trace.from_rows(runs[0].trace.shape, rows))

    figure, film = io.BytesIO(), io.BytesIO()
    save_figure(draw_comparison(compare(runs[0], run), runs[0], run), figure, "svg")
    write_gif(run, film, fps=1.0)

    assert figure.getvalue().rstrip().endswith(b"</svg>")
    assert film.getvalue().startswith(b"GIF89a")


def test_runs_that_slip_all_the_time_are_drawn_without_a_closer_look():
    run = simulate(with_values(CASE_1, {"simulation.duration": 0.05}))
    figure = draw_comparison(compare(run, run), run, run)
    assert not [axes for axes in figure.axes if axes.get_label().endswith(" slip")]
