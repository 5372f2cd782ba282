"""A run of a hand in space as a file: read back, verified, and refused by what cannot draw it."""

import io

import numpy as np
import pytest

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.figures.animation import write_gif
from slipgrasp.figures.drawings import figure_names
from slipgrasp.recordings.compare.verification import verify
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording


@pytest.fixture(scope="module")
def run():
    scenario = with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.12})
    return simulate(scenario)


@pytest.fixture
def path(run, tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(run, path)
    return path


def test_it_is_read_back_as_it_was_and_verified_bit_for_bit(run, path):
    read = read_recording(path)
    assert read.scenario == run.scenario
    assert np.array_equal(read.trace.to_rows(), run.trace.to_rows())
    assert read.phase_changes == run.phase_changes
    assert read.metrics == run.metrics
    assert read.trace.absent == frozenset()
    found = verify(read)
    assert found.same and found.bit_for_bit


def test_its_numerics_have_a_name_of_their_own(run):
    planar = simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.01}))
    assert run.provenance.kernel != planar.provenance.kernel
    assert run.provenance.is_portable


def test_what_does_not_draw_it_says_so(run):
    for refused in (
        lambda: figure_names(run.scenario),
        lambda: write_gif(run, io.BytesIO()),
    ):
        with pytest.raises(SlipgraspError, match="in space"):
            refused()
