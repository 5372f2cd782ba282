"""Requests that depend on what the client has seen (RFC 9110, section 13)."""

from __future__ import annotations

import re
from hashlib import blake2b
from pathlib import Path

from slipgrasp.recordings.store.stored_run import StoredRun

_TAG = re.compile(r'(W/)?"([^"]*)"')


def tag_of(*facts: object) -> str:
    """A strong entity tag for what these facts decide to the last byte."""
    return f'"{blake2b(repr(facts).encode(), digest_size=12).hexdigest()}"'


def file_tag(path: Path) -> str:
    """The entity tag of a file that is never written in place, only replaced.

    Raises:
        FileNotFoundError: If there is none.
    """
    status = path.stat()
    return tag_of(status.st_size, status.st_mtime_ns, status.st_ino)


def entity_tag(stored: StoredRun) -> str:
    """The ``ETag`` of the description of a run."""
    return f'"{stored.revision}"'


def expected_revisions(if_match: str | None) -> frozenset[str] | None:
    """The revisions that a change is made for.

    Args:
        if_match: Value of the header ``If-Match``.

    Returns:
        None if it is made for any.
    """
    if if_match is None or if_match.strip() == "*":
        return None
    return frozenset(revision for weak, revision in _TAG.findall(if_match) if not weak)


def is_known(tag: str, if_none_match: str | None) -> bool:
    """Whether the client has what it asks for.

    Args:
        tag: ``ETag`` of what there is.
        if_none_match: Value of the header ``If-None-Match``.
    """
    if if_none_match is None:
        return False
    known = {f'"{opaque}"' for _, opaque in _TAG.findall(if_none_match)}
    return if_none_match.strip() == "*" or tag.removeprefix("W/") in known
