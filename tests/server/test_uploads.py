"""POST /recordings: everything that may be sent, against a real server."""

from __future__ import annotations

import io
import socket
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx2
import pytest
from mcap.writer import Writer

from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store import store as store_module
from slipgrasp.server.http import body_limit
from slipgrasp.server.routes.recordings import MAX_UPLOADS
from tests.server.raw_http import exchange
from tests.server.serving import RunningServer, patient_settings, serve
from tests.waiting import PATIENCE, wait_until

PROBLEM = "application/problem+json"
BINARY = {"Content-Type": "application/octet-stream"}


@pytest.fixture(scope="module")
def content(sample_run: dict[str, Any]) -> bytes:
    return Path(sample_run["recording"]).read_bytes()


@pytest.fixture
def folder(server: RunningServer) -> Path:
    return server.data_directory


def files_of(folder: Path) -> set[str]:
    """All files but the catalogue's own, which every listing may touch."""
    return {path.name for path in folder.iterdir() if not path.name.startswith("catalogue")}


@pytest.mark.parametrize("kind", ["application/octet-stream", "application/x-mcap", None])
def test_a_recording_that_is_sent_is_kept_as_it_is(client, content, sample_run, kind) -> None:
    headers = {} if kind is None else {"Content-Type": kind}
    answer = client.post("/recordings", content=content, headers=headers)
    run = answer.json()
    assert answer.status_code == 201, answer.text
    assert answer.headers["location"] == run["links"]["self"] == f"/api/v1/runs/{run['id']}"
    assert run["id"] != sample_run["id"] and run["metrics"] == sample_run["metrics"]
    assert Path(run["recording"]).read_bytes() == content
    got = client.get(f"/runs/{run['id']}")
    assert got.json() == run and got.headers["etag"] == answer.headers["etag"]
    assert client.get("/runs").json()["data"][0] == run


def test_a_recording_is_named_when_it_is_sent(client, content) -> None:
    name = {"name": "from the lab ✓"}
    answer = client.post("/recordings", content=content, params=name, headers=BINARY)
    assert answer.status_code == 201 and answer.json()["name"] == "from the lab ✓"


def test_a_recording_is_sent_in_chunks_without_its_length(client, content) -> None:
    def pieces():
        for start in range(0, len(content), 10_000):
            yield content[start : start + 10_000]

    answer = client.post("/recordings", content=pieces(), headers=BINARY)
    assert answer.status_code == 201
    assert Path(answer.json()["recording"]).read_bytes() == content


def foreign_mcap() -> bytes:
    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start(profile="ros2", library="other")
    writer.finish()
    return stream.getvalue()


def flipped(content: bytes) -> bytes:
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda content: b"", "empty"),
        (lambda content: b"x", "not a slipgrasp recording"),
        (lambda content: content[: len(content) // 2], "its end is missing"),
        (flipped, "damaged"),
        (lambda content: content + b"x", "damaged"),
        (lambda content: foreign_mcap(), "another program"),
        (lambda content: b"0" * 3_000_000, "not an MCAP file"),
    ],
)
def test_what_is_no_whole_recording_is_refused_and_leaves_nothing(
    client, folder, content, spoil, said
) -> None:
    before = files_of(folder)
    answer = client.post("/recordings", content=spoil(content), headers=BINARY)
    assert answer.status_code == 422 and answer.headers["content-type"] == PROBLEM
    assert said in answer.json()["detail"] and str(folder) not in answer.text
    assert files_of(folder) == before


@pytest.mark.parametrize(
    "kind", ["application/json", "multipart/form-data", "text/plain", "x" * 500]
)
def test_what_is_declared_as_no_file_is_refused(client, folder, content, kind) -> None:
    before = files_of(folder)
    answer = client.post("/recordings", content=content, headers={"Content-Type": kind})
    assert answer.status_code == 415
    assert "application/octet-stream" in answer.json()["detail"]
    assert files_of(folder) == before


def test_a_name_beyond_its_bounds_is_refused(client, folder, content) -> None:
    before = files_of(folder)
    for name in ("x" * 201, "a\nb"):
        answer = client.post("/recordings", content=content, params={"name": name}, headers=BINARY)
        assert answer.status_code == 422
        assert [error["field"] for error in answer.json()["errors"]] == ["name"]
    assert files_of(folder) == before


@pytest.fixture(scope="module")
def narrow(tmp_path_factory: pytest.TempPathFactory):
    """A server that takes recordings of at most 100 kB."""
    folder = tmp_path_factory.mktemp("narrow")
    with serve(patient_settings(folder, max_upload_bytes=100_000)) as running:
        yield running


def upload_head(port: int, *lines: str) -> bytes:
    given = ("POST /api/v1/recordings HTTP/1.1", f"Host: localhost:{port}", *lines)
    return "\r\n".join([*given, "", ""]).encode()


def test_a_recording_that_declares_to_be_too_large_is_not_read(narrow) -> None:
    answer = exchange(narrow.port, upload_head(narrow.port, "Content-Length: 100001"))
    assert answer.status == 413
    assert files_of(narrow.data_directory) == {"service.lock"}


