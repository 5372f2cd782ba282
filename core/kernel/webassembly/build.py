"""The kernel as one WebAssembly file: the units' own LLVM IR, lowered to wasm32 and linked.

    python -m slipgrasp.core.kernel.webassembly.build build/slipgrasp.wasm

The file imports nothing; docs/webassembly.md describes its exports and the layout of its memory,
as does the file itself, as JSON in its section ``slipgrasp``. Linking needs the extra ``wasm``.
With a folder instead of a file, the units of all hands are written for the folder of
`slipgrasp.core.kernel.webassembly.shipped`; with ``first`` or ``last`` they are only compiled into
the cache, from that end, for this processor and WebAssembly.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.kernel.compilation.cache import code_path, read_code, write_code
from slipgrasp.core.kernel.compilation.compiler import Unit, all_units, only_compile
from slipgrasp.core.kernel.loop.status import LEFT_FACE, REACHED, RUNNING
from slipgrasp.core.kernel.planar import advance as _all_that_is_called  # noqa: F401
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.packing import STRETCH
from slipgrasp.core.kernel.planar.run import OUTLET, PROGRESS
from slipgrasp.core.kernel.webassembly.foreign import Wasmtime
from slipgrasp.core.kernel.webassembly.shipped import sources_digest
from slipgrasp.core.scenario.table import TABLE, choice_fields, places
from slipgrasp.core.trace.signals import SIGNALS

SECTION = "slipgrasp"
RECORDS: Mapping[str, np.dtype] = {
    "table": TABLE,
    "stretch": STRETCH,
    "model": MODEL,
    "run": PROGRESS,
    "outlet": OUTLET,
}
ADVANCE = "slipgrasp_advance"
SPATIAL_ADVANCE = "slipgrasp_spatial_advance"

_INNER = {"slip": ("level", "since"), "tally": ("peak_normal_force", "row_peak")}
"""Described fields of the records in a run."""
_TRIPLE = "wasm32-unknown-unknown"
_FEATURES = "+simd128,+bulk-memory,+nontrapping-fptoint,+sign-ext"
_STACK_BYTES = 1 << 20
# Compilers usually provide this function: a 128-bit product, which LLVM uses to check whether the
# length of a loop overflows.
_PRODUCT = """
define void @__multi3(ptr %out, i64 %a, i64 %a_high, i64 %b, i64 %b_high) {
  %a0 = and i64 %a, 4294967295
  %a1 = lshr i64 %a, 32
  %b0 = and i64 %b, 4294967295
  %b1 = lshr i64 %b, 32
  %p00 = mul i64 %a0, %b0
  %p01 = mul i64 %a0, %b1
  %p10 = mul i64 %a1, %b0
  %p11 = mul i64 %a1, %b1
  %carry = lshr i64 %p00, 32
  %middle = add i64 %p01, %carry
  %middle0 = and i64 %middle, 4294967295
  %middle1 = lshr i64 %middle, 32
  %other = add i64 %p10, %middle0
  %other1 = lshr i64 %other, 32
  %cross = mul i64 %a, %b_high
  %cross_high = mul i64 %a_high, %b
  %sum0 = add i64 %p11, %middle1
  %sum1 = add i64 %sum0, %other1
  %sum2 = add i64 %sum1, %cross
  %high = add i64 %sum2, %cross_high
  %low = mul i64 %a, %b
  store i64 %low, ptr %out
  %next = getelementptr i8, ptr %out, i32 8
  store i64 %high, ptr %next
  ret void
}
"""


class LinkError(SlipgraspError):
    """The linker is not installed, or fails."""


def build(path: Path, exports: Sequence[str] = ()) -> None:
    """Writes the file with all declared units.

    Args:
        path: Output path; its folder is created.
        exports: Symbols of the exported units; others are dropped unless these need them. All if
            empty.

    Raises:
        LinkError: If the linker is not installed, or fails.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    units = all_units()
    unloaded = [unit for unit in units if unit.entry is None]
    with tempfile.TemporaryDirectory() as name:
        objects = [Path(name) / f"{unit.symbol}.o" for unit in units]
        for unit, file in zip(units, objects, strict=True):
            file.write_bytes(object_code(unit))
            # The compiler needs the addresses of called units.
            if unit.entry is None:
                unit.load()
        # Otherwise this process would run their machine code instead of the file.
        for unit in unloaded:
            unit.unload()
        product = Path(name) / "product.o"
        machine = _machine()
        product.write_bytes(machine.emit_object(_parse(_PRODUCT, machine)))
        _link([*objects, product], exports or [unit.symbol for unit in units], path)
    is_spatial = list(exports) == [SPATIAL_ADVANCE]
    layout = describe_spatial_memory() if is_spatial else describe_memory()
    section = _custom_section(SECTION, json.dumps(layout).encode())
    path.write_bytes(path.read_bytes() + section)


def kept_file(exports: Sequence[str] = ()) -> Path:
    """The file of all declared units, cached.

    Args:
        exports: As in `build`.

    Raises:
        LinkError: If the linker is not installed, or fails.
    """
    names = json.dumps([[unit.name for unit in all_units()], describe_memory(), list(exports)])
    digest = hashlib.sha256(names.encode()).hexdigest()
    path = code_path(f"webassembly-{digest[:40]}").with_suffix(".wasm")
    if not path.exists():
        temporary = path.with_suffix(f".{os.getpid()}")
        build(temporary, exports)
        temporary.replace(path)
    return path


def in_wasmtime() -> Callable[[Unit], Callable[..., Any]]:
    """The declared units, run by wasmtime.

    Raises:
        MissingPackageError: If wasmtime is not installed.
        LinkError: If the linker is not installed, or fails.
    """
    return Wasmtime(kept_file()).enter


