"""Where the machine code of the kernel is kept: one file per unit, named by what decides it."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import platformdirs

from slipgrasp.core.file_lock import try_lock

ROOT_VARIABLE = "SLIPGRASP_CACHE"
MODE_VARIABLE = "SLIPGRASP_KERNEL"
# Where the variable says so, Python runs the kernel and there is no machine code.
INTERPRETED = os.environ.get(MODE_VARIABLE) == "python"
IN_WEBASSEMBLY = os.environ.get(MODE_VARIABLE) == "webassembly"

_FOLDER = "kernel"
_DIGEST_BYTES = 32
_PATIENCE = 0.05  # [s]


@cache
def cache_root() -> Path:
    """The user's cache folder, or a temporary one where that cannot be written."""
    root = Path(os.environ.get(ROOT_VARIABLE) or platformdirs.user_cache_dir("slipgrasp"))
    try:
        (root / _FOLDER).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root / _FOLDER):
            return root
    except OSError:
        temporary = Path(tempfile.mkdtemp(prefix="slipgrasp-"))
        atexit.register(shutil.rmtree, temporary, ignore_errors=True)
        (temporary / _FOLDER).mkdir()
        return temporary


def code_path(name: str) -> Path:
    """Where machine code of this name is kept; nothing need be there yet."""
    return cache_root() / _FOLDER / f"{name}.code"


def write_code(name: str, code: bytes) -> None:
    """Keeps machine code, whole or not at all, whoever else writes it at the same time."""
    path = code_path(name)
    temporary = path.with_suffix(f".{os.getpid()}")
    temporary.write_bytes(_digest(code) + code)
    temporary.replace(path)


def read_code(name: str) -> bytes | None:
    """Machine code that has been kept; None if there is none, or the disk has spoilt it."""
    path = code_path(name)
    if not path.exists():
        return None
    content = path.read_bytes()
    digest, code = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
    return code if digest == _digest(code) else None


def _digest(code: bytes) -> bytes:
    return hashlib.blake2b(code, digest_size=_DIGEST_BYTES).digest()


@contextmanager
def only_process(meanwhile: Callable[[], None]) -> Iterator[None]:
    """Within it no other process compiles; where files cannot be locked, all may.

    Args:
        meanwhile: Called again and again while another one does.
    """
    with (cache_root() / _FOLDER / "lock").open("ab") as stream:
        try:
            while not try_lock(stream):
                meanwhile()
                time.sleep(_PATIENCE)
        except OSError:
            pass
        yield
