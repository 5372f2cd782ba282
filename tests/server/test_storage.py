"""Quota, free space, and one service for each data folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from slipgrasp.recordings.exceptions import FolderInUseError, RecordingWriteError
from slipgrasp.server.service_lock import LOCK_NAME, check_not_served, service_lock
from tests.server.serving import patient_settings, serve

SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}


def test_beyond_the_quota_no_run_is_begun_until_another_is_deleted(tmp_path) -> None:
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        run = client.post("/runs", json=SHORT).json()
    taken = sum(path.stat().st_size for path in tmp_path.iterdir())
    settings = patient_settings(tmp_path, quota_bytes=taken)
    with serve(settings) as running, running.client() as client:
        answer = client.post("/runs", json=SHORT)
        assert answer.status_code == answer.json()["status"] == 507
        assert "the recordings in the data folder use" in answer.json()["detail"]
        assert str(tmp_path) not in answer.text
        assert client.get("/health").json()["running"] == 0
        assert client.delete(f"/runs/{run['id']}").status_code == 204
        assert client.post("/runs", json=SHORT).status_code == 201


def test_a_folder_that_is_served_is_refused_to_a_second_service(tmp_path) -> None:
    with serve(patient_settings(tmp_path)):
        with pytest.raises(FolderInUseError) as refusal:
            check_not_served(tmp_path)
        told = str(refusal.value)
        assert str(tmp_path) in told and f"process {os.getpid()}" in told and "\n" not in told
        assert (tmp_path / LOCK_NAME).read_text() == str(os.getpid())
    check_not_served(tmp_path)


HOLD = """
import sys
from pathlib import Path
from slipgrasp.server.service_lock import service_lock
with service_lock(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def test_the_lock_of_a_killed_service_vanishes_with_it(tmp_path) -> None:
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    root = Path(__file__).parents[2]
    with subprocess.Popen(
        command, cwd=root, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == b"held\n"
        with pytest.raises(FolderInUseError, match=f"process {holder.pid}"):
            check_not_served(tmp_path)
        holder.kill()
        holder.wait()
        with service_lock(tmp_path):
            assert (tmp_path / LOCK_NAME).read_text() == str(os.getpid())


def test_a_lock_that_is_a_link_or_cannot_be_made_is_refused_by_name(tmp_path) -> None:
    outside = tmp_path / "outside"
    outside.write_text("precious")
    (tmp_path / LOCK_NAME).symlink_to(outside)
    with pytest.raises(RecordingWriteError, match=LOCK_NAME):
        check_not_served(tmp_path)
    assert outside.read_text() == "precious"
    with pytest.raises(RecordingWriteError, match="missing"):
        check_not_served(tmp_path / "missing")
