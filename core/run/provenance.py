"""What computes runs here: equal scenarios give equal bits wherever the kernel has this name."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path

from slipgrasp.core.scenario.laws import CONTROL_LAWS
from slipgrasp.core.scenario.own_laws import LawIdentity

PORTABLE = "numerics-"

_DIGEST_BYTES = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What computed a run.

    Attributes:
        program: Version of the program.
        kernel: Name of the numerics: a digest of the kernel's sources after `PORTABLE`, with
            nothing of processor, compiler or libraries, for these decide no bit. Recordings
            before format 5 have a digest of the machine code, or nothing.
        law: The law of one's own that commanded the torques, None where it was a built-in one.
    """

    program: str
    kernel: str
    law: LawIdentity | None = None

    @property
    def is_portable(self) -> bool:
        """Whether equal bits are promised on every machine, not only for one machine code."""
        return self.kernel.startswith(PORTABLE)


@cache
def present_provenance(*, in_space: bool = False) -> Provenance:
    """The provenance of runs that are computed by this process.

    Args:
        in_space: Whether they are of hands in space; what computes those has no part in others.
    """
    return Provenance(program=program_version(), kernel=_kernel_name(in_space))


@cache
def program_version() -> str:
    """Version of the installed program; ``0`` where it runs without being installed."""
    try:
        return metadata.version("slipgrasp")
    except metadata.PackageNotFoundError:
        return "0"


def _kernel_name(in_space: bool) -> str:
    """Digest of what the kernel computes: its sources, and the facts of the control laws."""
    import slipgrasp.core.kernel

    digest = hashlib.blake2b(str(CONTROL_LAWS).encode(), digest_size=_DIGEST_BYTES)
    folder = Path(slipgrasp.core.kernel.__file__).parent
    for path in sorted(folder.rglob("*.py")):
        if path.parent != folder / "space" or in_space:
            digest.update(_text(path))
    return f"{PORTABLE}{digest.hexdigest()}"


def _text(path: Path) -> bytes:
    """A source as text: the ends of its lines are those of the checkout."""
    return path.read_text(encoding="utf-8").encode()
