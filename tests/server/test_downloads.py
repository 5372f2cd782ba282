"""Downloads: the same conditions and ranges for every file."""

from __future__ import annotations

import logging
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest

from slipgrasp.recordings.exceptions import RecordingWriteError
from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.http import file_cache
from slipgrasp.server.http.file_cache import FileCache
from slipgrasp.server.runs import recovery
from tests.server.raw_http import exchange
from tests.server.running import run_to_end
from tests.server.serving import RunningServer

KINDS = ["recording", "signals.csv", "signals.parquet", "signals.npz"]


@pytest.fixture(scope="module")
def wholes(server: RunningServer, sample_run: dict[str, Any]) -> dict[str, httpx2.Response]:
    with server.client() as client:
        return {kind: client.get(f"/runs/{sample_run['id']}/{kind}") for kind in KINDS}


@pytest.fixture(params=KINDS)
def kind(request) -> str:
    return request.param


@pytest.fixture
def whole(wholes, kind) -> httpx2.Response:
    return wholes[kind]


@pytest.fixture
def path(sample_run, kind) -> str:
    return f"/runs/{sample_run['id']}/{kind}"


def test_a_download_tells_its_size_tag_and_name(whole, sample_run, kind) -> None:
    suffix = "mcap" if kind == "recording" else kind.partition(".")[2]
    assert whole.status_code == 200
    assert int(whole.headers["content-length"]) == len(whole.content) > 1000
    assert whole.headers["accept-ranges"] == "bytes" and whole.headers["etag"].startswith('"')
    name = f'attachment; filename="paper-case-1-{sample_run["id"]}.{suffix}"'
    assert whole.headers["content-disposition"] == name


def test_every_kind_has_a_tag_of_its_own(wholes) -> None:
    assert len({answer.headers["etag"] for answer in wholes.values()}) == len(KINDS)


def test_the_head_is_that_of_the_whole_without_a_byte(client, whole, path) -> None:
    head = client.head(path)
    told = ("content-length", "etag", "accept-ranges", "content-disposition", "content-type")
    assert (head.status_code, head.content) == (200, b"")
    assert [head.headers[name] for name in told] == [whole.headers[name] for name in told]
    for asked in ("bytes=0-9", "bytes=999999999-"):
        part = client.head(path, headers={"Range": asked})
        assert (part.status_code, part.headers["content-length"]) == (200, str(len(whole.content)))


def test_what_the_client_has_is_not_sent_again(client, whole, path) -> None:
    tag = whole.headers["etag"]
    for known in (tag, f'"other", {tag}', f"W/{tag}", "*"):
        answer = client.get(path, headers={"If-None-Match": known})
        assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", tag)
    assert client.get(path, headers={"If-None-Match": '"other"'}).content == whole.content


def test_a_file_that_has_changed_is_not_what_the_client_wants(client, whole, path) -> None:
    tag = whole.headers["etag"]
    assert client.get(path, headers={"If-Match": tag}).status_code == 200
    answer = client.get(path, headers={"If-Match": '"other"'})
    assert answer.status_code == 412 and answer.headers["etag"] == tag
    assert answer.headers["content-type"] == "application/problem+json"
    assert tag in answer.json()["detail"]


@pytest.mark.parametrize(
    "asked", ["0-0", "0-99", "100-199", "500-", "-100", "100-999999999999", f"0-{10**30}"]
)
def test_a_part_is_sent_alone(client, whole, path, asked) -> None:
    first, _, last = asked.partition("-")
    size = len(whole.content)
    start = int(first) if first else size - int(last)
    stop = min(int(last) + 1, size) if first and last else size
    answer = client.get(path, headers={"Range": f"bytes={asked}"})
    assert answer.status_code == 206
    assert answer.content == whole.content[start:stop]
    assert answer.headers["content-range"] == f"bytes {start}-{stop - 1}/{size}"
    assert answer.headers["etag"] == whole.headers["etag"]


