"""Name of the numerics: a digest of all code that determines the bits of a run.

It excludes code that does not affect bits (`slipgrasp.core.kernel.compilation.normal_form`): the
module and call style, comments, text, annotations and unused code. The name is therefore
independent of the Python version, processor and machine code, and also valid for the interpreted
kernel.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from threading import Lock
from typing import Any

import numpy as np

from slipgrasp.core.kernel.compilation.cache import read_code, write_code
from slipgrasp.core.kernel.compilation.compiler import OPTIONS, call
from slipgrasp.core.kernel.compilation.entry import compile_entry
from slipgrasp.core.kernel.compilation.normal_form import NormalForm
from slipgrasp.core.kernel.laws.own_law import call_law
from slipgrasp.core.kernel.webassembly.shipped import sources_digest
from slipgrasp.core.run.computation import Computation
from slipgrasp.core.run.engine import engine_of, make_engine
from slipgrasp.core.run.metrics import compute_metrics
from slipgrasp.core.scenario.chosen_laws import custom_law_in
from slipgrasp.core.scenario.custom_laws import law_number, law_of
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.space import Space

PORTABLE = "numerics-"

# Names of earlier versions with different code and equal bits, by the current name: recordings with
# these verify bit for bit. An entry applies to the current name only and must be removed with the
# next change of the code; before adding one, compare the hashes of `python -m benchmarks
# portability` (docs/portability.md).
SAME_BITS: dict[str, tuple[str, ...]] = {
    "numerics-7b7b3584f3ead74b": ("numerics-bd6c7b5ea4021303", "numerics-4b0bf01c9440a626"),
    "numerics-79a130f31c2a82f5": ("numerics-f0e96f87c407ac8e", "numerics-3c2e2a443c069062"),
    "numerics-e4ed840f9ec3b46c": ("numerics-d27e3c15eb25a7f9",),
    "numerics-855d3bbd050d3b6f": ("numerics-74b5c433c2011d1e",),
}

_DIGEST_BYTES = 8
# Runs that begin at the same time compute the name once.
_ONE_AT_A_TIME = Lock()
# Functions that only read settings or call code outside the kernel, and compute nothing.
_ENDS = (call, call_law, make_engine, with_values, law_number, law_of, custom_law_in)


def same_bits(recorded: str, present: str) -> bool:
    """True if runs of two numerics, given by name, are equal to the last bit."""
    return recorded == present or recorded in SAME_BITS.get(present, ())


@cache
def numerics_name(space: Space) -> str:
    """Name of the current numerics; cached on disk until a source changes.

    Args:
        space: Kind of hand; each kind has separate code.
    """
    with _ONE_AT_A_TIME:
        # Digests contain constants of the library, too.
        kept_as = f"numerics-{space.name}-{np.__version__}-{sources_digest()}"
        kept = read_code(kept_as)
        if kept is not None:
            return kept.decode()
        name = compute_name(space)
        write_code(kept_as, name.encode())
        return name


def compute_name(space: Space) -> str:
    """Computes the name of the current numerics from the code."""
    digest = hashlib.blake2b(digest_size=_DIGEST_BYTES)
    for line in normal_form(space).lines:
        digest.update(f"{line}\n".encode())
    return f"{PORTABLE}{digest.hexdigest()}"


def normal_form(space: Space) -> NormalForm:
    """All code that determines the bits of a run."""
    return NormalForm(_roots(space), _ENDS)


def _roots(space: Space) -> Iterator[Any]:
    yield from (OPTIONS, compile_entry, compute_metrics)
    yield from (Computation._prepare, Computation.advance, Computation._pass_end)
    yield from (Computation._begin_stretch, Computation._pack, Computation._reset_estimate)
    yield engine_of(space)
