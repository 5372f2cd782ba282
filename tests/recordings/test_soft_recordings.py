"""Runs with soft fingertips as files and tables."""

import io

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.export import write_csv
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.schemas import format_of
from slipgrasp.recordings.file.versions import SOFT_FORMAT, SPATIAL_FORMAT
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store.run_query import FIGURES

pytestmark = pytest.mark.slow

SPINS = ("spin", "spin_velocity", "torsional_moment")


def short(pad_radius):
    values = {f"fingers.{i}.pad_radius": pad_radius for i in range(3)}
    scenario = with_values(load_scenario("spatial-composite"), {"simulation.duration": 0.05})
    return simulate(with_values(scenario, values))


@pytest.fixture(scope="module")
def soft_run():
    return short(0.015)


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


def test_the_short_table_has_the_spins_contact_by_contact(soft_run):
    stream = io.StringIO()
    write_csv(soft_run, stream)
    head = stream.getvalue().splitlines()[0].split(",")
    first = head.index("spin_0")
    assert head[first : first + 9] == [f"{name}_{i}" for i in range(3) for name in SPINS]


def test_spins_can_be_searched_for():
    assert {"spin_path_0", "spin_end_2"} <= set(FIGURES)
