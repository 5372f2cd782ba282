"""What computes runs here: equal scenarios give equal bits wherever the kernel has this name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import metadata

from slipgrasp.core.run.numerics import PORTABLE, numerics_name, same_bits
from slipgrasp.core.scenario.custom_laws import LawIdentity
from slipgrasp.core.scenario.space import PLANAR, Space


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """What computed a run.

    Attributes:
        program: Version of the program.
        kernel: Name of the numerics: a digest of the code that decides bits after `PORTABLE`, with
            nothing of processor, compiler or libraries, for these decide none. Recordings
            before format 5 have a digest of the machine code, or nothing.
        law: The custom law that commanded the torques, None where it was a built-in one.
    """

    program: str
    kernel: str
    law: LawIdentity | None = None

    @property
    def is_portable(self) -> bool:
        """Whether equal bits are promised on every machine, not only for one machine code."""
        return self.kernel.startswith(PORTABLE)

    def has_bits_of(self, present: Provenance) -> bool:
        """Whether runs that the present numerics compute are equal to the last bit."""
        return same_bits(self.kernel, present.kernel)


@cache
def present_provenance(space: Space = PLANAR) -> Provenance:
    """The provenance of runs that are computed by this process.

    Args:
        space: Of which kind of hand; what computes one kind has no part in the other.
    """
    return Provenance(program=program_version(), kernel=numerics_name(space))


@cache
def program_version() -> str:
    """Version of the installed program; ``0`` where it runs without being installed."""
    try:
        return metadata.version("slipgrasp")
    except metadata.PackageNotFoundError:
        return "0"
