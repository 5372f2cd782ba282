"""Runs that go by the server's rules."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.study.retention import Retention, TrustedClock
from slipgrasp.recordings.study.study_store import StudyStore
from slipgrasp.server.runs.retention import RetentionService
from tests.server.serving import patient_settings, serve
from tests.waiting import wait_until

SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}


def make_runs(client, number: int) -> list[str]:
    return [client.post("/runs", json=SHORT).json()["id"] for _ in range(number)]


def test_what_goes_is_deleted_when_the_server_starts_and_what_is_marked_stays(tmp_path) -> None:
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        ids = make_runs(client, 3)
        client.patch(f"/runs/{ids[0]}", json={"name": "the first"})
    settings = patient_settings(tmp_path, retention=Retention(max_runs=1))
    with serve(settings) as running, running.client() as client:
        wait_until(lambda: client.get("/runs").json()["count"] == 2)
        assert {run["id"] for run in client.get("/runs").json()["data"]} == {ids[0], ids[2]}


def test_a_clock_far_ahead_deletes_nothing_at_the_start_and_is_told_of(
    tmp_path, caplog, monkeypatch
) -> None:
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        make_runs(client, 3)
    store = RecordingStore(tmp_path)
    ahead = TrustedClock(store, lambda: datetime.now(UTC) + timedelta(days=400))
    retention = Retention(max_age=timedelta(days=30))
    service = RetentionService(
        store, StudyStore(tmp_path, store), retention, lambda _: True, tuple, ahead
    )
    service.start()
    service.close()
    assert store.count() == 3
    assert "397 days further ahead of the newest run than is trusted" in caplog.text
