"""The command line as its users meet it: a process of its own."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from slipgrasp.cli.main import main
from tests.slipgrasp.forked import Forked, run_forked
from tests.waiting import PATIENCE

ROOT = Path(__file__).parents[2]


def without_waiting(stderr: str) -> str:
    """What a command complains of, without the words for those who wait longer than a second."""
    waiting = "loading the drawing program|reading the recording|writing the [a-z]+ file"
    return re.sub(f"slipgrasp: ({waiting})\n", "", stderr)


@dataclass
class CommandLine:
    """Runs ``slipgrasp`` in a folder of its own, with its data directory in there."""

    folder: Path

    @property
    def data(self) -> Path:
        return self.folder / "data"

    @property
    def environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "SLIPGRASP_DATA": str(self.data),
        }

    def __call__(self, *arguments, **options) -> subprocess.CompletedProcess[str]:
        if not options:
            return run_forked([*map(str, arguments)], self.folder, self.environment)
        return subprocess.run(
            self.command(*arguments),
            cwd=self.folder,
            # With a limit on the size of files it would leave truncated bytecode.
            env={**self.environment, "PYTHONDONTWRITEBYTECODE": "1"},
            capture_output=True,
            text=True,
            timeout=PATIENCE,
            **options,
        )

    def start(self, *arguments) -> Forked:
        """Starts a command."""
        return Forked([*map(str, arguments)], self.folder, self.environment)

    def start_script(self, script: str, *arguments) -> subprocess.Popen[str]:
        """Starts a script that is given the arguments of a command."""
        return subprocess.Popen(
            [sys.executable, "-c", script, *map(str, arguments)],
            cwd=self.folder,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run_json(self, *arguments, status=0):
        done = self("run", *arguments, "--json")
        assert done.returncode == status, done.stderr
        return json.loads(done.stdout)

    def saved(self) -> list[Path]:
        return sorted(self.data.glob("*")) if self.data.exists() else []

    @staticmethod
    def command(*arguments) -> list[str]:
        return [sys.executable, "-m", "slipgrasp", *map(str, arguments)]


@pytest.fixture
def slipgrasp(tmp_path, kernel) -> CommandLine:
    return CommandLine(tmp_path)


@pytest.fixture
def in_process(slipgrasp, monkeypatch, capsys) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs ``slipgrasp`` here: to start a process takes a hundred times as long as to refuse."""
    monkeypatch.chdir(slipgrasp.folder)
    monkeypatch.setenv("SLIPGRASP_DATA", str(slipgrasp.data))

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        try:
            status = main([str(argument) for argument in arguments])
        except SystemExit as ended:
            assert isinstance(ended.code, int)
            status = ended.code
        printed = capsys.readouterr()
        return subprocess.CompletedProcess(arguments, status, printed.out, printed.err)

    return run
