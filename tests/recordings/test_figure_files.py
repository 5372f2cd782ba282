import matplotlib
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.figures.drawings import draw_figures
from slipgrasp.figures.files import write_figures
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording

pytestmark = pytest.mark.slow


def test_equal_runs_give_equal_files_whatever_the_users_settings(tmp_path):
    # Neither estimates nor premises, which would only be drawn.
    known = {"estimates": [], "simulation.duration": 0.1}
    run = simulate(with_values(load_scenario("composite-case-2"), known))
    write_recording(run, tmp_path / "run.mcap")
    names = ("schematic", "forces")
    drawn = draw_figures(run)
    once = write_figures({name: drawn[name] for name in names}, tmp_path / "once")
    with matplotlib.rc_context({"font.size": 20.0, "svg.hashsalt": None, "lines.linewidth": 9.0}):
        drawn = draw_figures(read_recording(tmp_path / "run.mcap"))
        twice = write_figures({name: drawn[name] for name in names}, tmp_path / "twice")
    for one, other in zip(once, twice, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name
