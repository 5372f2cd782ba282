import json
import resource
import signal
from inspect import getsourcefile
from pathlib import Path

import numpy as np
import pytest

from slipgrasp import scenario_to_toml
from slipgrasp.core.scenario.custom_laws import forget
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.pads import PAD_FACTORS
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.store.store import RecordingStore
from tests.soft_box import GRIP, OFFSET, JointSprings, soft_box
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow

CASE = ("paper-case-1", "--set", "simulation.duration=1", "--over", "object.mass")
MARGIN = (*CASE, "--from", "1", "--to", "5")
KEYS = {"key", "held_at", "lost_at", "outcome", "recordings"}


def answer(slipgrasp, *arguments, status=0):
    done = slipgrasp("margin", *arguments, "--json")
    assert done.returncode == status, done.stderr
    return json.loads(done.stdout)


def test_margin_prints_one_object_and_keeps_the_runs_of_both_sides(slipgrasp):
    found = answer(slipgrasp, *MARGIN)
    assert set(found) >= KEYS
    assert found["key"] == "object.mass" and found["unit"] == "kg"
    assert 1.0 < found["held_at"] < found["lost_at"] < 5.0
    assert found["lost_at"] - found["held_at"] <= 0.004
    assert found["outcome"] == "diverged" and "singular" in found["reason"]
    held, lost = map(Path, found["recordings"])
    assert held.parent == lost.parent == slipgrasp.data
    for path, mass, is_held in (
        (held, found["held_at"], True),
        (lost, found["lost_at"], False),
    ):
        result = read_recording(path)
        assert result.scenario.object.mass == mass
        assert result.scenario.simulation.duration == 1.0
        assert result.metrics.held is is_held
    assert read_recording(lost).outcome.value == found["outcome"]
    stored = RecordingStore(slipgrasp.data).list()
    assert {run.path for run in stored} == {held, lost}


def test_recordings_go_to_a_folder_where_they_replace_others_only_on_request(slipgrasp, tmp_path):
    (tmp_path / "lost.mcap").write_text("precious")
    refused = slipgrasp("margin", *MARGIN, "--output", ".")
    assert refused.returncode == 2
    assert "already exists" in refused.stderr
    assert (tmp_path / "lost.mcap").read_text() == "precious"
    assert not (tmp_path / "held.mcap").exists()
    for folder, force in ((tmp_path, ["--force"]), (tmp_path / "there" / "mass", [])):
        found = answer(slipgrasp, *MARGIN, "--output", folder, *force)
        assert found["recordings"] == [str(folder / "held.mcap"), str(folder / "lost.mcap")]
        assert read_recording(folder / "held.mcap").metrics.held
        assert not read_recording(folder / "lost.mcap").metrics.held
    assert slipgrasp.saved() == []


def test_rotation_of_the_held_object_is_reported_as_not_limited(slipgrasp, tmp_path):
    grip = ("--over", "controller.grip_force", "--from", "40", "--to", "15", "--slip", "0.001")
    done = slipgrasp("margin", "parallel-gripper", *grip, "--output", "grip")

    (told,) = (line for line in done.stdout.splitlines() if line.startswith("rotation"))
    turn = np.degrees(
        np.linalg.norm(read_recording(tmp_path / "grip" / "held.mcap").trace.tracking_error[-1, 3:])
    )
    assert turn > 1.0 and f"not limited: where it is held, the object ends {turn:.1f}° " in told


def test_without_json_the_answer_is_told_in_words(slipgrasp):
    done = slipgrasp("margin", *MARGIN)

    assert done.returncode == 0
    lines = done.stdout.splitlines()
    for line, label in zip(
        lines, ("key", "held at", "lost at", "outcome", "recordings"), strict=False
    ):
        assert line.startswith(f"{label}  ")
    assert lines[1].endswith(" kg")
    assert lines[6].startswith("knowledge   Unknown to the controller: ")
    for line, word in zip(lines[4:6], ("held", "lost"), strict=True):
        path, told = line.removeprefix("recordings").split(maxsplit=1)
        assert told.startswith("(held" if word == "held" else "(ended: ")
        assert read_recording(Path(path)).metrics.held is (word == "held")


def test_further_borders_are_warned_of(slipgrasp):
    done = slipgrasp(
        *("margin", "paper-case-2", "--set", "controller.control_period=0.001"),
        *("--over", "fingers.1.friction", "--from", "0.25", "--to", "0.5"),
    )

    assert done.returncode == 0
    others = done.stdout.partition("more boundaries, at ")[2]
    assert "0.375 … 0.390625, 0.390625 … " in others


