"""The dashboard in a process of its own, which a test can kill and start again."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path


class ServerProcess:
    """``slipgrasp serve`` on a port that stays the same.

    Args:
        data_directory: Where it keeps runs.
        options: Of the command line, beside port and folder.
    """

    def __init__(self, data_directory: Path, *options: str) -> None:
        self._options = options
        self._data_directory = data_directory
        self._port = _free_port()
        self._process: subprocess.Popen[str] | None = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._port}"

    def start(self) -> None:
        """Starts it, and waits until it tells its address."""
        command = [sys.executable, "-m", "slipgrasp", "serve", "--port", str(self._port)]
        self._process = subprocess.Popen(
            [*command, "--data-dir", str(self._data_directory), *self._options],
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline().startswith(self.url)

    def kill(self) -> None:
        """Ends it at once, without a word to anybody."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


def _free_port() -> int:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        port: int = listening.getsockname()[1]
        return port
