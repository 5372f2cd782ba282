import numpy as np
import pytest

from slipgrasp.core.run.premises import find_premises
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.scenario.space import PLANAR
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.drawings import draw_figures
from slipgrasp.figures.slip_times import closer_look
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import PHASES
from tests.recordings.reading_figures import axes_of, bars, quantities, texts, titles

pytestmark = pytest.mark.slow

# What the captions of Fig. 5 to 10 list, in their order.
TRACKING = (
    "(a) object horizontal position error",
    "(b) object vertical position error",
    "(c) object orientation error",
    "(d) fingertip slips and their velocities",
)
FORCES = (
    "(a) joint torques of the left finger",
    "(b) force on the object by the left finger",
    "(c) joint torques of the right finger",
    "(d) force on the object by the right finger",
)
PREMISES = (
    "(a) eigenvalues of the integral of Eq. 20",
    "(b) error, and the radius that should bound it",
    "(c) disturbance by unknown friction",
    "(d) correction of the estimates",
)
CAPTIONS = {
    "paper-case-1": {
        "fig-5-tracking": TRACKING,
        "fig-6-estimates": (
            "(a) masses of the left finger links",
            "(b) masses of the right finger links",
            "(c) mass of the object",
        ),
        "fig-7-forces": FORCES,
        "premises": PREMISES,
    },
    "paper-case-2": {
        "fig-8-tracking": TRACKING,
        "fig-9-estimates": (
            "(a) friction at the left fingertip",
            "(b) friction at the right fingertip",
            "(c) mass of the object",
            "(d) moment of inertia of the object",
        ),
        "fig-10-forces": FORCES,
        "premises": PREMISES,
    },
}
UNITS = {
    "tracking": ["[mm]", "[mm]", "[mrad]", "[mm]", "[mm/s]"],
    "fig-6-estimates": ["[kg]", "[kg]", "[kg]"],
    "fig-9-estimates": ["[–]", "[–]", "[kg]", "[kg m²]"],
    "forces": ["[N m]", "[N]", "[N m]", "[N]"],
    "premises": ["$"] * 4,  # sums of unlike units, as the paper has them
}


@pytest.fixture(scope="module")
def paper_runs():
    return {name: simulate(load_scenario(name)) for name in CAPTIONS}


@pytest.fixture(scope="module")
def paper_figures(paper_runs):
    return {name: draw_figures(run) for name, run in paper_runs.items()}


@pytest.mark.parametrize("case", CAPTIONS)
def test_the_papers_figures_have_its_panels_in_its_order(paper_figures, case):
    figures = paper_figures[case]
    assert list(figures) == ["fig-4-schematic", *CAPTIONS[case]]
    for name, captions in CAPTIONS[case].items():
        assert titles(figures[name]) == captions


@pytest.mark.parametrize("case", CAPTIONS)
def test_every_panel_has_its_unit_and_seconds(paper_figures, case):
    for name in CAPTIONS[case]:
        axes = [a for a in paper_figures[case][name].axes if a.get_label().endswith(" slip")]
        plots = [a for a in axes if "phases" not in a.get_label()]
        kind = name if name in UNITS else name.rpartition("-")[2]
        assert len(plots) == len(UNITS[kind])
        for plot, unit in zip(plots, UNITS[kind], strict=True):
            assert plot.get_ylabel().endswith(unit)
        stacked = [plot for plot in plots if not plot.get_xlabel()]
        assert [plot.get_label() for plot in stacked] in ([], ["d 1 slip"])
        assert all("[s]" in plot.get_xlabel() for plot in plots if plot not in stacked)


@pytest.mark.parametrize("case", CAPTIONS)
def test_the_curves_are_the_trace_in_the_units_of_the_axes(paper_runs, paper_figures, case):
    trace = paper_runs[case].trace
    torques, normal, tangential = trace.joint_torque, trace.normal_force, trace.tangential_force
    forces = [
        column
        for i in range(2)
        for column in (*torques[:, 2 * i : 2 * i + 2].T, normal[:, i], tangential[:, i])
    ]
    premises = find_premises(paper_runs[case])
    expected = {
        "premises": np.array(
            [
                np.log10(premises.least_excitation),
                np.log10(premises.error),
                premises.disturbance,
                premises.pull,
            ]
        ),
        "tracking": 1e3
        * np.concatenate([trace.tracking_error.T, trace.slip.T, trace.slip_velocity.T]),
        "estimates": trace.estimates.T,
        "forces": np.array(forces),
    }
    for name, figure in list(paper_figures[case].items())[1:]:
        lines = quantities(figure)
        columns = expected[name.rpartition("-")[2]]
        assert len(lines) == len(columns)
        for line, column in zip(lines, columns, strict=True):
            # Without the row before the selection at t = 0, whose force never acted.
            assert np.array_equal(line.get_xdata(), trace.times[1:])
            assert np.array_equal(line.get_ydata(), column[1:], equal_nan=True)


