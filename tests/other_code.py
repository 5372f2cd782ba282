"""Tests of machine code for other processors and engines: run where what they test has changed.

They compile the kernel for minutes, and find what they found before while the numerics, the
compilers and the code that calls these are the same. ``other_code.txt`` has the digest of that
which passed last; ``python -m tests.other_code`` runs them in any case and writes it if they pass.
"""

from __future__ import annotations

import hashlib
import platform
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import pytest

from slipgrasp.core.run.numerics import numerics_name
from slipgrasp.core.scenario.space import PLANAR

ROOT = Path(__file__).parents[1]
PASSED = Path(__file__).with_name("other_code.txt")
TOOLS = ("llvmlite", "numba", "wasmtime", "ziglang")
FILES = (
    "benchmarks/elementary.py",
    "benchmarks/engines.py",
    "core/kernel/compilation/*.py",
    "core/kernel/webassembly/*.py",
    "web/standalone/kernel.js",
)


def has_passed() -> bool:
    """Whether the tests have passed with all that is here now."""
    return PASSED.read_text(encoding="utf-8").strip() == digest()


def digest() -> str:
    """What stands for all that the tests depend on."""
    return hashlib.sha256("\n".join(_parts()).encode()).hexdigest()


def _parts() -> Iterator[str]:
    yield f"{platform.system()} {platform.machine()} {sys.implementation.cache_tag}"
    yield numerics_name(PLANAR)  # What they run are planar hands.
    yield from (f"{tool} {version(tool)}" for tool in TOOLS)
    for pattern in FILES:
        yield from (path.read_text(encoding="utf-8") for path in sorted(ROOT.glob(pattern)))
    texts = (path.read_text(encoding="utf-8") for path in sorted(ROOT.glob("tests/*/test_*.py")))
    yield from (text for text in texts if "pytest.mark.other_code" in text)


if __name__ == "__main__":
    status = pytest.main(["-m", "other_code", "--other-code", *sys.argv[1:]])
    if status == pytest.ExitCode.OK:
        PASSED.write_text(f"{digest()}\n", encoding="utf-8")
    sys.exit(status)
