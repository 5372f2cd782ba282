"""Many concurrent clients that send nothing, send slowly, or request a large recording."""

from __future__ import annotations

import socket
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.processes import peak_of, watch
from benchmarks.service import Address, serve
from benchmarks.timing import on_threads
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.store.store import RecordingStore

POLL = 0.02


def hold_connections(idle: int, slow: int, seconds: float) -> dict[str, Any]:
    """Opens connections, and requests the health of the service.

    Args:
        idle: Number of connections without a request.
        slow: Number of connections that send their bodies byte by byte.
        seconds: Time for which they are held [s].

    Returns:
        ``idle`` and ``slow``; ``slowest``, the longest response time of a new client [s]; ``log``,
        the size of the log that the service wrote meanwhile [kB].
    """
    with tempfile.TemporaryDirectory() as folder, serve(Path(folder)) as service:
        with ExitStack() as open_sockets:
            for i in range(slow + idle):
                client = open_sockets.enter_context(socket.create_connection(service.address))
                if i < slow:
                    client.sendall(slow_request(service.address))
            with watch(partial(service.seconds_of, "/health"), POLL) as health:
                time.sleep(seconds)
        log = service.log.stat().st_size / 1e3
    return {"idle": idle, "slow": slow, "slowest": max(health), "log": log}


def read_signals(clients: int, duration: float, names: str) -> dict[str, Any]:
    """Concurrent clients request signals of one recording.

    Args:
        clients: Number of clients.
        duration: Duration of the recorded run [s]; one second gives 4.2 MB.
        names: The signals, separated by commas.

    Returns:
        Number of ``clients``; ``statuses``, the number of responses by status; ``size`` of the
        recording and ``peak`` memory of the service [MB]; ``p95`` of the response time of health
        requests [ms].
    """
    with tempfile.TemporaryDirectory() as folder:
        store = RecordingStore(Path(folder))
        store.prepare()
        reservation = store.reserve()
        recorded = record(long_run(duration), reservation.path)
        stored = store.register(reservation, recorded.result)
        with serve(Path(folder)) as service:
            read = partial(service.exchange, keep=0)
            with watch(partial(service.seconds_of, "/health"), POLL) as health:
                path = f"/runs/{stored.id}/signals?names={names}"
                answers = on_threads(read, [path] * clients, clients)
            counts = Counter(answer.status for answer in answers)
            peak = peak_of(service.process.pid)
    return {
        "clients": clients,
        "statuses": ", ".join(f"{n} answered {code}" for code, n in sorted(counts.items())),
        "size": stored.size / 1e6,
        "peak": peak / 1e6,
        "p95": 1e3 * float(np.quantile(health, 0.95)),
    }


def slow_request(address: Address) -> bytes:
    """The start of a request whose body is never complete."""
    lines = (
        "POST /api/v1/runs HTTP/1.1",
        f"Host: {address[0]}:{address[1]}",
        "Content-Type: application/json",
        "Content-Length: 1000",
    )
    return ("\r\n".join(lines) + "\r\n\r\n{").encode()


def long_run(duration: float) -> Scenario:
    """A run whose recording has 4.2 MB per second of its duration [s]."""
    values = {"simulation.output_rate": 10_000.0, "simulation.duration": duration}
    return with_values(load_scenario("paper-case-1"), values)
