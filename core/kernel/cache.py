"""Where the machine code of the kernel is kept.

Numba names a cached function by its own file only, so a caller would keep stale code of a
callee in another file. The cache folder therefore carries a digest of all kernel sources.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import numba
import platformdirs
from numba.core import config

ROOT_VARIABLE = "SLIPGRASP_CACHE"


@cache
def cache_root() -> Path:
    """The user's cache folder, or a temporary one where that cannot be written."""
    root = Path(os.environ.get(ROOT_VARIABLE) or platformdirs.user_cache_dir("slipgrasp"))
    try:
        (root / kernel_name()).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root / kernel_name()):
            return root
    except OSError:
        temporary = tempfile.mkdtemp(prefix="slipgrasp-")
        atexit.register(shutil.rmtree, temporary, ignore_errors=True)
        return Path(temporary)


@contextmanager
def in_cache_folder() -> Iterator[None]:
    """Within it numba keeps what it compiles in the folder of this kernel."""
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_root() / kernel_name())
    try:
        yield
    finally:
        config.CACHE_DIR = previous


def functions_in_cache() -> set[str]:
    """Names of the kernel functions whose machine code lies on disk."""
    paths = (cache_root() / kernel_name()).rglob("*.nbc")
    # A file is called module.function-line.python.number.nbc.
    return {path.name.split(".")[1].rpartition("-")[0] for path in paths}


@cache
def kernel_name() -> str:
    """Name of this kernel: its sources and the compiler's version decide it."""
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return f"kernel-{digest.hexdigest()[:16]}"
