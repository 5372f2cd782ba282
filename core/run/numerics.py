"""The name of the numerics: a digest of all code that decides the bits of a run.

What it leaves out (`slipgrasp.core.kernel.compilation.normal_form`) decides no bit: where code is
defined and how it is called, comments, words, annotations, and what no code uses. So the name is
the same for every version of Python, processor and machine code, and where Python runs the kernel.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import slipgrasp.core
from slipgrasp.core.kernel.compilation.cache import read_code, write_code
from slipgrasp.core.kernel.compilation.compiler import OPTIONS, call
from slipgrasp.core.kernel.compilation.entry import compile_entry
from slipgrasp.core.kernel.compilation.normal_form import NormalForm
from slipgrasp.core.kernel.laws.own_law import call_law
from slipgrasp.core.run.computation import Computation
from slipgrasp.core.run.engine import engine_of, make_engine
from slipgrasp.core.run.metrics import compute_metrics
from slipgrasp.core.scenario.chosen_laws import custom_law_in
from slipgrasp.core.scenario.custom_laws import law_number, law_of
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.space import Space

PORTABLE = "numerics-"

# Names of earlier versions whose code was another and whose bits were the same, by the present
# name: recordings with these verify bit for bit. An entry holds for this very name, so that it
# ends with the next change of the code; who adds one has compared the hashes of
# `python -m benchmarks portability` first (docs/portability.md).
SAME_BITS: dict[str, tuple[str, ...]] = {}

_DIGEST_BYTES = 8
# They read what is asked, or call what is not the kernel's; none of them computes anything.
_ENDS = (call, call_law, make_engine, with_values, law_number, law_of, custom_law_in)


def same_bits(recorded: str, present: str) -> bool:
    """Whether runs of two numerics are equal to the last bit, by their names."""
    return recorded == present or recorded in SAME_BITS.get(present, ())


@cache
def numerics_name(space: Space) -> str:
    """The name of what computes runs here; kept on disk until some source changes.

    Args:
        space: Of which kind of hand; what computes one kind has no part in the other.
    """
    kept_as = f"numerics-{space.name}-{_sources_digest()}"
    kept = read_code(kept_as)
    if kept is not None:
        return kept.decode()
    name = compute_name(space)
    write_code(kept_as, name.encode())
    return name


def compute_name(space: Space) -> str:
    """The same, from the code."""
    digest = hashlib.blake2b(digest_size=_DIGEST_BYTES)
    for line in normal_form(space).lines:
        digest.update(f"{line}\n".encode())
    return f"{PORTABLE}{digest.hexdigest()}"


def normal_form(space: Space) -> NormalForm:
    """All code that decides the bits of a run."""
    return NormalForm(_roots(space), _ENDS)


def _roots(space: Space) -> Iterator[Any]:
    yield from (OPTIONS, compile_entry, compute_metrics)
    yield from (Computation._prepare, Computation.advance, Computation._pass_end)
    yield from (Computation._begin_stretch, Computation._pack, Computation._reset_estimate)
    yield engine_of(space)


def _sources_digest() -> str:
    """Of every source that could be reached, and of the library whose values it holds."""
    digest = hashlib.blake2b(np.__version__.encode(), digest_size=2 * _DIGEST_BYTES)
    for path in sorted(Path(slipgrasp.core.__path__[0]).rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()
