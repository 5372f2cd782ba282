"""Version of the file format that every recording carries."""

from __future__ import annotations

__all__ = ["FORMAT_VERSION"]

FORMAT_VERSION = 2
"""Raised when a reader of the previous version could no longer read a file correctly."""
