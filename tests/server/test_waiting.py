"""Runs that take longer than an answer may: 202, waiting, stopping, and requests sent twice."""

from __future__ import annotations

import json
import logging
import socket
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx2
import pytest

from slipgrasp.server.request_keys import KEYS_NAME, KeyedRequest, RequestKeys
from tests.server.running import AT_ONCE, end_of, ended, run_to_end, stop_to_end
from tests.server.serving import LONG, RunningServer, patient_settings, serve
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.05}}


@pytest.fixture(scope="module")
def one_by_one(tmp_path_factory) -> Iterator[RunningServer]:
    """Runs one run at a time, and waits hardly at all for it unless it is asked to."""
    settings = patient_settings(
        tmp_path_factory.mktemp("waiting"), max_running=1, answer_within=0.2
    )
    with serve(settings) as running:
        yield running


@pytest.fixture
def client(one_by_one) -> Iterator[httpx2.Client]:
    with one_by_one.client() as client:
        yield client


@pytest.fixture
def long_run(client) -> Iterator[dict[str, Any]]:
    """A run that goes on for as long as the test."""
    answer = client.post("/runs", json=LONG)
    assert answer.status_code == 202
    run: dict[str, Any] = answer.json()
    yield run
    assert stop_to_end(client, run["id"])["id"] == run["id"]


def test_a_run_that_takes_long_is_answered_before_it_has_ended(client) -> None:
    answer = client.post("/runs", json=LONG)
    run = answer.json()
    assert answer.status_code == 202
    assert run.keys() == {"id", "state", "progress", "links", "compiling"}
    assert run["state"] in ("waiting", "running") and 0.0 <= run["progress"] < 1.0
    assert answer.headers["location"] == run["links"]["self"] == f"/api/v1/runs/{run['id']}"
    assert answer.headers["retry-after"] == "1" and "preference-applied" not in answer.headers

    again = client.get(f"/runs/{run['id']}")
    assert again.status_code == 202 and again.headers["retry-after"] == "1"
    stopped = stop_to_end(client, run["id"])
    assert stopped["outcome"] == "stopped"
    assert client.get(f"/runs/{run['id']}").json() == stopped
    assert client.get("/runs", params={"limit": 1}).json()["data"][0]["id"] == run["id"]


def test_the_progress_of_a_run_can_be_followed(client, long_run) -> None:
    wait_for_state(client, long_run["id"], "running")
    seen = []
    while len(seen) < 3:
        progress = client.get(f"/runs/{long_run['id']}").json()["progress"]
        if not seen or progress > seen[-1]:
            seen.append(progress)
    assert seen == sorted(set(seen)) and seen[-1] < 1.0


def wait_for_state(client: httpx2.Client, run_id: str, state: str) -> None:
    wait_until(lambda: client.get(f"/runs/{run_id}").json()["state"] == state)


def test_a_run_that_has_not_ended_can_neither_be_changed_nor_downloaded(client, long_run) -> None:
    path = f"/runs/{long_run['id']}"
    for answer in (
        client.delete(path),
        client.patch(path, json={"name": "early"}),
        *(client.get(f"{path}/{part}") for part in ("recording", "signals", "signals.csv")),
    ):
        assert answer.status_code == 409
        assert answer.headers["content-type"] == "application/problem+json"
        assert f"POST /api/v1{path}/stop" in answer.json()["detail"]


def test_a_run_that_waits_for_its_turn_can_be_stopped_at_once(client, long_run) -> None:
    waiting = client.post("/runs", json=LONG, headers=AT_ONCE).json()
    assert waiting["state"] == "waiting"
    wrong = {"scenario": "paper-case-1", "set": {"fingers.0.link_lengths.1": 0.2}}
    assert client.post("/runs", json=wrong).status_code == 422
    stopped = stop_to_end(client, waiting["id"])
    assert stopped["outcome"] == "stopped" and stopped["end_time"] < 600.0
    assert client.get(f"/runs/{long_run['id']}").status_code == 202


def test_stopping_twice_and_stopping_what_has_ended_change_nothing(client) -> None:
    run = run_to_end(client, SHORT)
    for _ in range(2):
        answer = client.post(f"/runs/{run['id']}/stop")
        assert (answer.status_code, answer.json()) == (200, run)
    assert client.post("/runs/abcdefghijkl/stop").status_code == 404


