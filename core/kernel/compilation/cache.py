"""Cache of the machine code of the kernel: one file per unit, named by its fingerprint."""

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
# With this value of the variable, Python runs the kernel and there is no machine code.
INTERPRETED = os.environ.get(MODE_VARIABLE) == "python"
IN_WEBASSEMBLY = os.environ.get(MODE_VARIABLE) == "webassembly"

_FOLDER = "kernel"
_DIGEST_BYTES = 32
_PATIENCE = 0.05  # [s]


@cache
def cache_root() -> Path:
    """The user's cache folder, or a temporary one if that cannot be written."""
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
    """Path of the machine code of a name; it need not exist."""
    return cache_root() / _FOLDER / f"{name}.code"


def write_code(name: str, code: bytes) -> None:
    """Stores machine code atomically, safe with concurrent writers."""
    path = code_path(name)
    temporary = path.with_suffix(f".{os.getpid()}")
    temporary.write_bytes(_digest(code) + code)
    temporary.replace(path)


def read_code(name: str) -> bytes | None:
    """Returns stored machine code; None if there is none or it is damaged."""
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
    """A context in which no other process compiles; without file locks, all may.

    Args:
        meanwhile: Called repeatedly while another process compiles.
    """
    with (cache_root() / _FOLDER / "lock").open("ab") as stream:
        try:
            while not try_lock(stream):
                meanwhile()
                time.sleep(_PATIENCE)
        except OSError:
            pass
        yield
