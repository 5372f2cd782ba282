"""What computes runs here: equal provenance gives equal bits for equal scenarios."""

from __future__ import annotations

import hashlib
import platform
from dataclasses import dataclass
from functools import cache
from importlib import metadata

from slipgrasp.core.scenario.own_laws import LawIdentity

_DIGEST_BYTES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What computed a run.

    Attributes:
        program: Version of the program.
        kernel: Digest of all that decides the machine code: sources, compiler, kind of
            processor and mathematical library. Empty where it was not recorded.
        law: The law of one's own that commanded the torques, None where it was a built-in one.
    """

    program: str
    kernel: str
    law: LawIdentity | None = None


@cache
def present_provenance() -> Provenance:
    """The provenance of runs that are computed by this process."""
    return Provenance(program=program_version(), kernel=_kernel_digest())


@cache
def program_version() -> str:
    """Version of the installed program; ``0`` where it runs without being installed."""
    try:
        return metadata.version("slipgrasp")
    except metadata.PackageNotFoundError:
        return "0"


def _kernel_digest() -> str:
    import llvmlite
    from llvmlite import binding

    from slipgrasp.core.kernel.cache import kernel_name

    parts = (
        kernel_name(),
        llvmlite.__version__,
        binding.get_process_triple(),
        binding.get_host_cpu_name(),
        binding.get_host_cpu_features().flatten(),
        *platform.libc_ver(),
    )
    return hashlib.blake2b("\n".join(parts).encode(), digest_size=_DIGEST_BYTES).hexdigest()