@pytest.mark.parametrize(
    ("prefer", "applied"),
    [
        ('wait="20"', "wait=20"),
        ("wait=100000", "wait=60"),
        ("respond-async, wait=20", "respond-async, wait=20"),
        ("handling=lenient; x=1, Wait = 20", "wait=20"),
        ("wait=-1", None),
        ("return=minimal", None),
    ],
)
def test_a_client_says_how_long_it_waits(server, prefer, applied) -> None:
    with server.client() as client:
        answer = client.post("/runs", json=SHORT, headers={"Prefer": prefer})
        assert answer.headers.get("preference-applied") == applied
        assert ended(client, answer)["outcome"] == "completed"


def test_an_answer_comes_no_earlier_than_its_client_waits_where_the_run_goes_on(client) -> None:
    began = time.monotonic()
    answer = client.post("/runs", json=LONG, headers={"Prefer": "wait=1"})
    assert answer.status_code == 202 and time.monotonic() - began >= 1.0
    stop_to_end(client, answer.json()["id"])


def test_a_client_that_does_not_wait_is_answered_at_once_and_can_wait_later(
    client, long_run
) -> None:
    answer = client.post("/runs", json=SHORT, headers=AT_ONCE)
    assert answer.status_code == 202 and answer.headers["preference-applied"] == "respond-async"
    assert client.post(f"/runs/{long_run['id']}/stop", headers=AT_ONCE).status_code in (200, 202)
    run = end_of(client, answer, prefer="wait=20")
    assert run.status_code == 200 and run.headers["preference-applied"] == "wait=20"
    assert run.json()["outcome"] == "completed"


def test_a_run_goes_on_when_its_client_has_gone(client, one_by_one, long_run) -> None:
    body = json.dumps({**SHORT, "set": {"title": "left"}}).encode()
    headers = ("Content-Type: application/json", "Prefer: wait=60", f"Content-Length: {len(body)}")
    with socket.create_connection(("127.0.0.1", one_by_one.port)) as connection:
        head = ["POST /api/v1/runs HTTP/1.1", f"Host: localhost:{one_by_one.port}", *headers]
        connection.sendall("\r\n".join([*head, "", ""]).encode() + body)
        wait_until(lambda: client.get("/health").json()["waiting"] == 1)
    stop_to_end(client, long_run["id"])
    wait_until(lambda: client.get("/runs", params={"text": "left"}).json()["count"] == 1)


@pytest.mark.parametrize(("wait", "status"), [("wait=60", 201), ("respond-async", 202)])
def test_a_server_that_is_stopped_keeps_what_was_simulated_and_logs_no_error(
    tmp_path, caplog, wait, status
) -> None:
    statuses: list[int] = []

    def post() -> None:
        with running.client() as poster:
            statuses.append(poster.post("/runs", json=LONG, headers={"Prefer": wait}).status_code)

    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        poster = threading.Thread(target=post)
        poster.start()
        wait_until(lambda: client.get("/health").json()["running"] == 1)
    poster.join()
    assert statuses == [status]
    assert [r for r in caplog.records if r.levelno >= logging.WARNING] == []
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        (run,) = client.get("/runs").json()["data"]
    assert run["outcome"] == "stopped"


def test_a_run_that_cannot_be_written_is_told_of_to_who_asks_later(tmp_path) -> None:
    folder, moved, once = tmp_path / "data", tmp_path / "moved", keyed("once", **AT_ONCE)
    settings = patient_settings(folder, max_running=1)
    with serve(settings) as running, running.client() as client:
        first = client.post("/runs", json=LONG, headers=AT_ONCE)
        waiting = client.post("/runs", json=SHORT, headers=once)
        folder.rename(moved)
        folder.write_text("not a folder")
        client.post(f"/runs/{first.json()['id']}/stop", headers=AT_ONCE)
        told = [end_of(client, waiting) for _ in range(2)]
        folder.unlink()
        moved.rename(folder)
        again = run_to_end(client, SHORT, **once)
    assert (first.status_code, waiting.status_code) == (202, 202)
    assert [answer.status_code for answer in told] == [507, 507]
    assert "free space on the disk" in told[1].json()["detail"] and told[0].text == told[1].text
    assert again["outcome"] == "completed"


def test_a_run_that_is_stopped_many_times_at_once_ends_once(one_by_one, client, long_run) -> None:
    waiting = [client.post("/runs", json=LONG, headers=AT_ONCE).json()["id"] for _ in range(6)]

    def stop(run_id: str) -> tuple[str, str]:
        with one_by_one.client() as own:
            return run_id, stop_to_end(own, run_id)["outcome"]

    with ThreadPoolExecutor(12) as pool:
        ended = list(pool.map(stop, waiting * 3))
    assert {outcome for _, outcome in ended} == {"stopped"} and len(ended) == 18
    assert client.get(f"/runs/{long_run['id']}").status_code == 202
    listed = [run["id"] for run in client.get("/runs", params={"limit": 6}).json()["data"]]
    assert sorted(listed) == sorted(waiting)


