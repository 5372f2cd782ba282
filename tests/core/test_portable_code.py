"""Nothing in the kernel's machine code may round otherwise on another machine."""

import os
import pickle
import struct
import subprocess
import sys
from pathlib import Path

import pytest

from slipgrasp.core.kernel.compilation.cache import code_path, read_code
from slipgrasp.core.kernel.compilation.compiler import kept_code
from slipgrasp.core.run.simulator import prepare_kernel

REPOSITORY = Path(__file__).parents[2]
ELF = b"\x7fELF"
SYMBOL_TABLE, UNDEFINED = 2, 0

# They set memory to zero, and copy it.
WITHOUT_ROUNDING = {"memset", "memcpy", "memmove"}

# Haswell has fused multiply-adds; the code is not run, so that any x86-64 will do.
COMPILE = """
from slipgrasp.core.kernel.compilation import compiler
from slipgrasp.core.kernel.planar import advance
from slipgrasp.core.kernel.compilation.entry import compile_entry
for symbol in compiler._UNITS:
    compiler.add_symbol(symbol, 1)
for unit in compiler._UNITS.values():
    entry = compile_entry(
        unit.function, unit.signature, compiler.OPTIONS, unrolled=unit.unrolled
    )
    for line in entry.library.get_asm_str().splitlines():
        code = line.split()
        if code and code[0].startswith(("vfma", "vfms", "vfnma", "vfnms")):
            print(unit.symbol, line)
"""


def undefined_symbols(code):
    """Names that an ELF object of 64 bits wants from outside."""
    (start,) = struct.unpack_from("<Q", code, 0x28)
    size, count = struct.unpack_from("<HH", code, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", code, start + k * size) for k in range(count)]
    for _, kind, _, _, offset, length, link, _, _, step in sections:
        if kind == SYMBOL_TABLE:
            names = sections[link][4]
            for at in range(offset, offset + length, step):
                name, _, _, section = struct.unpack_from("<IBBH", code, at)
                if section == UNDEFINED and name:
                    end = code.index(b"\0", names + name)
                    yield code[names + name : end].decode()


def objects():
    """Machine code of every unit, by its name."""
    prepare_kernel()
    for path in kept_code():
        code = read_code(path.stem)
        assert code is not None and path == code_path(path.stem)
        _, (_, kind, parts) = pickle.loads(code)
        assert kind == "object"
        yield path.stem, parts[0]


def test_no_unit_calls_anything_but_units_and_what_sets_or_copies_memory():
    found = dict(objects())
    assert len(found) > 40
    if not all(code.startswith(ELF) for code in found.values()):
        pytest.skip("this system has another format of object code")
    called = {name: set(undefined_symbols(code)) for name, code in found.items()}
    units = {symbol for symbols in called.values() for symbol in symbols}
    units = {symbol for symbol in units if symbol.startswith("slipgrasp_")}
    assert len(units) > 20
    for name, symbols in called.items():
        assert symbols <= units | WITHOUT_ROUNDING, name


@pytest.mark.slow
@pytest.mark.other_code
def test_no_unit_fuses_a_product_and_a_sum_where_the_processor_could():
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), "NUMBA_CPU_NAME": "haswell"}
    environment["NUMBA_CPU_FEATURES"] = "+fma,+avx,+avx2"
    done = subprocess.run(
        [sys.executable, "-c", COMPILE], env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == ""
