"""Runs with soft fingertips as files and tables."""

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.figures.lenses import add_lenses
from slipgrasp.figures.style import paper_style
from slipgrasp.recordings.export import write_csv
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.schemas import format_of
from slipgrasp.recordings.file.versions import SOFT_FORMAT, SPATIAL_FORMAT
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store.run_query import FIGURES
from slipgrasp.scene.parts import PAD_POINTER
from tests.recordings.reading_display import read_topic, shown_rows

pytestmark = pytest.mark.slow

SPINS = ("spin", "spin_velocity", "torsional_moment")


def short(pad_radius):
    values = {f"fingers.{i}.pad_radius": pad_radius for i in range(3)}
    scenario = with_values(load_scenario("spatial-composite"), {"simulation.duration": 0.05})
    return simulate(with_values(scenario, values))


@pytest.fixture(scope="module")
def soft_run():
    return short(0.015)


@pytest.fixture(scope="module")
def pivot():
    values = {"simulation.duration": 0.5}
    return simulate(with_values(load_scenario("parallel-gripper"), values))


def test_a_run_with_soft_fingertips_reads_back_bit_for_bit(soft_run, same_run, tmp_path):
    write_recording(soft_run, tmp_path / "run.mcap")
    back = read_recording(tmp_path / "run.mcap")
    same_run(back, soft_run)
    assert format_of(back.trace.shape) == SOFT_FORMAT
    assert not back.trace.absent
    assert np.abs(back.trace.spin).max() > 0.0
    assert back.metrics.spin_end == soft_run.metrics.spin_end


def test_a_run_with_points_keeps_its_format_and_has_no_spins(tmp_path):
    run = short(0.0)
    write_recording(run, tmp_path / "run.mcap")
    back = read_recording(tmp_path / "run.mcap")
    assert format_of(back.trace.shape) == SPATIAL_FORMAT
    assert back.trace.spin.shape == (len(back.trace), 0)
    assert not back.trace.absent
    assert back.metrics.spin_path == ()
    assert "spin_path_0" not in back.metrics.flattened()


def test_foxglove_shows_a_pad_as_a_disc_with_a_line_that_turns(pivot, tmp_path):
    write_recording(pivot, tmp_path / "run.mcap")
    scenes = [scene for _, _, _, scene in read_topic(tmp_path / "run.mcap", "/scene")]
    samples = shown_rows(pivot)
    for row in (0, len(scenes) - 1):
        contact = next(each for each in scenes[row].entities if each.id == "contact_0")
        assert [(each.size.x, each.size.y) for each in contact.cylinders[:1]] == [(0.03, 0.03)]
        start, end = contact.lines[0].points
        spin = samples.spin[row, 0]
        assert (start.x, start.y, start.z, end.z) == (0.0, 0.0, 0.0, 0.0)
        reach = PAD_POINTER * 0.015
        assert_allclose((end.x, end.y), (-reach * np.cos(spin), -reach * np.sin(spin)), atol=1e-12)
    assert abs(spin) > 0.1


def test_moving_pictures_show_the_pad_of_a_soft_fingertip(pivot):
    times = np.array([0.0, pivot.end_time])
    with paper_style():
        lens = add_lenses(Figure().add_axes((0, 0, 1, 1)), pivot, motion_of(pivot, times))[1]
    pad, hand = lens.artists[3:5]
    ends = []
    for frame in range(2):
        lens.place(frame)
        assert pad.get_visible() and hand.get_visible()
        points = np.column_stack(hand.get_data())
        assert_allclose(points[0], pad.center)
        ends.append((points[1] - points[0]) / pad.radius)
    spin = pivot.trace.spin[-1, 1]
    assert_allclose(ends, [(0.0, 1.0), (np.sin(spin), np.cos(spin))], atol=1e-12)
    hard = short(0.0)
    with paper_style():
        lens = add_lenses(Figure().add_axes((0, 0, 1, 1)), hard, motion_of(hard, times[:1]))[0]
    assert not any(part.get_visible() for part in lens.artists[3:5])


def test_the_short_table_has_the_spins_contact_by_contact(soft_run):
    stream = io.StringIO()
    write_csv(soft_run, stream)
    head = stream.getvalue().splitlines()[0].split(",")
    first = head.index("spin_0")
    assert head[first : first + 9] == [f"{name}_{i}" for i in range(3) for name in SPINS]


def test_spins_can_be_searched_for():
    assert {"spin_path_0", "spin_end_2"} <= set(FIGURES)
