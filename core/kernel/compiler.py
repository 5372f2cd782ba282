"""How the kernel is compiled, and where the machine code is kept.

Numba names a cached function by its own file only, so a caller keeps stale code of a
callee in another file. The cache folder therefore carries a digest of all kernel sources.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import platformdirs
from numba.core import config

__all__ = ["cache_folder", "compiled"]


def _source_digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _writable_folder() -> Path:
    """The user's cache folder, or a temporary one where that cannot be written."""
    root = os.environ.get("SLIPGRASP_CACHE") or platformdirs.user_cache_dir("slipgrasp")
    folder = Path(root) / f"kernel-{_source_digest()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.mkdtemp(prefix="slipgrasp-kernel-"))


cache_folder = _writable_folder()


def compiled(function: Callable[..., Any]) -> Any:
    """Compiles a kernel function on first use, without the GIL, into the cache folder."""
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_folder)
    try:
        return numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    finally:
        config.CACHE_DIR = previous
