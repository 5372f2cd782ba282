"""The kernel as a WebAssembly file, so that runs need not wait for the compiler.

Wheels contain it (`.ci/release_check.py`). Runs start on it while machine code, which gives the
same bits, is compiled in the background.
"""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from slipgrasp.core.kernel.compilation.compiler import Enter

FOLDER = Path(__file__).parent / "kernels"
_DIGEST_BYTES = 16


def shipped_file() -> Path | None:
    """The file that matches the sources; None if it is missing or wasmtime is not installed."""
    if not FOLDER.is_dir() or find_spec("wasmtime") is None:
        return None
    path = FOLDER / f"{sources_digest()}.wasm"
    return path if path.exists() else None


@cache
def enter_shipped() -> Enter:
    """Returns the functions that execute units in this file."""
    from slipgrasp.core.kernel.webassembly.foreign import Wasmtime

    path = shipped_file()
    assert path is not None, "a file that was there at the start"
    return Wasmtime(path).enter


@cache
def sources_digest() -> str:
    """Digest of every source that can determine the bits of a run."""
    digest = hashlib.blake2b(digest_size=_DIGEST_BYTES)
    for path in sorted(Path(__file__).parents[2].rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
