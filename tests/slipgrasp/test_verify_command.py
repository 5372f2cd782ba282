"""``slipgrasp verify`` in a process of its own, on what other processes have recorded."""

import json
from pathlib import Path

import pytest

from benchmarks.preset_hashes import read_presets
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.writer import write_recording
from tests.recordings.tampering import patch_in_place

PAGE = Path(__file__).parents[2] / "docs" / "portability.md"

pytestmark = pytest.mark.slow

SHORT = {"simulation.duration": 0.3}


@pytest.fixture
def recording(tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(simulate(with_values(load_scenario("paper-case-1"), SHORT)), path)
    return path


def verified(slipgrasp, *arguments, status=0):
    done = slipgrasp("verify", *arguments, "--json")
    assert done.returncode == status, done.stderr
    return json.loads(done.stdout)


def test_what_another_process_recorded_is_the_same_bit_for_bit(slipgrasp):
    run = slipgrasp.run_json("paper-case-2", "--output", "run.mcap")

    found = verified(slipgrasp, "run.mcap")

    assert found["same"] and found["bit_for_bit"] and found["whole"]
    assert found["mismatches"] == []
    assert found["end_time"] == run["end_time"]
    assert found["sha256"] == run["sha256"] == read_presets(PAGE)["paper-case-2"]
    told = slipgrasp("verify", "run.mcap", "--hash").stdout
    assert told.splitlines()[-1] == f"SHA-256 of the recorded run: {run['sha256']}"


def test_a_stored_run_is_verified_by_its_id_in_words(slipgrasp):
    path = slipgrasp.run_json("paper-case-2", "--set", "simulation.duration=0.5")["recording"]

    done = slipgrasp("verify", path.rpartition("/")[2].removesuffix(".mcap"))

    assert done.returncode == 0
    assert done.stdout.startswith("Equal: ")
    assert "bit for bit" in done.stdout and "the whole run" in done.stdout


def test_one_altered_bit_exits_1_and_names_signal_and_time(slipgrasp, recording):
    altered = recording.with_name("altered.mcap")
    patch_in_place(recording, altered, "/slipgrasp/energy")
    found = verified(slipgrasp, altered, status=1)

    (mismatch,) = found["mismatches"]
    assert mismatch["what"] == "dissipated_energy"
    assert not found["same"] and not found["unaltered"]
    told = slipgrasp("verify", altered)
    assert told.returncode == 1
    assert told.stdout.startswith(f"Different: dissipated_energy at {mismatch['time']:.9g} s: ")
    assert "do not match the hash" in told.stdout


def test_what_was_recovered_is_compared_as_far_as_it_goes(slipgrasp, tmp_path):
    whole = tmp_path / "whole.mcap"
    write_recording(simulate(load_scenario("paper-case-1")), whole)
    data = whole.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    assert slipgrasp("recover", "cut.mcap", "--output", "rest.mcap").returncode == 0

    done = slipgrasp("verify", "rest.mcap")

    assert done.returncode == 0, done.stdout
    assert "the recorded part" in done.stdout


@pytest.mark.parametrize(
    ("name", "message"), [("missing.mcap", "there is no recording"), ("cut.mcap", "is damaged")]
)
def test_what_cannot_be_read_exits_2_in_one_line(slipgrasp, recording, name, message):
    recording.with_name("cut.mcap").write_bytes(recording.read_bytes()[:-1000])

    done = slipgrasp("verify", name)

    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr.splitlines()[-1] and "Traceback" not in done.stderr
