import matplotlib
import pytest

from slipgrasp.figures.drawings import draw_figures
from slipgrasp.figures.files import FORMATS, write_figures
from slipgrasp.recordings.exceptions import RecordingExistsError, RecordingWriteError
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording

pytestmark = pytest.mark.slow

MAGIC = {"svg": b"<?xml", "pdf": b"%PDF-", "png": b"\x89PNG\r\n"}


def test_every_figure_is_one_file_in_each_format(short_run, tmp_path):
    figures = draw_figures(short_run)
    paths = write_figures(figures, tmp_path / "new" / "folder")
    assert [path.name for path in paths] == [f"{n}.{f}" for n in figures for f in FORMATS]
    assert sorted((tmp_path / "new" / "folder").iterdir()) == sorted(paths)
    for path in paths:
        content = path.read_bytes()
        assert content.startswith(MAGIC[path.suffix[1:]])
        assert len(content) > 10_000


def test_equal_runs_give_equal_files_whatever_the_users_settings(short_run, tmp_path):
    write_recording(short_run, tmp_path / "run.mcap")
    names = ("schematic", "forces")
    drawn = draw_figures(short_run)
    once = write_figures({name: drawn[name] for name in names}, tmp_path / "once")
    with matplotlib.rc_context({"font.size": 20.0, "svg.hashsalt": None, "lines.linewidth": 9.0}):
        drawn = draw_figures(read_recording(tmp_path / "run.mcap"))
        twice = write_figures({name: drawn[name] for name in names}, tmp_path / "twice")
    for one, other in zip(once, twice, strict=True):
        assert one.read_bytes() == other.read_bytes(), one.name


def test_own_figures_are_replaced_and_other_files_only_on_request(short_run, tmp_path):
    figures = {"schematic": draw_figures(short_run)["schematic"]}
    paths = write_figures(figures, tmp_path)
    assert write_figures(figures, tmp_path) == paths
    for path in paths:
        content = path.read_bytes()
        path.write_text("somebody's work")
        with pytest.raises(RecordingExistsError):
            write_figures(figures, tmp_path)
        assert path.read_text() == "somebody's work"
        write_figures(figures, tmp_path, overwrite=True)
        assert path.read_bytes() == content


def test_a_folder_that_cannot_be_is_refused(short_run, tmp_path):
    (tmp_path / "file").write_text("")
    figures = draw_figures(short_run)
    with pytest.raises(RecordingWriteError, match="is a file, not a folder"):
        write_figures(figures, tmp_path / "file")
    with pytest.raises(RecordingWriteError, match="Not a directory"):
        write_figures(figures, tmp_path / "file" / "below")