@pytest.mark.parametrize(
    ("ends", "words"),
    [(("1", "1.5"), "held at both ends, 1 and 1.5"), (("8", "9"), "held at neither end, 8 and 9")],
)
def test_a_range_without_a_border_exits_with_1_and_saves_nothing(slipgrasp, ends, words):
    done = slipgrasp("margin", *CASE, "--from", ends[0], "--to", ends[1], "--json")

    assert done.returncode == 1
    assert f"object.mass is {words}: widen the range" in done.stderr
    found = json.loads(done.stdout)
    assert set(found) >= KEYS
    assert (found["held_at"], found["lost_at"], found["recordings"]) == (None, None, [])
    assert words in found["reason"]
    assert slipgrasp.saved() == []


ENDS = ("--from", "1", "--to", "5")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("paper-case-1", "--over", "object.mas", *ENDS), "did you mean 'object.mass'?"),
        (("paper-case-1", "--over", "controller.kind", *ENDS), "controller.kind is a choice"),
        ((*CASE, "--from", "1", "--to", "1e9"), "allowed: 0.001 … 1000 kg"),
        ((*CASE, "--from", "1", "--to", "inf"), "give two finite numbers"),
        ((*CASE, "--from", "1", "--to", "1"), "give two different values"),
        ((*CASE, "--from", "light", "--to", "1"), "'light' is not a number"),
        ((*CASE, "--from", "1"), "--to"),
        ((*MARGIN, "--output", "/proc/nothing/here"), "cannot create the folder"),
    ],
)
def test_bad_input_exits_with_2_in_one_clear_line_and_saves_nothing(slipgrasp, arguments, message):
    done = slipgrasp("margin", *arguments)
    assert (done.returncode, done.stdout, slipgrasp.saved()) == (2, "", [])
    assert message in done.stderr and done.stderr.count("\n") == 1


def test_a_full_disk_exits_with_4_and_still_tells_the_answer(slipgrasp):
    def no_large_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))

    done = slipgrasp("margin", *MARGIN, "--json", preexec_fn=no_large_files)

    assert done.returncode == 4
    assert "not saved" in done.stderr
    found = json.loads(done.stdout)
    assert 1.0 < found["held_at"] < found["lost_at"] < 5.0
    assert found["recordings"] == [None, None]
    assert slipgrasp.saved() == []


def test_an_interrupted_search_ends_soon_and_saves_nothing(slipgrasp):
    long_runs = ("simulation.duration=600", "controller.control_period=0.0001")
    process = slipgrasp.start(
        *("margin", *MARGIN, "--set", long_runs[0], "--set", long_runs[1]),
    )
    with process:
        while "searching" not in process.stderr.readline():
            assert process.poll() is None
        process.send_signal(signal.SIGINT)
        process.wait(timeout=PATIENCE)
        assert "interrupted; nothing is saved" in process.stderr.read()

    assert process.returncode == 4
    assert slipgrasp.saved() == []


def test_the_least_pad_that_keeps_a_box_from_turning_is_that_of_its_statics(slipgrasp, tmp_path):
    """Each pad carries half of the weight, and the moment that friction leaves: e = 11.257 mm."""
    box = with_values(soft_box(0.012, 1e-3, 0.8), {"controller.kind": "pd-gravity"})
    forget(JointSprings.name)
    (tmp_path / "box.toml").write_text(scenario_to_toml(box))
    law = ("--law", f"{getsourcefile(JointSprings)}:{JointSprings.__name__}")
    period = ("--set", "controller.control_period=0.001", "--slip", "1e-6", "--tolerance", "1e-4")
    pads = ("--over", "fingers.*.pad_radius", "--from", "0.02", "--to", "0.015")
    found = answer(slipgrasp, str(tmp_path / "box.toml"), *law, *period, *pads)

    limit, carried, needed = 0.5 * GRIP, 0.5 * 9.81, 0.5 * 9.81 * OFFSET
    least = needed / np.sqrt(limit**2 - carried**2)
    assert least == pytest.approx(0.01126, abs=5e-6)
    for side in ("held_at", "lost_at"):
        assert PAD_FACTORS["even"] * found[side] == pytest.approx(least, rel=1e-3)
