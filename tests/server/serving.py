"""A real server on a real port for the tests, and a viser server behind it."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx2
from fastapi import FastAPI

from server.app import create_app, server_config
from server.settings import Settings
from server.stopping import StoppableServer

__all__ = ["RunningServer", "serve"]


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

    def client(self, timeout: float = 60.0) -> httpx2.Client:
        # Nothing here is encrypted, and loading certificates takes longer than most tests.
        return httpx2.Client(
            base_url=f"{self.url}/api/v1", timeout=timeout, trust_env=False, verify=False
        )


@contextmanager
def serve(settings: Settings, app: FastAPI | None = None) -> Iterator[RunningServer]:
    app = app or create_app(settings)
    server = StoppableServer(server_config(app, settings))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        while not server.started:
            assert thread.is_alive(), "the server did not start"
            time.sleep(0.01)
        yield RunningServer(app, server.servers[0].sockets[0].getsockname()[1], settings)
    finally:
        server.should_exit = True
        thread.join()