@pytest.mark.parametrize("case", CAPTIONS)
def test_phases_are_coloured_where_the_trace_has_them(paper_runs, paper_figures, case):
    run = paper_runs[case]
    events = {change.time for change in run.phase_changes}
    times = np.array([t for t in run.trace.times if t not in events])
    rows = np.searchsorted(run.trace.times, times)
    name = list(CAPTIONS[case])[2]
    for contact, letter in enumerate("bd"):
        lanes = axes_of(paper_figures[case][name], f"{letter} phases whole")
        for phase in ContactPhase.known(PLANAR):
            painted = np.zeros(len(times), dtype=bool)
            for start, end in bars(lanes, paint(PHASES[phase])):
                painted |= (start <= times) & (times <= end)
            assert np.array_equal(painted, run.trace.phase[rows, contact] == phase)


@pytest.mark.parametrize("case", CAPTIONS)
@pytest.mark.parametrize("kind", [0, 1, 2])
def test_the_background_is_tinted_exactly_while_contacts_slip(
    paper_runs, paper_figures, case, kind
):
    run = paper_runs[case]
    ends = [max(c.time for c in run.phase_changes if c.contact == i) for i in range(2)]
    name = list(CAPTIONS[case])[kind]
    for axes in paper_figures[case][name].axes:
        letter, _, rest = axes.get_label().partition(" ")
        if not rest.endswith(("whole", "slip")) or "phases" in rest:
            continue
        title = titles(paper_figures[case][name])["abcd".index(letter)]
        contacts = [i for i, word in enumerate(("left", "right")) if word in title] or [0, 1]
        spans = [
            (path.vertices[:, 0].min(), path.vertices[:, 0].max())
            for collection in axes.collections
            for path in collection.get_paths()
        ]
        assert sorted(spans) == sorted((0.0, ends[i]) for i in contacts)


@pytest.mark.parametrize("case", CAPTIONS)
def test_the_slip_is_seen_in_a_closer_look(paper_runs, paper_figures, case):
    """A tenth of a second of seven would be a line a millimetre wide."""
    run = paper_runs[case]
    start, end = closer_look(run)
    assert start == 0.0
    assert run.metrics.last_slip_time < end < 2.0 * run.metrics.last_slip_time
    for name in CAPTIONS[case]:
        axes = axes_of(paper_figures[case][name], "a slip")
        assert axes.get_xlim() == (start, end)
        assert axes.get_ylim() == axes_of(paper_figures[case][name], "a whole").get_ylim()


@pytest.mark.parametrize(("case", "number"), [("paper-case-1", 6), ("paper-case-2", 9)])
def test_true_values_are_thin_dashed_lines(paper_runs, paper_figures, case, number):
    figure = paper_figures[case][f"fig-{number}-estimates"]
    truth = paper_runs[case].trace.true_parameters[-1]
    whole = [axes for axes in figure.axes if axes.get_label() in ("a whole", "b whole", "c whole")]
    for axes in whole:
        estimates = [line for line in axes.lines if line.get_linestyle() == "-"]
        dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
        assert len(dashed) == len(estimates)
        assert max(d.get_linewidth() for d in dashed) < estimates[0].get_linewidth()
        assert {d.get_ydata()[-1] for d in dashed} <= set(truth)


def test_tangential_forces_are_drawn_inside_their_cones(paper_figures):
    axes = axes_of(paper_figures["paper-case-2"]["fig-10-forces"], "b whole")
    upper, lower = (line.get_ydata() for line in axes.lines if line.get_linestyle() == "--")
    normal, tangential = (
        line.get_ydata()
        for line in axes.lines
        if line.get_linestyle() == "-" and len(line.get_ydata()) > 2
    )
    np.testing.assert_allclose(upper, 0.25 * normal, rtol=1e-15)
    assert np.array_equal(lower, -upper)
    # While it slips the force is on the cone, to the accuracy of the friction rows.
    assert (np.abs(tangential) <= upper + 1e-9).all()


def test_signals_that_are_zero_up_to_rounding_look_like_zero(paper_figures):
    """In case II symmetry keeps the object upright to 1e-16 rad: less than a pixel."""
    axes = axes_of(paper_figures["paper-case-2"]["fig-8-tracking"], "c whole")
    low, high = axes.get_ylim()
    assert high - low > 0.01
    assert low < 0.0 < high


def test_the_schematic_names_and_measures_what_the_paper_does(paper_figures):
    words = texts(paper_figures["paper-case-1"]["fig-4-schematic"])
    for k in range(1, 5):
        assert f"$l_{{{k}}}$ = 1 m" in words
        assert f"$q_{{{k}}}$" in words
    for expected in (
        "$L_o$ = 0.1 m",
        "0.1458 m",
        r"$\mu_1$ = 0.25",
        "$x_{c2}$",
        "$n_2$",
        "$s_1>0$",
        "(2.932, 0) m",
        "$(x_o, y_o)$ = (1.466, 0.366) m",
        "$m_o$ = 1 kg,  $I_o$ = 0.01042 kg m²",
    ):
        assert expected in words
