"""Commands in processes of their own, which need not load numpy, the kernel and so on again."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from subprocess import CompletedProcess

from tests.waiting import PATIENCE

_CONTEXT = get_context("forkserver")
_CONTEXT.set_forkserver_preload(["tests.slipgrasp.warm_process"])
_INPUT, _OUTPUT, _ERRORS = range(3)


def run_forked(
    arguments: list[str], folder: Path, environment: Mapping[str, str]
) -> CompletedProcess[str]:
    """Runs ``slipgrasp`` in a folder; as a process, whatever it loads or leaves behind is its own.

    Args:
        arguments: What stands behind the program's name.
        folder: Where it runs.
        environment: Its variables.
    """
    printed = [folder.parent / f"{folder.name}.{stream}" for stream in ("output", "errors")]
    process = _CONTEXT.Process(target=_run, args=(arguments, folder, dict(environment), *printed))
    process.start()
    process.join(PATIENCE)
    assert process.exitcode is not None, f"slipgrasp {' '.join(arguments)} does not end"
    return CompletedProcess(arguments, process.exitcode, *(path.read_text() for path in printed))


class Forked:
    """A command that goes on in a process of its own: what tests use of ``subprocess.Popen``.

    Args:
        arguments: What stands behind the program's name.
        folder: Where it runs.
        environment: Its variables.
    """

    def __init__(self, arguments: list[str], folder: Path, environment: Mapping[str, str]) -> None:
        heard, told = zip(*(_CONTEXT.Pipe(duplex=False) for _ in (_OUTPUT, _ERRORS)), strict=True)
        given = (arguments, folder, dict(environment), *told)
        self._process = _CONTEXT.Process(target=_run_piped, args=given)
        self._process.start()
        for end in told:
            end.close()
        self.stdout, self.stderr = (os.fdopen(os.dup(end.fileno()), "r") for end in heard)
        assert self._process.pid is not None
        self.pid = self._process.pid

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def wait(self, timeout: float = PATIENCE) -> int:
        self._process.join(timeout)
        assert self._process.exitcode is not None, "it does not end"
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        os.kill(self.pid, number)

    def terminate(self) -> None:
        self._process.terminate()

    def __enter__(self) -> Forked:
        return self

    def __exit__(self, *_: object) -> None:
        self.stdout.close()
        self.stderr.close()
        self.wait()


def _run(
    arguments: list[str], folder: Path, environment: dict[str, str], output: Path, errors: Path
) -> None:
    """What a forked process does that writes to files."""
    with output.open("wb") as to_output, errors.open("wb") as to_errors:
        os.dup2(to_output.fileno(), _OUTPUT)
        os.dup2(to_errors.fileno(), _ERRORS)
    _execute(arguments, folder, environment)


def _run_piped(
    arguments: list[str],
    folder: Path,
    environment: dict[str, str],
    output: Connection,
    errors: Connection,
) -> None:
    """What a forked process does that is listened to."""
    for end, stream in ((output, _OUTPUT), (errors, _ERRORS)):
        os.dup2(end.fileno(), stream)
        end.close()
    # The old streams have stored whether they were seekable files.
    sys.stdout = open(_OUTPUT, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    sys.stderr = open(_ERRORS, "w", 1, encoding="utf-8", closefd=False)  # noqa: SIM115
    _execute(arguments, folder, environment)


def _execute(arguments: list[str], folder: Path, environment: dict[str, str]) -> None:
    from slipgrasp.cli.main import main

    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv[:] = ["slipgrasp", *arguments]
    sys.exit(main(arguments))
