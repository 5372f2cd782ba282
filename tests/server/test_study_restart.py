"""Studies whose service, or one of whose workers, is killed in the middle."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx2
import pytest

from slipgrasp.recordings.exceptions import RecordingWriteError
from slipgrasp.recordings.study.reader import open_study
from slipgrasp.recordings.study.writer import StudyWriter
from slipgrasp.server.studies.schemas import read_study
from tests.recordings.studying import write_study
from tests.server.serving import patient_settings, serve
from tests.server.studying import LONG, QUICK, create, finished, until
from tests.slipgrasp.forked import Forked
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow

BODY = {
    **QUICK,
    "set": {"simulation.duration": 1.0},
    "sampling": {"method": "random", "runs": 100, "seed": 5},
}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> bytes:
    """The file of the study as it is if nothing happens, computed here."""
    path = tmp_path_factory.mktemp("undisturbed") / "study.mcap"
    write_study(read_study(BODY, 1000), path)
    return path.read_bytes()


@contextmanager
def service(folder: Path) -> Iterator[tuple[Forked, httpx2.Client]]:
    """A service of its own process, and a client of it."""
    arguments = ["serve", "--port", "0", "--data-dir", str(folder)]
    with Forked(arguments, folder, os.environ) as process:
        try:
            url = process.stdout.readline().strip()
            assert url, process.stderr.read()
            address = f"{url}api/v1"
            with httpx2.Client(base_url=address, timeout=PATIENCE, trust_env=False) as client:
                yield process, client
        finally:
            process.terminate()
            said = process.stderr.read()
    assert "Traceback" not in said


def head_of(file: Path) -> tuple[object, ...]:
    """What the file of a study says before its rows."""
    with open_study(file) as reader:
        return reader.library, reader.start, reader.definition.decode()


def workers_of(process: Forked) -> list[int]:
    threads = Path(f"/proc/{process.pid}/task").iterdir()
    found = [int(pid) for thread in threads for pid in (thread / "children").read_text().split()]
    return [
        pid
        for pid in found
        if b"slipgrasp.core.executors" in Path(f"/proc/{pid}/cmdline").read_bytes()
    ]


def test_no_run_is_lost_or_done_twice_whoever_is_killed(tmp_path, undisturbed):
    with service(tmp_path) as (process, client):
        study = create(client, BODY, key="this one")
        before = until(client, study, lambda now: now["finished"] >= 40)
        os.kill(workers_of(process)[0], signal.SIGKILL)
        until(client, study, lambda now: now["finished"] > before["finished"] + 20)
        process.send_signal(signal.SIGKILL)

    with service(tmp_path) as (_, client):
        again = create(client, BODY, key="this one")
        assert again["id"] == study["id"] and again["finished"] > 0
        ended = finished(client, study)
        count = client.get("/studies").json()["count"]
        answer = client.get(f"/studies/{study['id']}/recording")

    assert ended["state"] == "completed" and ended["finished"] == 200 and count == 1
    file, expected = tmp_path / "answer.mcap", tmp_path / "expected.mcap"
    file.write_bytes(answer.content)
    expected.write_bytes(undisturbed)
    assert head_of(file) == head_of(expected)  # It tells more than bytes do.
    assert answer.content == undisturbed
    with open_study(file) as reader:
        assert [row.index for row in reader.rows()] == list(range(200))


def test_a_study_that_has_failed_goes_on_when_it_is_resumed(tmp_path, undisturbed, monkeypatch):
    def fail(self: StudyWriter, rows: object) -> None:
        raise RecordingWriteError(Path("study.mcap"), "No space left on device")

    settings = patient_settings(tmp_path, study_executor="inline")
    with serve(settings) as running, running.client() as client:
        study = create(client, BODY)
        path = f"/studies/{study['id']}"
        assert client.post(f"{path}/resume").json()["state"] in ("queued", "running")
        until(client, study, lambda now: now["finished"] >= 40)
        with monkeypatch.context() as disk:
            disk.setattr(StudyWriter, "add", fail)
            failed = until(client, study, lambda now: now["state"] == "failed")
        assert 0 < failed["finished"] < failed["num_runs"]
        assert "continues from here when it is resumed" in failed["message"]

        answer = client.post(f"{path}/resume")
        assert answer.status_code == 202 and answer.json()["state"] in ("queued", "running")
        assert answer.json()["finished"] >= failed["finished"] and answer.json()["message"] == ""
        ended = finished(client, study)
        rows = client.get(f"{path}/results", params={"limit": 1000}).json()["data"]
        refused = client.post(f"{path}/resume")
    assert (ended["state"], ended["finished"]) == ("completed", ended["num_runs"])
    assert [row["index"] for row in rows] == list(range(ended["num_runs"]))
    assert (tmp_path / "studies" / f"{study['id']}.mcap").read_bytes() == undisturbed
    assert refused.status_code == 409
    assert "is completed and cannot be resumed" in refused.json()["detail"]


def test_a_service_that_is_told_to_end_leaves_its_study_to_the_next(tmp_path, undisturbed):
    settings = patient_settings(tmp_path, study_executor="inline")
    with serve(settings) as running, running.client() as client:
        study = create(client, BODY)
        waiting = create(client, QUICK)
        until(client, study, lambda now: now["finished"] > 0)
    assert not (tmp_path / "studies" / f"{study['id']}.mcap").exists()

    with serve(settings) as running, running.client() as client:
        assert finished(client, study)["state"] == "completed"
        assert client.get(f"/studies/{study['id']}/recording").content == undisturbed
        assert finished(client, waiting)["state"] == "completed"


def test_a_study_that_cannot_be_read_any_more_has_failed_and_harms_no_other(tmp_path):
    settings = patient_settings(tmp_path, study_executor="inline")
    with serve(settings) as running, running.client() as client:
        damaged, waiting = create(client, LONG), create(client, QUICK)
    part = tmp_path / "studies" / f"{damaged['id']}.mcap.part"
    part.write_bytes(b"nothing of use")

    with serve(settings) as running, running.client() as client:
        assert finished(client, waiting)["state"] == "completed"
        told = client.get(f"/studies/{damaged['id']}").json()
        rows = client.get(f"/studies/{damaged['id']}/results")
        deleted = client.delete(f"/studies/{damaged['id']}")

    assert told["state"] == "failed" and "it cannot continue" in told["message"]
    assert rows.status_code == 422 and part.name in rows.json()["detail"]
    assert deleted.status_code == 204 and not part.exists()
