import io
import itertools
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgb

from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.space import PLANAR, SUPPORT
from slipgrasp.core.study.definition import MAX_RUNS
from slipgrasp.core.trace.types import Outcome
from slipgrasp.figures.category_style import colour_of, hatch_of, marker_of
from slipgrasp.figures.files import save_figure
from slipgrasp.figures.map_data import map_axis
from slipgrasp.figures.map_key import KeyLine, draw_key
from slipgrasp.figures.map_marks import nearest_samples
from slipgrasp.figures.style import new_figure, paint, paper_style
from slipgrasp.figures.success_map import draw_success_map
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.study.categories import (
    CATEGORIES,
    HELD,
    categorize,
    category_words,
)
from slipgrasp.recordings.study.map_axes import choose_axes
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.study_row import StudyRow
from tests.recordings.reading_figures import axes_of, texts
from tests.recordings.studying import make_study, run_study

pytestmark = pytest.mark.slow

FRICTIONS = "fingers.0.friction", "fingers.1.friction"
GRID = {key: {"min": 0.2, "max": 0.4, "count": 5} for key in FRICTIONS}
SAMPLES = {
    "object.mass": {"min": 0.5, "max": 8.0, "scale": "log"},
    "fingers.*.friction": {"min": 0.1, "max": 1.0},
}


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    """Case II holds where both frictions are equal, and nowhere else."""
    study = make_study(base="paper-case-2", vary=GRID, title="equal $frictions$ only")
    return run_study(study, tmp_path_factory.mktemp("grid") / "study.mcap")


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    study = make_study(
        sampling={"method": "random", "runs": 25, "seed": 2},
        vary={**SAMPLES, "controller.lyapunov_weight": {"values": [1.0, 20.0]}},
    )
    return run_study(study, tmp_path_factory.mktemp("samples") / "study.mcap")


def marked(axes, gid):
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


def svg_of(figure):
    stream = io.BytesIO()
    save_figure(figure, stream, "svg")
    return stream.getvalue().decode()


def test_each_cell_of_a_grid_has_the_colour_of_its_run_and_leads_to_it(grid):
    figure = draw_success_map(grid, *FRICTIONS)
    cells = next(iter(marked(axes_of(figure, "a"), "runs")))

    categories = categorize(grid)
    assert isinstance(cells, PolyCollection)
    assert len(cells.get_paths()) == 25
    for path, colour, url in zip(
        cells.get_paths(), cells.get_facecolor(), cells.get_urls(), strict=True
    ):
        run = int(url.removeprefix("#run-"))
        assert tuple(colour[:3]) == paint(colour_of(categories[run]))
        values = grid.study.values_of(run)
        centre = path.get_extents()
        assert centre.x0 < values[FRICTIONS[0]] < centre.x1
        assert centre.y0 < values[FRICTIONS[1]] < centre.y1
    held = [run for run in range(25) if categories[run] == HELD]
    assert held == [0, 6, 12, 18, 24], "the diagonal of equal friction"


def test_cells_end_at_the_limits_of_a_parameter_and_unequal_frictions_have_no_base():
    wide = {"min": 0.05, "max": 1.0, "count": 3}
    study = make_study(
        base="paper-case-2",
        vary={"object.mass": wide, "fingers.*.friction": wide},
    )
    study = replace(study, base=with_values(study.base, {"fingers.1.friction": 0.4}))
    mass, friction = (map_axis(StudyResults(study), key) for key in study.keys)
    assert 0.0 <= friction.low < 0.05 and mass.low > 0.0
    assert mass.base == 1.0 and friction.base is None


def test_the_boundary_runs_between_cells_that_hold_and_cells_that_do_not(grid):
    boundary = marked(axes_of(draw_success_map(grid, *FRICTIONS), "a"), "boundary")[0]

    held = (categorize(grid) == HELD).reshape(5, 5)
    across = np.count_nonzero(held[1:] != held[:-1])
    up = np.count_nonzero(held[:, 1:] != held[:, :-1])
    assert isinstance(boundary, LineCollection)
    assert len(boundary.get_segments()) == across + up == 16
    for (x0, y0), (x1, y1) in boundary.get_segments():
        assert (x0 == x1) != (y0 == y1)


