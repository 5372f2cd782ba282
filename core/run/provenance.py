"""Provenance of runs: equal scenarios give equal bits wherever the kernel has the same name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import metadata

from slipgrasp.core.run.numerics import PORTABLE, numerics_name, same_bits
from slipgrasp.core.scenario.custom_laws import LawIdentity
from slipgrasp.core.scenario.space import PLANAR, Space


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Program, numerics and custom law that computed a run.

    Attributes:
        program: Version of the program.
        kernel: Name of the numerics: `PORTABLE` and a digest of the code that determines the
            bits, independent of processor, compiler and libraries. Recordings before format 5 have
            a digest of the machine code, or nothing.
        law: The custom law that commanded the torques, None for a built-in one.
    """

    program: str
    kernel: str
    law: LawIdentity | None = None

    @property
    def is_portable(self) -> bool:
        """True if equal bits are guaranteed on every machine, not only for equal machine code."""
        return self.kernel.startswith(PORTABLE)

    def has_bits_of(self, present: Provenance) -> bool:
        """True if runs of both numerics are equal to the last bit."""
        return same_bits(self.kernel, present.kernel)


@cache
def present_provenance(space: Space = PLANAR) -> Provenance:
    """Returns the provenance of runs computed by this process.

    Args:
        space: Kind of hand; each kind has separate code.
    """
    return Provenance(program=program_version(), kernel=numerics_name(space))


@cache
def program_version() -> str:
    """Version of the installed program; ``0`` if it is not installed."""
    try:
        return metadata.version("slipgrasp")
    except metadata.PackageNotFoundError:
        return "0"
