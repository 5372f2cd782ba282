"""Files that do not change while the server runs: compressed once, with conditional requests."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from functools import cached_property

from fastapi import Request, Response

from slipgrasp.server.http.conditions import is_known, tag_of


class PageFile:
    """A file of a page.

    Args:
        content: Content.
        media_type: Media type.
        headers: Additional headers.
    """

    def __init__(
        self, content: bytes, media_type: str, headers: Mapping[str, str] | None = None
    ) -> None:
        self._content, self._media_type = content, media_type
        self._headers = {
            **(headers or {}),
            "Cache-Control": "no-cache",
            "ETag": tag_of(content),
            "Vary": "Accept-Encoding",
        }

    @cached_property
    def _compressed(self) -> bytes:
        return gzip.compress(self._content, mtime=0)

    def answer(self, request: Request) -> Response:
        """The file, compressed if the client accepts that; 304 if the client has it."""
        if is_known(self._headers["ETag"], request.headers.get("if-none-match")):
            return Response(status_code=304, headers=self._headers)
        if "gzip" not in request.headers.get("accept-encoding", ""):
            return Response(self._content, media_type=self._media_type, headers=self._headers)
        headers = {**self._headers, "Content-Encoding": "gzip"}
        return Response(self._compressed, media_type=self._media_type, headers=headers)