def test_equal_values_are_a_line_only_where_both_axes_are_one_quantity(grid, samples):
    line = marked(axes_of(draw_success_map(grid, *FRICTIONS), "a"), "equal")[0]
    assert np.array_equal(line.get_xdata(), line.get_ydata())
    assert r"$\mu_{1}$ = $\mu_{2}$" in texts(draw_success_map(grid, *FRICTIONS))

    other = draw_success_map(samples, *SAMPLES)
    assert marked(axes_of(other, "a"), "equal") == []


def test_the_values_of_the_base_are_marked_where_they_are_on_the_map(grid):
    mark = marked(axes_of(draw_success_map(grid, *FRICTIONS), "a"), "base")[0]
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (0.25, 0.25)

    study = make_study(vary={key: {"min": 0.6, "max": 0.9, "count": 3} for key in FRICTIONS})
    beyond = draw_success_map(StudyResults(study), *FRICTIONS)
    assert marked(axes_of(beyond, "a"), "base") == []


def test_axes_and_panels_say_symbol_key_unit_and_value(samples):
    figure = draw_success_map(samples, *SAMPLES)

    panels = [axes_of(figure, letter) for letter in "ab"]
    assert [axes.get_xlabel() for axes in panels] == ["$m_o$  object.mass  [kg]"] * 2
    assert panels[0].get_ylabel() == r"$\mu$  fingers.*.friction  [–]"
    assert (panels[0].get_xscale(), panels[0].get_yscale()) == ("log", "linear")
    assert {"(a) $Q$ = 1", "(b) $Q$ = 20"} <= set(texts(figure))


def test_the_key_counts_the_runs_of_its_panel(samples):
    figure = draw_success_map(samples, *SAMPLES)

    categories = categorize(samples).reshape(25, 2)
    keys = [axes for axes in figure.axes if not axes.get_label()]
    for panel, axes in enumerate(keys):
        words = [text.get_text() for text in axes.texts]
        counts = [int(word) for word in words if word.isdigit()]
        shown = [category for category in range(len(CATEGORIES)) if np.any(categories == category)]
        assert counts == [np.count_nonzero(categories[:, panel] == category) for category in shown]
        assert CATEGORIES[HELD].words in words


@pytest.mark.parametrize("space", [PLANAR, SUPPORT], ids=lambda space: space.name)
def test_no_words_of_the_key_reach_its_counts(space):
    counts = np.full(len(CATEGORIES), MAX_RUNS)
    panel = SimpleNamespace(counts=counts, runs=range(MAX_RUNS))
    lines = [KeyLine(category_words(k, space), k, {}) for k in range(len(CATEGORIES))]
    with paper_style():
        figure = new_figure(200.0)
        draw_key(figure, lines, panel, (0.0, 0.0, 72.0), has_points=True)
    boxes = [text.get_window_extent() for text in figure.axes[0].texts]
    assert [a for a, b in itertools.combinations(boxes, 2) if a.overlaps(b)] == []


def test_a_map_of_slides_does_not_say_that_they_are_held(tmp_path):
    vary = {
        "support.friction": {"min": 0.2, "max": 0.5, "count": 2},
        "motion.velocity.0": {"min": 0.3, "max": 2.0, "count": 2},
    }
    results = run_study(make_study(base="sliding-block", vary=vary), tmp_path / "study.mcap")
    words = " ".join(texts(draw_success_map(results, *vary)))
    assert "at rest" in words and "held" not in words


def test_each_sample_is_a_point_of_its_way_that_leads_to_its_run(samples):
    figure = draw_success_map(samples, *SAMPLES)

    categories = categorize(samples)
    seen = set()
    for letter in "ab":
        collections = axes_of(figure, letter).collections
        for points in (c for c in collections if (c.get_gid() or "").startswith("runs")):
            for place, url in zip(points.get_offsets(), points.get_urls(), strict=True):
                run = int(url.removeprefix("#run-"))
                values = samples.study.values_of(run)
                assert tuple(place) == tuple(values[key] for key in SAMPLES)
                assert points.get_gid() == f"runs {categories[run]}"
                seen.add(run)
    assert seen == set(range(50))


def test_an_svg_leads_from_every_mark_to_its_run(grid, samples):
    for results, axes in ((grid, FRICTIONS), (samples, SAMPLES)):
        found = re.findall(r'href="#run-(\d+)"', svg_of(draw_success_map(results, *axes)))
        assert sorted(map(int, found)) == list(range(results.num_rows))


