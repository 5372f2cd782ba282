"""Checks that a scenario gives the same bits with every kind of machine code available here."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from llvmlite import binding

from benchmarks.engines import Chromium, Engine, TimedWasmtime
from benchmarks.portable_runs import all_hashes
from benchmarks.preset_hashes import tabulate_presets
from benchmarks.report import PORTABILITY, Table
from benchmarks.wasm_speed import compare_engines
from slipgrasp.core.kernel.compilation.compiler import entered_by
from slipgrasp.core.kernel.webassembly.build import build
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.scenario.space import SPATIAL
from tests.ensure_programs import find_chromium

NATIVE = "this processor"
_DIGITS = 12
_X86 = platform.machine() in ("x86_64", "AMD64")


def run() -> list[Table]:
    """The tables ``portability``, ``preset-hashes`` and ``webassembly``."""
    hashes = {name: _hashes_under(values) for name, values in _code_variants().items()}
    with tempfile.TemporaryDirectory() as folder, _webassembly(Path(folder)) as engines:
        for name, engine in engines.items():
            with entered_by(engine.enter):
                hashes[name] = all_hashes()
        speed = compare_engines(engines, Path(folder) / "slipgrasp.wasm")
    return [tabulate(hashes), tabulate_presets(hashes[NATIVE]), speed]


def tabulate(hashes: dict[str, dict[str, str]]) -> Table:
    """The first digits of the hash with the first engine, and different ones of other engines.

    An engine that does not run a case has a dash.
    """
    first, *others = hashes.values()
    rows = []
    for case, value in first.items():
        own = value[:_DIGITS]
        found = (other.get(case, "–") for other in others)
        rows.append((case, own, *("same" if f == value else f[:_DIGITS] for f in found)))
    different = sum(value != first[case] for other in others for case, value in other.items())
    total = sum(map(len, others))
    note = (
        f"{total - different} of {total} hashes equal that of the first column. "
        f"Run on {platform.system()}, {platform.machine()}, {binding.get_host_cpu_name()}, with "
        f"{present_provenance().kernel}, in space {present_provenance(SPATIAL).kernel}."
    )
    return Table("portability", ("runs", *hashes), tuple(rows), (note,), PORTABILITY)


def _code_variants() -> dict[str, dict[str, str]]:
    """Environments in which the kernel is compiled for other processors."""
    features = binding.get_host_cpu_features()
    without_fma = [name for name in features if not name.startswith(("fma", "avx512"))]
    without_avx = [name for name in without_fma if not name.startswith(("avx", "f16c", "v", "xop"))]
    variants = {NATIVE: {}, "generic code": _for_processor("x86-64" if _X86 else "generic", "")}
    if features.get("fma"):
        own = binding.get_host_cpu_name()
        variants["without FMA"] = _for_processor(own, _features(features, without_fma))
        variants["without FMA, AVX"] = _for_processor(own, _features(features, without_avx))
    return variants


def _for_processor(name: str, features: str) -> dict[str, str]:
    return {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features}


def _features(present: dict[str, bool], kept: list[str]) -> str:
    """The features of this processor, with all others switched off."""
    return ",".join(
        f"{'+' if there and name in kept else '-'}{name}" for name, there in sorted(present.items())
    )


def _hashes_under(variables: dict[str, str]) -> dict[str, str]:
    """All hashes, from a process with a separate environment."""
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.portable_runs"],
        env=os.environ | variables,
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(done.stdout)


@contextmanager
def _webassembly(folder: Path) -> Iterator[dict[str, Engine]]:
    """The engines that run the file, of which Chromium may be missing."""
    path = folder / "slipgrasp.wasm"
    build(path)
    engines: dict[str, Engine] = {"WebAssembly, wasmtime": TimedWasmtime(path)}
    if find_chromium() is None:
        yield engines
        return
    from benchmarks.browser import open_browser

    with open_browser() as browser:
        engines[f"WebAssembly, Chromium {browser.version}"] = Chromium(path, browser)
        yield engines