def test_a_recording_in_chunks_is_cut_off_at_the_limit(narrow) -> None:
    chunk = b"4000\r\n" + b"x" * 0x4000 + b"\r\n"
    head = upload_head(narrow.port, "Transfer-Encoding: chunked")
    answer = exchange(narrow.port, head, *[chunk] * 10, b"0\r\n\r\n")
    assert answer.status == 413 and b"100000 bytes" in answer.body
    assert files_of(narrow.data_directory) == {"service.lock"}


@pytest.mark.parametrize(("limits", "status"), [({"quota_bytes": 1000}, 507), ({}, 413)])
def test_who_sends_all_before_reading_is_told_that_there_is_no_room(
    tmp_path, limits, status
) -> None:
    sent, most = bytes(30_000_000), 40_000_000 if limits else 100_000
    with (
        serve(patient_settings(tmp_path, max_upload_bytes=most, **limits)) as running,
        socket.create_connection(("127.0.0.1", running.port), timeout=PATIENCE) as connection,
    ):
        connection.sendall(upload_head(running.port, f"Content-Length: {len(sent)}"))
        connection.sendall(sent)
        assert connection.recv(65536).startswith(f"HTTP/1.1 {status} ".encode())


def test_a_client_that_goes_away_leaves_nothing(server, client, folder, content) -> None:
    before = files_of(folder)
    for sent in (0, 1, len(content) // 2):
        with socket.create_connection(("127.0.0.1", server.port)) as connection:
            head = upload_head(server.port, f"Content-Length: {len(content)}")
            connection.sendall(head + content[:sent])
            wait_until(lambda: files_of(folder) != before)
        wait_until(lambda: files_of(folder) == before)
    assert client.get("/health").status_code == 200


def test_a_client_that_hardly_sends_is_cut_off(server, folder, content, monkeypatch) -> None:
    monkeypatch.setattr(body_limit, "GRACE_SECONDS", 0.3)
    before = files_of(folder)
    head = upload_head(server.port, f"Content-Length: {len(content)}")
    answer = exchange(server.port, head, content[:100])
    assert answer.status == 408 and b"too slowly" in answer.body
    assert answer.headers["connection"] == "close"
    wait_until(lambda: files_of(folder) == before)


def test_a_recording_that_takes_too_long_to_read_is_refused(
    client, folder, content, monkeypatch
) -> None:
    monkeypatch.setattr(store_module, "READ_SECONDS", -1.0)
    before = files_of(folder)
    answer = client.post("/recordings", content=content, headers=BINARY)
    assert answer.status_code == 422 and "reading the upload takes more than" in answer.text
    assert files_of(folder) == before


def test_only_a_few_recordings_are_received_at_once(server, folder, content) -> None:
    before = files_of(folder)
    waiting = []
    for _ in range(MAX_UPLOADS):
        connection = socket.create_connection(("127.0.0.1", server.port))
        connection.sendall(upload_head(server.port, f"Content-Length: {len(content)}"))
        waiting.append(connection)
    wait_until(lambda: len(files_of(folder) - before) == MAX_UPLOADS)
    with server.client() as client:
        answer = client.post("/recordings", content=content, headers=BINARY)
        assert answer.status_code == 503 and answer.headers["retry-after"] == "5"
        for connection in waiting:
            connection.close()
        wait_until(lambda: files_of(folder) == before)
        assert client.post("/recordings", content=content, headers=BINARY).status_code == 201


def test_recordings_can_be_sent_at_the_same_time(server, content) -> None:
    statuses: list[int] = []

    def send() -> None:
        with server.client() as client:
            answer = client.post("/recordings", content=content, headers=BINARY)
            statuses.append(answer.status_code)

    senders = [threading.Thread(target=send) for _ in range(3)]
    for sender in senders:
        sender.start()
    for sender in senders:
        sender.join()
    assert statuses == [201] * 3


def test_what_a_killed_service_left_of_an_upload_is_deleted_at_start(tmp_path, content) -> None:
    left = tmp_path / "abcdefghijkl.mcap.upload.part"
    left.write_bytes(content[:1000])
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        assert not left.exists() and client.get("/runs").json()["count"] == 0


@pytest.mark.parametrize("with_length", [True, False])
def test_no_recording_is_received_beyond_the_quota(tmp_path, content, with_length) -> None:
    settings = patient_settings(tmp_path, quota_bytes=len(content) - 1)
    sent = content if with_length else iter([content])
    with serve(settings) as running, running.client() as client:
        answer: httpx2.Response = client.post("/recordings", content=sent, headers=BINARY)
        assert answer.status_code == answer.json()["status"] == 507
        assert "delete some, or raise the quota" in answer.json()["detail"]
        assert files_of(tmp_path) == {"service.lock"}


@pytest.mark.parametrize("what", ["held", "phase_change_count"])
def test_a_recording_that_contradicts_its_samples_is_refused(
    client, folder, sample_run, tmp_path, what
) -> None:
    run = read_recording(sample_run["recording"])
    lie = {"held": not run.metrics.held, "phase_change_count": 125}[what]
    write_recording(
        replace(run, metrics=replace(run.metrics, **{what: lie})), tmp_path / "run.mcap"
    )
    before = files_of(folder)

    answer = client.post("/recordings", content=(tmp_path / "run.mcap").read_bytes())

    assert answer.status_code == 422 and answer.headers["content-type"] == PROBLEM
    detail = answer.json()["detail"]
    computed = str(getattr(run.metrics, what))[:10]
    assert f"{what} is stated as {lie}, its samples give {computed}" in detail
    assert files_of(folder) == before