def keyed(key: str, **more: str) -> dict[str, str]:
    return {"Idempotency-Key": key, **more}


def test_the_same_request_with_the_same_key_makes_one_run(client) -> None:
    before = client.get("/runs").json()["count"]
    first = run_to_end(client, SHORT, **keyed("a key"))
    reordered = {"set": SHORT["set"], "scenario": SHORT["scenario"]}
    second = client.post("/runs", json=reordered, headers=keyed("a key"))
    assert second.status_code == 201 and second.json() == first
    assert second.headers["location"] == first["links"]["self"]
    assert client.get("/runs").json()["count"] == before + 1


def test_two_requests_with_one_key_at_once_make_one_run(client, one_by_one) -> None:
    before = client.get("/runs").json()["count"]

    def post(_: int) -> str:
        with one_by_one.client() as own:
            return str(run_to_end(own, SHORT, **keyed("at once"))["id"])

    with ThreadPoolExecutor(8) as pool:
        assert len(set(pool.map(post, range(8)))) == 1
    assert client.get("/runs").json()["count"] == before + 1


def test_another_request_with_the_same_key_is_refused(client) -> None:
    first = run_to_end(client, SHORT, **keyed("taken"))
    other = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.06}}
    answer = client.post("/runs", json=other, headers=keyed("taken"))
    assert answer.status_code == 422
    assert f"run '{first['id']}'" in answer.json()["detail"]


@pytest.mark.parametrize("key", ["x" * 201, "\u00e9", "\x7f"])
def test_a_key_that_is_too_long_or_cannot_be_printed_is_refused(client, key) -> None:
    answer = client.post("/runs", json=SHORT, headers=[(b"Idempotency-Key", key.encode("latin-1"))])
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == "idempotency-key"


def test_a_key_outlives_the_service_and_the_run_that_is_deleted_is_made_again(tmp_path) -> None:
    settings = patient_settings(tmp_path)
    with serve(settings) as running, running.client() as client:
        first = client.post("/runs", json=SHORT, headers=keyed("later")).json()
    with (tmp_path / KEYS_NAME).open("a") as stream:
        stream.write('\n["cut o')
    with serve(settings) as running, running.client() as client:
        assert client.post("/runs", json=SHORT, headers=keyed("later")).json() == first
        assert client.delete(f"/runs/{first['id']}").status_code == 204
        second = client.post("/runs", json=SHORT, headers=keyed("later")).json()
        third = client.post("/runs", json=SHORT, headers=keyed("later")).json()
    assert second["id"] != first["id"] and third == second
    with serve(settings) as running, running.client() as client:
        assert client.post("/runs", json=SHORT, headers=keyed("later")).json() == second


def test_only_the_keys_used_last_are_remembered_and_their_file_stays_small(
    tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr("slipgrasp.server.request_keys.MAX_FILE_BYTES", 1000)
    path = tmp_path / KEYS_NAME
    keys = RequestKeys(path, max_keys=3)
    for i in range(40):
        keys.remember(KeyedRequest(f"key {i}", "digest"), f"run {i}")
    assert path.stat().st_size < 1200
    for known in (keys, RequestKeys(path, max_keys=3)):
        assert known.find("key 36") is None
        assert [known.find(f"key {i}") for i in (37, 39)] == [
            ("digest", f"run {i}") for i in (37, 39)
        ]


def test_a_link_in_place_of_the_keys_is_not_followed(tmp_path) -> None:
    elsewhere, path = tmp_path / "elsewhere", tmp_path / KEYS_NAME
    elsewhere.write_text("theirs")
    path.symlink_to(elsewhere)
    keys = RequestKeys(path)
    keys.remember(KeyedRequest("key", "digest"), "run")
    assert elsewhere.read_text() == "theirs"
    assert keys.find("key") == ("digest", "run")


def test_keys_that_cannot_be_written_hold_until_the_end(tmp_path) -> None:
    keys = RequestKeys(tmp_path / "missing" / KEYS_NAME)
    keys.remember(KeyedRequest("key", "digest"), "run")
    assert keys.find("key") == ("digest", "run")