def object_code(unit: Unit) -> bytes:
    """A unit as an object file for wasm32, cached with its machine code for this processor."""
    name = f"{unit.name}-wasm32"
    kept = read_code(name)
    if kept is None:
        kept = _lower(unit)
        write_code(name, kept)
    return kept


def _lower(unit: Unit) -> bytes:
    compiled = unit.compile()
    text = compiled.library.get_llvm_str()
    # The qualified name contains characters that a symbol may not have.
    text = text.replace(f'@"{compiled.name}"', f"@{unit.symbol}")
    text = text.replace(f"@{compiled.name}(", f"@{unit.symbol}(")
    machine = _machine()
    module = _parse(text, machine)
    for value in (*module.functions, *module.global_variables):
        if not value.is_declaration and value.name != unit.symbol:
            value.linkage = "internal"
    module.verify()
    # Assumes that units never fail, and drops numba's error handling.
    tuning = binding.create_pipeline_tuning_options(speed_level=2)
    tuning.loop_vectorization = tuning.loop_unrolling = False
    builder = binding.create_pass_builder(machine, tuning)
    builder.getModulePassManager().run(module, builder)
    return machine.emit_object(module)


def _parse(text: str, machine: binding.TargetMachine) -> binding.ModuleRef:
    """Retargets a module to another machine."""
    module = binding.parse_assembly(text)
    module.triple, module.data_layout = _TRIPLE, str(machine.target_data)
    return module


def _machine() -> binding.TargetMachine:
    binding.initialize_all_targets()
    binding.initialize_all_asmprinters()
    target = binding.Target.from_triple(_TRIPLE)
    return target.create_target_machine(cpu="generic", features=_FEATURES, opt=3, reloc="static")


def _link(objects: Sequence[Path], exports: Sequence[str], path: Path) -> None:
    command = [sys.executable, "-m", "ziglang", "wasm-ld", "--no-entry", "--strip-all"]
    command += [f"--export={name}" for name in (*exports, "__heap_base")]
    command += ["-z", f"stack-size={_STACK_BYTES}", "--stack-first", "-o", str(path)]
    command += map(str, objects)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise LinkError(
            "the WebAssembly file cannot be linked; 'pip install slipgrasp[wasm]' adds the linker: "
            + (done.stderr.strip().splitlines() or [""])[-1]
        )


def describe_memory() -> dict[str, Any]:
    """Description of the memory for its readers, as plain values.

    Sizes and fields of the records, positions in the table, statuses of the run, and the signals of
    a row of the trace in order.
    """
    return {
        **_describe_run(RECORDS, ADVANCE),
        "places": {key: list(place) for key, place in places().items()},
        "choices": choice_fields(),
    }


def describe_spatial_memory() -> dict[str, Any]:
    """The same for spatial hands, whose models are packed by Python."""
    # Declared and compiled only if spatial hands are requested.
    from slipgrasp.core.kernel.spatial.model import MODEL as SPATIAL_MODEL
    from slipgrasp.core.kernel.spatial.run import OUTLET as SPATIAL_OUTLET
    from slipgrasp.core.kernel.spatial.run import PROGRESS as SPATIAL_PROGRESS

    records = {"model": SPATIAL_MODEL, "run": SPATIAL_PROGRESS, "outlet": SPATIAL_OUTLET}
    return _describe_run(records, SPATIAL_ADVANCE)


def _describe_run(records: Mapping[str, np.dtype], advance: str) -> dict[str, Any]:
    return {
        "records": {
            name: {"size": layout.itemsize, "fields": _describe_fields(layout)}
            for name, layout in records.items()
        },
        "statuses": {"running": RUNNING, "reached": REACHED, "left_face": LEFT_FACE},
        "row": [[signal.name, signal.per] for signal in SIGNALS],
        "advance": advance,
    }


def _describe_fields(layout: np.dtype) -> dict[str, list[Any]]:
    """Offset in bytes, type and shape of every field that is not a record, and of some in records.

    These are, for a slip in progress, the fields that determine which rows may still change, and
    the largest forces.
    """
    described = {}
    for name, (inner, offset, *_) in (layout.fields or {}).items():
        base, shape = inner.subdtype or (inner, ())
        if base.names is None:
            described[name] = [offset, base.str, list(shape)]
        for own in _INNER.get(name, ()):
            kind, inside, *_ = base.fields[own]
            element, shape = kind.subdtype or (kind, ())
            described[f"{name}.{own}"] = [offset + inside, element.str, list(shape)]
    return described


def _custom_section(name: str, content: bytes) -> bytes:
    """A custom section of a WebAssembly file, which engines ignore: id 0, length, name, content."""
    body = _leb128(len(name)) + name.encode() + content
    return b"\0" + _leb128(len(body)) + body


def _leb128(number: int) -> bytes:
    """An unsigned integer in LEB128: seven bits per byte, the lowest first."""
    encoded = bytearray()
    while number >= 0x80:
        encoded.append(number & 0x7F | 0x80)
        number >>= 7
    encoded.append(number)
    return bytes(encoded)


def _compile_units(units: Sequence[Unit]) -> None:
    """Compiles units into the cache, unless another process has done so."""
    only_compile()
    for unit in units:
        object_code(unit)


def _main(output: str) -> None:
    if output.endswith(".wasm"):
        build(Path(output))
        return
    # Declares the units of spatial hands.
    from slipgrasp.core.kernel.spatial import advance as _  # noqa: F401

    if output in ("first", "last"):
        _compile_units(all_units() if output == "first" else all_units()[::-1])
    else:
        build(Path(output) / f"{sources_digest()}.wasm")


if __name__ == "__main__":
    _main(sys.argv[1])