def test_a_download_that_was_cut_off_is_completed(client, whole, path) -> None:
    begun = whole.content[:700]
    headers = {"Range": f"bytes={len(begun)}-", "If-Range": whole.headers["etag"]}
    answer = client.get(path, headers=headers)
    assert answer.status_code == 206 and begun + answer.content == whole.content


def test_a_part_of_another_file_is_answered_with_the_whole(client, whole, path) -> None:
    for other in ('"other"', f"W/{whole.headers['etag']}", "Sat, 01 Jan 2000 00:00:00 GMT"):
        answer = client.get(path, headers={"Range": "bytes=5-", "If-Range": other})
        assert answer.status_code == 200 and answer.content == whole.content


@pytest.mark.parametrize(
    "asked",
    [
        "bytes=",
        "bytes=-",
        "bytes=9-2",
        "lines=0-1",
        "bytes=0-1,4-5",
        "bytes=a-b",
        "0-1",
        "bytes=+1-2",
        "bytes=\u0661-\u0662",
    ],
)
def test_what_is_no_single_range_is_answered_with_the_whole(client, sample_run, asked) -> None:
    path = f"/runs/{sample_run['id']}/recording"
    answer = client.get(path, headers=[(b"Range", asked.encode())])
    assert answer.status_code == 200 and len(answer.content) == sample_run["size"]


@pytest.mark.parametrize("asked", ["bytes=999999999-", "bytes=-0", "bytes=" + "9" * 5000 + "-"])
def test_a_part_beyond_the_end_is_a_problem_that_tells_the_size(client, whole, path, asked) -> None:
    answer = client.get(path, headers={"Range": asked})
    assert answer.status_code == answer.json()["status"] == 416
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["content-range"] == f"bytes */{len(whole.content)}"


def test_a_recording_that_is_deleted_while_it_is_sent_arrives_whole(
    server, client, caplog, tmp_path
) -> None:
    body = {
        "scenario": "paper-case-1",
        "set": {"simulation.duration": 60.0, "simulation.output_rate": 1000.0},
    }
    run = run_to_end(client, body)
    assert run["size"] > 4_000_000, "it must not fit into the buffers on the way"
    with client.stream("GET", f"/runs/{run['id']}/recording") as answer:
        assert client.delete(f"/runs/{run['id']}").status_code == 204
        received = b"".join(answer.iter_bytes())
    assert len(received) == run["size"]
    assert client.get(f"/runs/{run['id']}/recording").status_code == 404
    warnings = [r for r in caplog.records if r.levelno >= logging.WARNING]
    # The service may recover, at this moment, what other tests have left of their runs.
    assert [r for r in warnings if r.name != recovery.__name__] == []


def test_a_run_that_is_gone_has_no_tables_though_they_were_made(client) -> None:
    short = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.05}}
    run = client.post("/runs", json=short).json()
    path = f"/runs/{run['id']}/signals.csv"
    tag = client.get(path).headers["etag"]
    assert client.delete(f"/runs/{run['id']}").status_code == 204
    assert client.get(path, headers={"If-None-Match": tag}).status_code == 404


def test_a_run_is_deleted_only_as_the_client_knows_it(client) -> None:
    short = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.05}}
    made = client.post("/runs", json=short)
    path, tag = f"/runs/{made.json()['id']}", made.headers["etag"]
    assert client.get(path).headers["etag"] == tag
    client.patch(path, json={"name": "changed meanwhile"})
    answer = client.delete(path, headers={"If-Match": tag})
    assert answer.status_code == 412 and client.get(path).status_code == 200
    now = client.get(path).headers["etag"]
    assert client.delete(path, headers={"If-Match": now}).status_code == 204
    assert client.get(path).status_code == 404


def test_a_client_that_leaves_during_a_download_frees_the_file(server, sample_run, caplog) -> None:
    head = f"GET /api/v1/runs/{sample_run['id']}/recording HTTP/1.1\r\n"
    host = f"Host: 127.0.0.1:{server.port}\r\n\r\n"
    files = Path("/proc/self/fd")
    before = len(list(files.iterdir())) if files.is_dir() else 0
    for _ in range(20):
        exchange(server.port, (head + host).encode())
    if files.is_dir():
        assert len(list(files.iterdir())) < before + 15
    assert [r for r in caplog.records if r.levelno >= logging.WARNING] == []


