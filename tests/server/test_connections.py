"""Connections that ask for nothing, ask slowly, or are too many."""

from __future__ import annotations

import asyncio
import errno
import logging
import socket
import time
from collections.abc import Iterator

import pytest

from slipgrasp.server.http import body_limit, connections
from slipgrasp.server.http.connections import GuardedProtocol, note_failed_accepts
from slipgrasp.server.http.log_limit import BoundedLog
from tests.server.raw_http import exchange, get
from tests.server.serving import RunningServer, patient_settings, serve
from tests.waiting import PATIENCE

HEALTH = "/api/v1/health"


@pytest.fixture(scope="module")
def own(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    with serve(patient_settings(tmp_path_factory.mktemp("connected"))) as running:
        yield running


def connect(server: RunningServer) -> socket.socket:
    return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE)


def is_closed(connection: socket.socket) -> bool:
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


def answers(server: RunningServer) -> bool:
    return get(server.port, HEALTH, [("Host", f"127.0.0.1:{server.port}")]).status == 200


@pytest.mark.parametrize("sent", [b"", b"GET /api/v1/health HTTP/1.1\r\nHost: a"])
def test_who_sends_no_whole_head_in_time_is_let_go(own, monkeypatch, sent) -> None:
    monkeypatch.setattr(connections, "REQUEST_SECONDS", 0.2)
    with connect(own) as connection:
        connection.sendall(sent)
        assert is_closed(connection)


def test_a_byte_now_and_then_puts_the_deadline_not_off(own, monkeypatch) -> None:
    monkeypatch.setattr(connections, "REQUEST_SECONDS", 0.3)
    started = time.monotonic()
    with connect(own) as connection, pytest.raises((BrokenPipeError, ConnectionResetError)):
        while time.monotonic() < started + PATIENCE:
            connection.sendall(b"G")
            time.sleep(0.05)


def test_a_slow_body_of_json_is_cut_off(own, monkeypatch) -> None:
    monkeypatch.setattr(body_limit, "GRACE_SECONDS", 0.2)
    host = f"Host: 127.0.0.1:{own.port}\r\nContent-Type: application/json\r\n"
    head = f"POST /api/v1/runs HTTP/1.1\r\n{host}Content-Length: 100\r\n\r\n"
    answer = exchange(own.port, head.encode(), b"{")
    assert answer.status == 408 and answer.headers["connection"] == "close"


def test_a_crowd_that_asks_for_nothing_makes_room(own, monkeypatch) -> None:
    monkeypatch.setattr(GuardedProtocol, "max_connections", 5)
    crowd = [connect(own) for _ in range(20)]
    assert answers(own)
    assert is_closed(crowd[0])
    for connection in crowd:
        connection.close()


def test_where_all_are_at_work_one_more_is_told_to_come_back(own, monkeypatch) -> None:
    monkeypatch.setattr(GuardedProtocol, "max_connections", 2)
    host = f"Host: 127.0.0.1:{own.port}\r\nContent-Type: application/json\r\n"
    busy = [connect(own) for _ in range(2)]
    for connection in busy:
        head = f"POST /api/v1/runs HTTP/1.1\r\n{host}Content-Length: 100\r\n\r\n"
        connection.sendall(head.encode() + b"{")
    time.sleep(0.2)
    refused = exchange(own.port)
    assert refused.status == 503 and refused.headers["retry-after"] == "5"
    for connection in busy:
        connection.close()


def test_descriptors_that_run_out_are_told_without_a_traceback(caplog) -> None:
    loop = asyncio.new_event_loop()
    note_failed_accepts(loop)
    error = OSError(errno.EMFILE, "Too many open files")
    message = "socket.accept() out of system resource"
    loop.call_exception_handler({"message": message, "exception": error})
    loop.close()
    (record,) = caplog.records
    assert record.getMessage() == "no connection can be accepted: Too many open files"
    assert record.exc_info is None


def test_a_bounded_log_tells_how_much_it_left_out(capsys) -> None:
    log = BoundedLog(max_lines=2, period=0.05)
    logger = logging.Logger("bounded")
    logger.addHandler(log)
    for wait in (0.0,) * 5 + (0.1,):
        time.sleep(wait)
        logger.warning("again")
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["again", "again", "again (and 3 more before)"]
