"""Versions that every recording carries: of the file format and of the program."""

from __future__ import annotations

from functools import cache
from importlib import metadata

__all__ = ["FORMAT_VERSION", "program_version"]

FORMAT_VERSION = 1
"""Raised when a reader of the previous version could no longer read a file correctly."""


@cache
def program_version() -> str:
    """Version of the installed program; ``0`` where it runs without being installed."""
    try:
        return metadata.version("slipgrasp")
    except metadata.PackageNotFoundError:
        return "0"