def test_a_file_is_made_once_and_dropped_when_others_need_its_room() -> None:
    made, calls = FileCache(max_bytes=250), []

    def fetch(tag: str, size: int = 100) -> int:
        def write(stream) -> None:
            calls.append(tag)
            stream.write(bytes(size))

        with made.open(tag, write) as file:
            return len(file.read())

    assert [fetch(tag) for tag in ("a", "b", "a")] == [100, 100, 100]
    assert calls == ["a", "b"]
    assert fetch("c") == 100, "now there is no room for b, which was used least lately"
    assert [fetch("a"), fetch("b")] == [100, 100] and calls == ["a", "b", "c", "b"]
    assert fetch("large", 1000) == 1000 and fetch("large", 1000) == 1000
    assert calls[-2:] == ["large", "large"]
    made.close()


def test_the_number_of_files_is_limited(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    made = FileCache(max_files=3)
    for number in range(10):
        made.open(str(number), lambda stream: stream.write(b"made")).close()
    assert len(list(tmp_path.iterdir())) == 3
    made.close()
    assert list(tmp_path.iterdir()) == []


def test_files_are_made_again_where_they_were_cleaned_away(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    made = FileCache()
    for tag in ("a", "b", "a"):
        for _ in range(2):
            with made.open(tag, lambda stream: stream.write(b"made")) as file:
                assert file.read() == b"made"
        for path in tmp_path.iterdir():
            path.unlink()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    with pytest.raises(RecordingWriteError, match="nowhere"):
        made.open("c", lambda stream: stream.write(b"made"))
    made.close()


def test_nothing_is_left_of_a_file_that_could_not_be_made(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    made = FileCache()

    def fail(stream) -> None:
        stream.write(b"begun")
        raise ValueError

    with pytest.raises(ValueError):
        made.open("tag", fail)
    assert list(tmp_path.iterdir()) == []


def test_several_threads_get_the_same_file() -> None:
    made, results = FileCache(), []
    numbers = np.arange(1000).tobytes()

    def fetch() -> None:
        with made.open("tag", lambda stream: stream.write(numbers)) as file:
            results.append(file.read())

    threads = [threading.Thread(target=fetch) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    made.close()
    assert results == [numbers] * 8


def test_a_file_that_takes_long_is_made_once_for_all_and_alone(monkeypatch) -> None:
    made, calls, begun, go_on = FileCache(), [], threading.Event(), threading.Event()

    def write(stream) -> None:
        calls.append(begun.set())
        assert go_on.wait(60.0)
        stream.write(b"made")

    def fetch() -> bytes:
        with made.open("tag", write, takes_long=True) as file:
            return file.read()

    with ThreadPoolExecutor(2) as threads:
        waiting = [threads.submit(fetch)]
        assert begun.wait(60.0)
        with monkeypatch.context() as patched:
            patched.setattr(file_cache, "PATIENCE", 0.0)
            for _ in range(2 * file_cache.MAX_WAITING):
                with pytest.raises(ServiceBusyError, match="another long table"):
                    made.open("other", write, takes_long=True)
            with made.open("short", lambda stream: stream.write(b"short")) as file:
                assert file.read() == b"short"
        waiting.append(threads.submit(fetch))
        go_on.set()
        assert [each.result() for each in waiting] == [b"made", b"made"]
    assert len(calls) == 1
    made.close()


def test_few_wait_for_a_file_that_takes_long(monkeypatch) -> None:
    monkeypatch.setattr(file_cache, "MAX_WAITING", 1)
    made = FileCache()

    def write(stream) -> None:
        with pytest.raises(ServiceBusyError, match="try again in 5 s"):
            made.open("other", write, takes_long=True)
        stream.write(b"made")

    with made.open("tag", write, takes_long=True) as file:
        assert file.read() == b"made"
    made.close()