def test_what_else_varies_is_told_below_the_map():
    vary = {**SAMPLES, "object.inertia": {"min": 0.005, "max": 0.02}}
    study = make_study(sampling={"method": "random", "runs": 5}, vary=vary)

    words = texts(draw_success_map(StudyResults(study), *SAMPLES))
    note = "Projected: also varied was object.inertia (0.005 … 0.02 kg m²)."
    assert note in words


def test_a_study_that_has_only_begun_is_drawn(grid):
    for count in (0, 1, 7):
        so_far = StudyResults(grid.study)
        for index in range(count):
            so_far.append(row_again(grid, index))
        cells = marked(axes_of(draw_success_map(so_far, *FRICTIONS), "a"), "runs")[0]
        assert len(cells.get_paths()) == count


def row_again(results, index):
    row = results.row(index)
    return StudyRow(
        index=index,
        values={key: row[key] for key in results.study.keys},
        outcome=Outcome(row["outcome"]),
        reason=None,
        end_time=row["end_time"],
        metrics={c.name: row[c.name] for c in results.columns if c.role == "metric"},
        state_hash=row["state_hash"],
        kernel=row["kernel"],
    )


@pytest.mark.parametrize(
    ("vary", "axes"),
    [
        (SAMPLES, tuple(SAMPLES)),
        ({"controller.lyapunov_weight": {"values": [1.0, 20.0]}, **SAMPLES}, tuple(SAMPLES)),
        ({"object.mass": SAMPLES["object.mass"]}, None),
        (
            {
                "object.mass": SAMPLES["object.mass"],
                "controller.lyapunov_weight": {"values": [1.0, 5.0, 20.0]},
                "controller.kind": {"values": ["theorem-3", "theorem-4"]},
            },
            ("object.mass", "controller.lyapunov_weight"),
        ),
        (
            {
                "object.mass": SAMPLES["object.mass"],
                "controller.kind": {"values": ["theorem-3", "theorem-4"]},
            },
            None,
        ),
    ],
)
def test_a_map_is_drawn_over_ranges_rather_than_over_a_choice(vary, axes):
    assert choose_axes(make_study(sampling={"method": "random", "runs": 3}, vary=vary)) == axes


@pytest.mark.parametrize(
    ("x", "y", "finding"),
    [
        ("object.mass", "controller.kind", "'controller.kind' is not a varied numeric parameter"),
        ("object.inertia", "object.mass", "'object.inertia' is not a varied numeric"),
        ("object.mass", "object.mass", "two parameters, not 'object.mass' twice"),
    ],
)
def test_a_map_over_what_does_not_vary_in_numbers_is_refused(x, y, finding):
    kinds = {"controller.kind": {"values": ["theorem-3", "theorem-4"]}}
    study = make_study(sampling={"method": "random", "runs": 3}, vary={**SAMPLES, **kinds})
    with pytest.raises(QueryError, match=re.escape(finding)):
        draw_success_map(StudyResults(study), x, y)


def test_the_ground_shows_the_nearest_sample():
    x, y = np.random.default_rng(3).random((2, 80))
    size = 64
    nearest = nearest_samples(x, y, size)

    centres = (np.arange(size) + 0.5) / size
    across, up = np.meshgrid(centres, centres)
    distances = np.hypot(across[..., None] - x, up[..., None] - y)
    found = np.take_along_axis(distances, nearest[..., None], axis=2)[..., 0]
    assert np.mean(found == distances.min(axis=2)) > 0.98
    assert np.max(found - distances.min(axis=2)) < 1.0 / size


def test_categories_are_told_apart_without_colours():
    failing = [k for k, each in enumerate(CATEGORIES) if each.outcome is not Outcome.STOPPED]
    hatches = [hatch_of(k) for k in failing if CATEGORIES[k].outcome is not Outcome.DIVERGED]
    assert len(set(hatches[1:])) == len(hatches[1:])
    assert hatch_of(HELD) == ""
    luminance = [np.dot(to_rgb(paint(colour_of(k))), (0.299, 0.587, 0.114)) for k in failing]
    assert luminance[0] < 0.5 * min(luminance[1:])
    assert len({(marker_of(k), colour_of(k)) for k in failing}) >= 11
