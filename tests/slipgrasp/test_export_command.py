import csv
import io
import os
import pty
import subprocess

import numpy as np
import pyarrow.parquet
import pytest
from PIL import Image

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import short_columns
from slipgrasp.recordings.export import write_csv
from slipgrasp.recordings.file.writer import write_recording
from tests.slipgrasp.conftest import without_waiting

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run():
    return simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.3}))


@pytest.fixture
def recording(run, tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(run, path)
    return path


def text_of(run):
    text = io.StringIO()
    write_csv(run, text)
    return text.getvalue()


def test_export_prints_the_whole_table(slipgrasp, recording, run):
    done = slipgrasp("export", recording, "--format", "csv")

    assert done.returncode == 0
    assert done.stdout == text_of(run)
    rows = list(csv.reader(io.StringIO(done.stdout)))
    assert rows[0] == [column.name for column in short_columns(run.trace)]
    assert len(rows) == 1 + len(run.trace)


def test_export_adds_the_assumptions_of_the_theorems_to_data_alone(slipgrasp, recording, tmp_path):
    done = slipgrasp("export", recording, "--format", "csv", "--assumptions")
    assert done.returncode == 0
    assert done.stdout.partition("\n")[0].endswith(",premise_radius,premise_decrease")
    film = slipgrasp("export", recording, "--output", tmp_path / "run.gif", "--premises")
    assert film.returncode == 2
    assert "--assumptions adds columns, gif has none; choose csv, parquet or npz" in film.stderr


def test_export_writes_a_file_and_replaces_one_only_with_force(slipgrasp, recording, run, tmp_path):
    table = tmp_path / "run.csv"
    assert slipgrasp("export", recording, "--output", table).returncode == 0
    assert table.read_text() == text_of(run)

    refused = slipgrasp("export", recording, "--output", table)
    assert refused.returncode == 2
    assert "already exists" in refused.stderr

    assert slipgrasp("export", recording, "--output", table, "--force").returncode == 0


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "there is no recording"),
        (b"", "is empty"),
        (b"not a recording at all", "not an MCAP file"),
        (b"\x89MCAP0\r\n and then nothing that fits", "damaged"),
    ],
)
def test_a_file_that_is_no_recording_is_refused_in_one_line(in_process, tmp_path, content, message):
    if content is not None:
        (tmp_path / "wrong.mcap").write_bytes(content)

    done = in_process("export", "wrong.mcap")

    assert done.returncode == 2
    assert done.stdout == ""
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_reader_that_has_seen_enough_is_no_error(slipgrasp, recording):
    reading_end, writing_end = os.pipe()
    os.close(reading_end)
    with os.fdopen(writing_end, "w") as pipe:
        assert exported_to(pipe, slipgrasp, recording) == (0, "")


def test_an_output_that_takes_nothing_is_told_in_one_line(slipgrasp, recording):
    words = "slipgrasp: cannot write the output: No space left on device\n"
    with open("/dev/full", "w") as full:
        assert exported_to(full, slipgrasp, recording) == (4, words)


def exported_to(stream, slipgrasp, *arguments):
    """Status, and what is complained of, of an export to a stream."""
    done = subprocess.run(
        slipgrasp.command("export", *arguments),
        cwd=slipgrasp.folder,
        env=slipgrasp.environment,
        stdout=stream,
        stderr=subprocess.PIPE,
    )
    return done.returncode, without_waiting(done.stderr.decode())


def reads_as(path):
    """The slip of contact 0, as another program reads it."""
    if path.suffix == ".parquet":
        return pyarrow.parquet.read_table(path)["slip_0"].to_numpy()
    with np.load(path, allow_pickle=False) as arrays:
        return arrays["slip_0"]


@pytest.mark.parametrize("ending", ["parquet", "npz"])
def test_the_ending_of_the_output_chooses_the_format(slipgrasp, recording, run, tmp_path, ending):
    table = tmp_path / f"run.{ending}"

    assert slipgrasp("export", recording, "--output", table).returncode == 0

    assert reads_as(table).tobytes() == run.trace.slip[:, 0].tobytes()


def test_binary_tables_can_go_to_a_pipe(slipgrasp, recording, run, tmp_path):
    table = tmp_path / "piped.parquet"
    with table.open("wb") as stream:
        assert exported_to(stream, slipgrasp, recording, "--format", "parquet") == (0, "")
    assert reads_as(table).tobytes() == run.trace.slip[:, 0].tobytes()


def test_binary_tables_are_kept_from_a_terminal(slipgrasp, recording):
    terminal, its_end = pty.openpty()
    words = "slipgrasp: npz is not for a terminal; name a file with --output\n"
    with os.fdopen(its_end, "w") as screen:
        assert exported_to(screen, slipgrasp, recording, "--format", "npz") == (2, words)
    os.close(terminal)


def test_an_output_without_a_known_ending_needs_a_format(in_process, recording, tmp_path):
    refused = in_process("export", recording, "--output", "run.txt")
    assert refused.returncode == 2
    assert "does not end with a format" in refused.stderr
    done = in_process("export", recording, "--output", "run.txt", "--format", "csv")
    assert done.returncode == 0
    assert (tmp_path / "run.txt").read_text().startswith("t,x,y,theta,")


def test_a_film_and_a_page_are_written(slipgrasp, recording, tmp_path):
    film = slipgrasp("export", recording, "--output", "run.gif", "--fps", "10")
    page = slipgrasp("export", recording, "--output", "run.html", "--fps", "10")

    assert (film.returncode, page.returncode) == (0, 0), film.stderr + page.stderr
    assert (tmp_path / "run.gif").read_bytes().startswith(b"GIF89a")
    assert "<html" in (tmp_path / "run.html").read_text(encoding="utf-8")[:2000].lower()


@pytest.mark.parametrize("fps", ["nan", "51"])
def test_frames_per_second_have_bounds(in_process, recording, fps):
    refused = in_process("export", recording, "--output", "run.gif", "--fps", fps)

    assert refused.returncode == 2
    assert "--fps" in refused.stderr and refused.stderr.count("\n") == 1


def test_export_draws_an_instant_in_any_size(slipgrasp, recording, tmp_path):
    still = tmp_path / "still.png"
    done = slipgrasp("export", recording, "--output", still, "--at", "0.05", "--size", "300x500")
    assert done.returncode == 0, done.stderr
    with Image.open(still) as picture:
        assert picture.size == (300, 500)

    wrong = slipgrasp("export", recording, "--output", tmp_path / "x.svg", "--size", "large")
    assert wrong.returncode == 2
    assert "large is not a width and a height, such as 1920x1080" in wrong.stderr
