"""Many concurrent clients that send nothing, send slowly, or request a large recording."""

from __future__ import annotations

import http.client
import socket
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np

from benchmarks.faults.services import start_service
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.store.store import RecordingStore

HEALTH = "/api/v1/health"
PATIENCE = 300.0
POLL = 0.02


@dataclass(frozen=True, slots=True)
class Crowd:
    """Responses to a new client while many clients hold connections.

    Attributes:
        idle: Number of connections without a request.
        slow: Number of connections that sent their bodies byte by byte.
        slowest: Longest response time of the new client [s].
        log_bytes: Size of the log that the service wrote meanwhile.
    """

    idle: int
    slow: int
    slowest: float
    log_bytes: int


@dataclass(frozen=True, slots=True)
class Readers:
    """Responses to clients that requested the signals of one recording.

    Attributes:
        size: Size of the recording [bytes].
        statuses: Number of responses by status.
        peak: Peak memory of the service [bytes].
        health_p95: 95th percentile of the response time of health requests [s].
    """

    size: int
    statuses: Counter[int]
    peak: int
    health_p95: float


def hold_connections(idle: int, slow: int, seconds: float) -> Crowd:
    """Opens idle and slow connections, and requests the health of the service."""
    with tempfile.TemporaryDirectory() as folder, serve_logged(Path(folder)) as (address, _, log):
        with ExitStack() as open_sockets:
            for i in range(slow + idle):
                client = open_sockets.enter_context(socket.create_connection(address))
                if i < slow:
                    client.sendall(_slow_request(address))
            waits = [_ask_health(address) for _ in _until(time.monotonic() + seconds)]
        return Crowd(idle, slow, max(waits), log.stat().st_size)


def read_signals(clients: int, duration: float, names: str) -> Readers:
    """Concurrent clients request signals of one recording.

    Args:
        clients: Number of clients.
        duration: Duration of the recorded run [s]; one second gives 4.2 MB.
        names: The signals, separated by commas.
    """
    with tempfile.TemporaryDirectory() as folder:
        run_id, size = _large_recording(Path(folder), duration)
        with serve_logged(Path(folder)) as (address, pid, _):
            _ask_health(address)
            statuses: list[int] = []
            path = f"/api/v1/runs/{run_id}/signals?names={names}"
            threads = [
                threading.Thread(target=lambda: statuses.append(_get(address, path)))
                for _ in range(clients)
            ]
            for thread in threads:
                thread.start()
            waits = []
            while any(thread.is_alive() for thread in threads):
                waits.append(_ask_health(address))
                time.sleep(POLL)
            p95 = float(np.quantile(waits, 0.95))
            return Readers(size, Counter(statuses), _peak(pid), p95)


@contextmanager
def serve_logged(folder: Path) -> Iterator[tuple[tuple[str, int], int, Path]]:
    """A service on a folder: its address, its process and its log."""
    log = folder / "log.txt"
    with log.open("wb") as stream:
        service, url = start_service(folder, stream)
    with service:
        try:
            where = urlsplit(url)
            assert where.hostname is not None and where.port is not None
            yield (where.hostname, where.port), service.pid, log
        finally:
            service.terminate()


def _large_recording(folder: Path, duration: float) -> tuple[str, int]:
    values = {"simulation.output_rate": 10_000.0, "simulation.duration": duration}
    store = RecordingStore(folder)
    store.prepare()
    reservation = store.reserve()
    recorded = record(with_values(load_scenario("paper-case-1"), values), reservation.path)
    stored = store.register(reservation, recorded.result)
    return stored.id, stored.size


def _slow_request(address: tuple[str, int]) -> bytes:
    lines = (
        "POST /api/v1/runs HTTP/1.1",
        f"Host: {address[0]}:{address[1]}",
        "Content-Type: application/json",
        "Content-Length: 1000",
    )
    return ("\r\n".join(lines) + "\r\n\r\n{").encode()


def _until(end: float) -> Iterator[None]:
    while time.monotonic() < end:
        yield
        time.sleep(POLL)


def _ask_health(address: tuple[str, int]) -> float:
    started = time.perf_counter()
    assert _get(address, HEALTH) == 200
    return time.perf_counter() - started


def _get(address: tuple[str, int], path: str) -> int:
    connection = http.client.HTTPConnection(*address, timeout=PATIENCE)
    try:
        connection.request("GET", path)
        answer = connection.getresponse()
        while answer.read(1 << 16):
            pass
        return answer.status
    finally:
        connection.close()


def _peak(pid: int) -> int:
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return 1000 * next(int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
