"""A real server on a real port for the tests, and a viser server behind it."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import uvicorn.server
from fastapi import FastAPI

from slipgrasp.server.app import StoppableServer, create_app, server_config
from slipgrasp.server.settings import Settings
from tests.waiting import PATIENCE, wait_until

LONG_RUN = {
    "simulation.duration": 600.0,
    "simulation.output_rate": 1.0,
    "controller.control_period": 0.0001,
    "simulation.max_step": 0.00001,
    "simulation.max_steps": 100_000_000,
}
LONG = {"scenario": "paper-case-1", "set": LONG_RUN}
"""A request for a run that is over on no machine before somebody ends it."""


def patient_settings(data_directory: Path, **others: Any) -> Settings:
    """Settings under which no answer depends on how fast the machine is.

    Args:
        data_directory: Folder of the recordings.
        others: What the test is about.
    """
    patient = {"answer_within": PATIENCE, "wall_limit": PATIENCE}
    return Settings(data_directory=data_directory, **{**patient, **others})


@dataclass(frozen=True, slots=True)
class RunningServer:
    app: FastAPI
    port: int
    settings: Settings

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def data_directory(self) -> Path:
        return self.settings.data_directory

    def client(self, timeout: float = PATIENCE) -> httpx2.Client:
        # Nothing here is encrypted, and loading certificates takes longer than most tests.
        # A connection that idles on a slow machine would be closed under the next request.
        return httpx2.Client(
            base_url=f"{self.url}/api/v1",
            timeout=timeout,
            trust_env=False,
            verify=False,
            limits=httpx2.Limits(max_keepalive_connections=0),
        )


class _BriskAsyncio:
    """The module for uvicorn, which else looks and waits for 0.1 s at the end of each server."""

    def __getattr__(self, name: str) -> Any:
        return getattr(asyncio, name)

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(0.2 * seconds)


uvicorn.server.asyncio = _BriskAsyncio()


@contextmanager
def serve(settings: Settings, app: FastAPI | None = None) -> Iterator[RunningServer]:
    app = app or create_app(settings)
    server = StoppableServer(server_config(app, settings))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        wait_until(lambda: server.started or not thread.is_alive())
        assert server.started, "the server did not start"
        yield RunningServer(app, server.servers[0].sockets[0].getsockname()[1], settings)
    finally:
        server.should_exit = True
        thread.join()
