"""Where the machine code of the kernel is kept.

Numba names a cached function by its own file only, so a caller would keep stale code of a
callee in another file. The cache folder therefore carries a digest of all kernel sources.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
import platformdirs
from numba.core import config

__all__ = ["ROOT_VARIABLE", "cache_root", "in_cache_folder", "is_in_cache"]

ROOT_VARIABLE = "SLIPGRASP_CACHE"


@cache
def cache_root() -> Path:
    """The user's cache folder, or a temporary one where that cannot be written."""
    root = Path(os.environ.get(ROOT_VARIABLE) or platformdirs.user_cache_dir("slipgrasp"))
    try:
        (root / _kernel_name()).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=root / _kernel_name()):
            return root
    except OSError:
        return Path(tempfile.mkdtemp(prefix="slipgrasp-"))


@contextmanager
def in_cache_folder() -> Iterator[None]:
    """Within it numba keeps what it compiles in the folder of this kernel."""
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_root() / _kernel_name())
    try:
        yield
    finally:
        config.CACHE_DIR = previous


def is_in_cache(function: Callable[..., Any]) -> bool:
    """Whether the machine code of a kernel function lies on disk."""
    return any((cache_root() / _kernel_name()).rglob(f"*.{function.__name__}-*.nbc"))


@cache
def _kernel_name() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return f"kernel-{digest.hexdigest()[:16]}"
