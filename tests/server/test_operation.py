"""What those who run a server rely on: whether it is ready, its log, and how it ends."""

from __future__ import annotations

import inspect
import json
import logging
import socket
import sys
import threading
from collections.abc import Iterator

import httpx2
import pytest

from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.exceptions import ServiceEndingError
from slipgrasp.server.http.log_limit import MAX_LINES, BoundedLog, log_prints, log_stray_errors
from slipgrasp.server.log_format import LogFormat
from slipgrasp.server.routes import health
from slipgrasp.server.runs.service import RunService
from tests.server.raw_http import get
from tests.server.running import AT_ONCE
from tests.server.serving import LONG, patient_settings, serve
from tests.waiting import wait_until

SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}


def test_a_service_that_takes_runs_is_ready(client) -> None:
    # What a law of another test left of its run is recovered meanwhile.
    wait_until(lambda: client.get("/ready").json()["recovering"] == 0)
    answer = client.get("/ready")
    assert answer.status_code == 200 and answer.json() == {"status": "ready", "recovering": 0}


def test_a_probe_of_readiness_leaves_nothing_in_the_folder(tmp_path) -> None:
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        before = sorted(path.name for path in tmp_path.iterdir())
        assert client.get("/ready").status_code == 200
        assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_a_disk_without_room_is_not_ready_and_says_why(tmp_path) -> None:
    settings = patient_settings(tmp_path, min_free_bytes=1 << 50)
    with serve(settings) as running, running.client() as client:
        answer = client.get("/ready")
        assert client.get("/health").status_code == 200
    assert answer.status_code == 503 and answer.headers["retry-after"] == "5"
    assert answer.headers["content-type"] == "application/problem+json"
    assert "1126 TB must stay free" in answer.json()["detail"]
    assert str(tmp_path) not in answer.text


def test_a_folder_that_takes_no_files_is_not_ready(tmp_path, monkeypatch) -> None:
    def read_only(**_options: object) -> None:
        raise OSError(30, "Read-only file system")

    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        monkeypatch.setattr("slipgrasp.recordings.store.store.TemporaryFile", read_only)
        answer = client.get("/ready")
        monkeypatch.undo()
        assert client.get("/ready").status_code == 200
    assert answer.status_code == 503
    assert "cannot write the data folder: Read-only file system" in answer.json()["detail"]


def test_a_queue_that_is_full_is_not_ready_until_it_has_capacity(tmp_path) -> None:
    settings = patient_settings(tmp_path, max_running=1, max_waiting=1)
    with serve(settings) as running, running.client() as client:
        for _ in range(2):
            assert client.post("/runs", json=LONG, headers=AT_ONCE).status_code == 202
        answer = client.get("/ready")
        assert answer.status_code == 503 and "1 runs are waiting" in answer.json()["detail"]


@pytest.fixture
def ending(tmp_path) -> Iterator[tuple[RunService, threading.Event]]:
    event = threading.Event()
    service = RunService(RecordingStore(tmp_path), patient_settings(tmp_path), event.is_set)
    yield service, event
    service.close()


def test_a_service_that_ends_takes_nothing_on_and_is_not_ready(ending) -> None:
    service, event = ending
    event.set()
    assert "the service is about to end" in service.obstacles()
    with pytest.raises(ServiceEndingError):
        service.submit(lambda: load_scenario("paper-case-1"))


def test_a_run_ends_as_stopped_and_is_kept_as_soon_as_the_service_is_to_end(tmp_path) -> None:
    settings = patient_settings(tmp_path, max_running=1)
    with serve(settings) as running, running.client() as client:
        run_id = client.post("/runs", json=LONG, headers=AT_ONCE).json()["id"]
        service, stopping = running.app.state.run_service, running.app.state.stopping
        pending = service.look_up(run_id)
        stopping.set()
        _, stored = pending.future.result()
        assert stored.summary["outcome"] == "stopped" and stored.path.is_file()
        refused = client.post("/runs", json=SHORT)
        assert refused.status_code == 503 and "about to end" in refused.json()["detail"]


def test_requests_under_way_when_a_service_stops_get_their_run_or_503(tmp_path) -> None:
    settings = patient_settings(tmp_path, max_running=1)
    answers: list[httpx2.Response] = []

    def ask(client: httpx2.Client) -> None:
        answers.append(client.post("/runs", json=LONG, headers={"Prefer": "wait=60"}))

    with serve(settings) as running, running.client() as client:
        threads = [threading.Thread(target=ask, args=(client,)) for _ in range(6)]
        for thread in threads:
            thread.start()
        service = running.app.state.run_service
        wait_until(lambda: (service.load.running, service.load.waiting) == (1, 5))
        running.app.state.stopping.set()
        for thread in threads:
            thread.join()
    assert sorted(answer.status_code for answer in answers) == [201, *[503] * 5]
    (kept,) = [answer.json() for answer in answers if answer.status_code == 201]
    assert kept["outcome"] == "stopped"
    assert [path.stem for path in tmp_path.glob("*.mcap*")] == [kept["id"]]


