"""Rerun accepts a recording, and what it makes of one holds our transforms and our state.

Its own program checks and converts the file, without a window, a network or a report of its
use; its own library reads the result.
"""

import json
import os
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.recordings.file.schemas import SAMPLE_TOPICS, signals_of
from slipgrasp.recordings.file.writer import write_recording
from tests.recordings.reading_display import shown_rows
from tests.references.closed_loop import ClosedLoop

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run():
    changes = {"simulation.duration": 0.3}
    return simulate(with_values(load_scenario("paper-case-2"), changes))


@pytest.fixture(scope="module")
def rerun(tmp_path_factory):
    """Runs a command of Rerun's program with a home of its own, where it may report nothing."""
    home = tmp_path_factory.mktemp("home")
    settings = home / "rerun" / "analytics.json"
    settings.parent.mkdir()
    paths = {"config_file_path": str(settings), "data_dir_path": str(home / "reports")}
    off = {"analytics_enabled": False, "analytics_id": "tests", "metadata": {}, **paths}
    settings.write_text(json.dumps(off))
    places = ("HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME")
    environment = {**os.environ, **{place: str(home) for place in places}, "NO_COLOR": "1"}

    def call(*arguments):
        command = [sys.executable, "-m", "rerun_cli", *map(str, arguments)]
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, check=False, timeout=120
        )
        assert done.returncode == 0, done.stderr
        assert not list(home.glob("reports/*"))
        return done.stdout

    return call


