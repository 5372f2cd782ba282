"""Checks that a scenario gives the same bits with every kind of machine code available here."""

from __future__ import annotations

import json
import platform
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from llvmlite import binding

from benchmarks.engines import Chromium, Engine, TimedWasmtime
from benchmarks.portable_runs import all_hashes
from benchmarks.preset_hashes import tabulate_presets
from benchmarks.processes import run_module
from benchmarks.report import PORTABILITY, Table
from benchmarks.wasm_speed import compare_engines
from slipgrasp.core.kernel.compilation.compiler import entered_by
from slipgrasp.core.kernel.webassembly.build import build
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.scenario.space import SPATIAL
from tests.ensure_programs import find_chromium

NATIVE = "this processor"
_DIGITS = 12


def run() -> list[Table]:
    """The tables ``portability``, ``preset-hashes`` and ``webassembly``."""
    hashes: dict[str, dict[str, str]] = {
        name: json.loads(run_module("benchmarks.portable_runs", variables=values))
        for name, values in _code_variants().items()
    }
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
        found = (other.get(case, "–") for other in others)
        others_of_case = ("same" if each == value else each[:_DIGITS] for each in found)
        rows.append((case, value[:_DIGITS], *others_of_case))
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
    own = binding.get_host_cpu_name()
    generic = "x86-64" if platform.machine() in ("x86_64", "AMD64") else "generic"
    variants = {NATIVE: {}, "generic code": {"NUMBA_CPU_NAME": generic, "NUMBA_CPU_FEATURES": ""}}
    kept = {"without FMA": without_fma, "without FMA, AVX": without_avx}
    for words, names in kept.items() if features.get("fma") else ():
        signs = {name: "+" if features[name] and name in names else "-" for name in features}
        listed = ",".join(f"{signs[name]}{name}" for name in sorted(signs))
        variants[words] = {"NUMBA_CPU_NAME": own, "NUMBA_CPU_FEATURES": listed}
    return variants


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
