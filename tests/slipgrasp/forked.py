"""Commands in processes of their own, which need not load numpy, the kernel and so on again."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from multiprocessing import get_context
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


def _run(
    arguments: list[str], folder: Path, environment: dict[str, str], output: Path, errors: Path
) -> None:
    """What the forked process does."""
    from slipgrasp.cli.main import main

    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv[:] = ["slipgrasp", *arguments]
    for path, stream in ((output, _OUTPUT), (errors, _ERRORS)):
        with path.open("wb") as file:
            os.dup2(file.fileno(), stream)
    sys.exit(main(arguments))
