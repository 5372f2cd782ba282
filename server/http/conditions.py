"""Requests that depend on what the client has seen (RFC 9110, section 13)."""

from __future__ import annotations

import re

from slipgrasp.recordings.store.stored_run import StoredRun

_TAG = re.compile(r'(W/)?"([^"]*)"')


def entity_tag(stored: StoredRun) -> str:
    """The ``ETag`` of what is told of a run."""
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