@pytest.fixture(scope="module")
def recording(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "run.mcap"
    write_recording(run, path)
    return path


@pytest.fixture(scope="module")
def converted(rerun, recording):
    """What Rerun has of each topic: its columns by name, the tables of a topic joined."""
    from rerun.chunk import RrdReader

    target = recording.with_suffix(".rrd")
    rerun("mcap", "convert", recording, "--output", target)
    columns: dict[str, dict[str, list]] = {}
    for chunk in RrdReader(target).stream():
        if not chunk.is_static:
            batch = chunk.to_record_batch()
            entity = columns.setdefault(chunk.entity_path, {})
            for name in batch.schema.names:
                column = batch.column(name)
                is_time = str(column.type).startswith("timestamp")
                entity.setdefault(name, []).extend(
                    (column.cast("int64") if is_time else column).to_pylist()
                )
    return columns


def test_rerun_finds_no_fault_with_a_recording(rerun, recording):
    report = rerun("mcap", "check", "--full", recording)
    lines = [line.split() for line in report.splitlines() if " /" in line]
    assert len(lines) == 9
    assert all(line[0] == "ok" and line[-1] == "—" for line in lines)


def test_rerun_counts_the_messages_of_every_topic(rerun, recording, run):
    report = rerun("mcap", "info", recording)
    counts = {line.split()[1]: int(line.split()[2]) for line in report.splitlines() if " /" in line}
    samples, shown = len(run.trace), len(shown_rows(run))
    assert counts["/tf"] == counts["/scene"] == shown
    assert {counts[topic.name] for topic in SAMPLE_TOPICS} == {samples}


def test_our_state_arrives_in_rerun_bit_for_bit(converted, run):
    compared = set()
    for topic in SAMPLE_TOPICS:
        table = converted[topic.name]
        messages = [message for (message,) in table[f"{topic.schema_name}:message"]]
        assert table["message_log_time"] == np.rint(run.trace.times * 1e9).tolist()
        assert [message["t"] for message in messages] == run.trace.times.tolist()
        for signal in signals_of(topic):
            values = getattr(run.trace, signal.name)
            # Rerun tells a list without entries as none.
            told = [message[signal.name] for message in messages]
            assert [[] if one is None else one for one in told] == values.tolist()
            compared.add(signal.name)
    assert compared == {s.name for s in SIGNALS[1:] if run.trace.shape.has(s)}


def transforms_of(converted):
    """Times, translations and turns about z of every frame, by (parent, child)."""
    table = converted["/tf"]
    frames: dict[tuple[str, str], list] = {}
    for time, stamp, (child,), (parent,), (place,), (turn,) in zip(
        table["message_log_time"],
        table["timestamp"],
        table["Transform3D:child_frame"],
        table["Transform3D:parent_frame"],
        table["Transform3D:translation"],
        table["Transform3D:quaternion"],
        strict=True,
    ):
        assert time == stamp
        frames.setdefault((parent, child), []).append((time, place, turn))
    return frames


def test_the_poses_of_the_object_arrive_in_rerun_s_transforms(converted, run):
    frames, shown = transforms_of(converted), shown_rows(run)
    for child, poses in (("object", shown.object_pose), ("desired", shown.desired_pose)):
        times, places, turns = zip(*frames["plane", child], strict=True)
        assert list(times) == np.rint(shown.times * 1e9).tolist()
        np.testing.assert_array_equal(np.array(places)[:, :2], poses[:, :2].astype(np.float32))
        x, y, z, w = np.array(turns).T
        assert not x.any() and not y.any()
        np.testing.assert_allclose(2.0 * np.arctan2(z, w), poses[:, 2], atol=1e-6)


def test_the_chain_of_every_finger_leads_to_its_tip_in_rerun(converted, run):
    frames, shown = transforms_of(converted), shown_rows(run)
    hand = ClosedLoop.from_scenario(run.scenario).hand
    tips = np.array(
        [hand.tip_positions(*state) for state in zip(shown.object_pose, shown.slip, strict=True)]
    )
    for i in range(len(run.scenario.fingers)):
        parts = ["plane", *(f"finger_{i}/{part}" for part in ("base", "link_0", "link_1", "tip"))]
        place, angle = np.zeros((len(shown), 2)), np.zeros(len(shown))
        for parent, child in pairwise(parts):
            _, steps, turns = (np.array(each) for each in zip(*frames[parent, child], strict=True))
            c, s = np.cos(angle), np.sin(angle)
            x, y = steps[:, 0], steps[:, 1]
            place += np.stack([c * x - s * y, s * x + c * y], axis=1)
            angle += 2.0 * np.arctan2(turns[:, 2], turns[:, 3])
        np.testing.assert_allclose(place, tips[:, i], atol=2e-6)


def test_the_scene_arrives_in_rerun_with_all_its_entities(converted, run):
    messages = [message for (message,) in converted["/scene"]["foxglove.SceneUpdate:message"]]
    assert len(messages) == len(shown_rows(run))
    ids = {entity["id"] for message in messages for entity in message["entities"]}
    links = {f"finger_{i}/{part}" for i in (0, 1) for part in ("mount", "link_0", "link_1")}
    assert ids == {"object", "desired", "contact_0", "contact_1", *links}


def test_rerun_finds_no_fault_with_a_hand_in_space_and_draws_its_frames(rerun, tmp_path):
    from rerun.chunk import RrdReader

    result = simulate(with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.2}))
    path, target = tmp_path / "run.mcap", tmp_path / "run.rrd"
    write_recording(result, path)
    report = rerun("mcap", "check", "--full", path)
    lines = [line.split() for line in report.splitlines() if " /" in line]
    assert len(lines) == 10 and all(line[0] == "ok" and line[-1] == "—" for line in lines)
    rerun("mcap", "convert", path, "--output", target)
    places = []
    for chunk in RrdReader(target).stream():
        if chunk.entity_path == "/tf" and not chunk.is_static:
            table = chunk.to_record_batch().to_pydict()
            for child, place in zip(
                table["Transform3D:child_frame"], table["Transform3D:translation"], strict=True
            ):
                places += [place[0]] if child == ["object"] else []
    expected = shown_rows(result).object_pose[:, :3].astype(np.float32)
    np.testing.assert_array_equal(places, expected)