def test_a_request_that_cannot_end_with_its_service_gets_503_and_no_reset(tmp_path) -> None:
    head = ("POST /api/v1/recordings HTTP/1.1", "Host: localhost:{port}", "Content-Length: 1000")
    with socket.socket() as connection:
        with serve(patient_settings(tmp_path)) as running:
            connection.connect(("127.0.0.1", running.port))
            text = "\r\n".join([*head, "", "the first bytes"]).format(port=running.port)
            connection.sendall(text.encode())
            wait_until(lambda: list(tmp_path.glob("*.upload.part")))
        answer = connection.recv(65536)
    assert answer.startswith(b"HTTP/1.1 503 ") and b"about to end" in answer
    assert not list(tmp_path.glob("*.upload.part"))


def lines_of(capsys: pytest.CaptureFixture[str]) -> list[dict[str, object]]:
    return [json.loads(line) for line in capsys.readouterr().err.splitlines()]


def test_a_json_log_has_one_object_a_line_whatever_is_told(capsys) -> None:
    logger = logging.Logger("slipgrasp.test")
    logger.addHandler(BoundedLog(LogFormat.JSON, max_lines=1, period=0.0))
    logger.warning("two\nlines of %s", "a client \udc80 \u2028")
    try:
        raise ValueError("wrong\nhere")
    except ValueError:
        logger.exception("an unexpected error")
    first, second = lines_of(capsys)
    assert first["message"] == "two\nlines of a client \udc80 \u2028"
    assert (first["level"], first["logger"]) == ("warning", "slipgrasp.test")
    assert str(first["time"]).endswith("+00:00") and "exception" not in first
    assert second["level"] == "error" and "ValueError: wrong" in str(second["exception"])


def test_a_json_log_tells_how_much_it_left_out(capsys) -> None:
    log = BoundedLog(LogFormat.JSON, max_lines=1, period=3600.0)
    logger = logging.Logger("slipgrasp.test")
    logger.addHandler(log)
    for number in range(6):
        log._period = 3600.0 if number < 5 else 0.0
        logger.warning("again")
    assert [line.get("left_out") for line in lines_of(capsys)] == [None, 4]


@pytest.fixture
def stray(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process whose stray errors are logged as JSON, as that of ``slipgrasp serve``."""
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(logging, "lastResort", logging.lastResort)
    log_stray_errors(LogFormat.JSON)
    logging.captureWarnings(False)


def leave_only_last_resort(monkeypatch: pytest.MonkeyPatch) -> None:
    """Takes away what handles the log of tests: pytest's handlers, and those of other servers."""
    for name in ("", "slipgrasp"):
        monkeypatch.setattr(logging.getLogger(name), "handlers", [])


def test_what_a_library_prints_is_a_line_of_the_log_each_minute_few(
    capsys, monkeypatch, stray
) -> None:
    leave_only_last_resort(monkeypatch)
    with log_prints():
        for _ in range(3_000):
            print("Traceback (most recent call last):", file=sys.stderr)
        print("of a ", end="")
        print("library")
    output, errors = capsys.readouterr()
    lines = [json.loads(line) for line in errors.splitlines()]
    assert output == "" and len(lines) == MAX_LINES
    assert lines[0]["message"] == "a library printed: Traceback (most recent call last):"


def test_what_a_library_logs_is_in_the_format_of_the_log(capsys, monkeypatch, stray) -> None:
    leave_only_last_resort(monkeypatch)
    logging.getLogger("python_multipart.multipart").warning("Did not find boundary character")
    (line,) = lines_of(capsys)
    assert line["logger"] == "python_multipart.multipart"


def test_an_error_that_ends_a_thread_is_a_line_of_the_log(caplog, monkeypatch) -> None:
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(logging, "lastResort", logging.lastResort)
    log_stray_errors(LogFormat.TEXT)
    logging.captureWarnings(False)
    thread = threading.Thread(target=lambda: 1 / 0, name="doomed")
    thread.start()
    thread.join()
    (record,) = caplog.records
    assert record.getMessage() == "an unexpected error ended thread 'doomed'"
    assert record.exc_info is not None


def test_refusals_of_each_kind_are_bounded_by_themselves(server, capfd) -> None:
    def ask(*headers: tuple[str, str]) -> int:
        return get(server.port, "/api/v1/health", list(headers)).status

    host = ("Host", f"127.0.0.1:{server.port}")
    wrong = ("Authorization", "Bearer wrong")
    assert {ask(host, wrong) for _ in range(40)} == {401}
    assert ask(("Host", "evil.example")) == 400
    lines = capfd.readouterr().err.splitlines()
    unknown = [line for line in lines if "refused http with 401" in line]
    assert 1 <= len(unknown) <= 11 and "wrong" not in "".join(unknown)
    assert any("refused http with 400" in line for line in lines)


def test_the_health_is_answered_without_a_thread_for_which_it_would_wait() -> None:
    (route,) = (each for each in health.router.routes if each.path == "/health")
    calls = [route.endpoint, *(each.call for each in route.dependant.dependencies)]
    assert len(calls) > 1 and all(map(inspect.iscoroutinefunction, calls))
