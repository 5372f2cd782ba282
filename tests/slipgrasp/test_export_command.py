import csv
import io
import os
import subprocess

import pytest

from core.loading import load_scenario, with_values
from core.simulator import simulate
from recordings import csv_columns, write_csv, write_recording


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
    assert rows[0] == csv_columns(run)
    assert len(rows) == 1 + len(run.trace)


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
def test_a_file_that_is_no_recording_is_refused_in_one_line(slipgrasp, tmp_path, content, message):
    if content is not None:
        (tmp_path / "wrong.mcap").write_bytes(content)

    done = slipgrasp("export", "wrong.mcap")

    assert done.returncode == 2
    assert done.stdout == ""
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_reader_that_has_seen_enough_is_no_error(slipgrasp, recording):
    reading_end, writing_end = os.pipe()
    os.close(reading_end)
    with os.fdopen(writing_end, "w") as pipe:
        done = subprocess.run(
            slipgrasp.command("export", recording),
            cwd=slipgrasp.folder,
            env=slipgrasp.environment,
            stdout=pipe,
            stderr=subprocess.PIPE,
            text=True,
        )

    assert (done.returncode, done.stderr) == (0, "")


def test_an_output_that_takes_nothing_is_told_in_one_line(slipgrasp, recording):
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            slipgrasp.command("export", recording),
            cwd=slipgrasp.folder,
            env=slipgrasp.environment,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )

    assert done.returncode == 4
    assert done.stderr == "slipgrasp: cannot write the output: No space left on device\n"
