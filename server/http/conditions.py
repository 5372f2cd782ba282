"""Conditional requests (RFC 9110, section 13)."""

from __future__ import annotations

import re
from hashlib import blake2b
from pathlib import Path

from slipgrasp.recordings.store.stored_run import StoredRun

_TAG = re.compile(r'(W/)?"([^"]*)"')


def tag_of(*facts: object) -> str:
    """A strong entity tag from facts that determine every byte."""
    return f'"{blake2b(repr(facts).encode(), digest_size=12).hexdigest()}"'


def file_tag(path: Path) -> str:
    """The entity tag of a file that is never modified in place, only replaced.

    Raises:
        FileNotFoundError: If the file does not exist.
    """
    status = path.stat()
    return tag_of(status.st_size, status.st_mtime_ns, status.st_ino)


def entity_tag(stored: StoredRun) -> str:
    """The ``ETag`` of the description of a run."""
    return f'"{stored.revision}"'


def expected_revisions(if_match: str | None) -> frozenset[str] | None:
    """Revisions for which a change is allowed.

    Args:
        if_match: Value of the header ``If-Match``.

    Returns:
        None if any revision is allowed.
    """
    if if_match is None or if_match.strip() == "*":
        return None
    return frozenset(revision for weak, revision in _TAG.findall(if_match) if not weak)


def is_known(tag: str, if_none_match: str | None) -> bool:
    """Whether the client already has the current version.

    Args:
        tag: Current ``ETag``.
        if_none_match: Value of the header ``If-None-Match``.
    """
    if if_none_match is None:
        return False
    known = {f'"{opaque}"' for _, opaque in _TAG.findall(if_none_match)}
    return if_none_match.strip() == "*" or tag.removeprefix("W/") in known
