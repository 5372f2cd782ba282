"""Processes of the command line that start with all modules imported and the kernel loaded.

They are forked from one process, so that killing a thousand of them does not cost a thousand starts
of an interpreter. After the fork they run the code of the command.
"""

from __future__ import annotations

import os
import sys
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import slipgrasp.web.app  # noqa: F401, imported for the processes forked from this one
from slipgrasp.cli.main import main
from slipgrasp.core.run.simulator import prepare_kernel

_CONTEXT = get_context("forkserver")
_CONTEXT.set_forkserver_preload([__name__])


def start(*arguments: str) -> ForkServerProcess:
    """Starts a command, which prints nothing."""
    process = _CONTEXT.Process(target=_execute, args=(arguments, None))
    process.start()
    return process


def start_service(folder: Path) -> tuple[ForkServerProcess, str]:
    """A service on a folder that is ready, and its URL."""
    reader, writer = _CONTEXT.Pipe(duplex=False)
    arguments = ("serve", "--port", "0", "--data-dir", str(folder))
    process = _CONTEXT.Process(target=_execute, args=(arguments, writer))
    process.start()
    writer.close()
    with reader, open(reader.fileno(), encoding="utf-8", closefd=False) as output:
        return process, output.readline().strip()


def _execute(arguments: tuple[str, ...], output: Connection | None) -> None:
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing if output is None else output.fileno(), 1)
    os.dup2(nothing, 2)
    # The old stream has stored whether it was a seekable file.
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    raise SystemExit(main(arguments))


prepare_kernel()
