"""Downloads of files with entity tags, complete or in part (RFC 9110, sections 13, 14).

A file is opened before its response starts, so that it is sent completely even if it is deleted
meanwhile. Starlette's ``FileResponse`` opens it after the headers are sent, responds to malformed
ranges with 400, to several ranges with a multipart body, and to ranges beyond the end without a
problem document; here the first two get the whole file, as the standard allows.
"""

from __future__ import annotations

import re
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import TextIOWrapper
from os import SEEK_END
from typing import Any, BinaryIO, TextIO

from pydantic import BaseModel, Field
from starlette.concurrency import run_in_threadpool
from starlette.responses import Response, StreamingResponse
from starlette.types import Receive, Scope, Send

from slipgrasp.server.exceptions import printable
from slipgrasp.server.http.conditions import expected_revisions, is_known
from slipgrasp.server.http.errors import ProblemPublic, problem_response

PIECE_BYTES = 1 << 18
BINARY = "application/octet-stream"
CSV = "text/csv"
JSON = "application/json"
PARQUET = "application/vnd.apache.parquet"
PNG = "image/png"
SVG = "image/svg+xml"
_JSON_PART = {"schema": {"description": "Bytes of the document, which are not valid JSON alone"}}
BINARY_SCHEMA = {"type": "string", "format": "binary"}

_RANGE = re.compile(r"bytes *= *([0-9]*) *- *([0-9]*)", re.IGNORECASE)
_FAR_BEYOND_THE_END = 10**18


class DownloadRequest(BaseModel):
    """Conditions and range of a request, from headers of these names."""

    range: str | None = Field(
        default=None,
        description="range of bytes; one range only, otherwise the whole file is sent",
        examples=["bytes=0-1023"],
    )
    if_range: str | None = Field(
        default=None, description="send the range only if the `ETag` still matches"
    )
    if_match: str | None = Field(default=None, description="respond with 412 if the `ETag` differs")
    if_none_match: str | None = Field(
        default=None, description="respond with 304 if the `ETag` still matches"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Download:
    """A downloadable file.

    Attributes:
        tag: Strong entity tag, in quotes, which changes with any byte.
        name: Suggested file name.
        media_type: Media type.
        open: Opens or creates the file; called unless the tag decides the answer.
    """

    tag: str
    name: str
    media_type: str
    open: Callable[[], BinaryIO]

    def answer(self, asked: DownloadRequest) -> Response:
        """The file, a range of it, or an error; takes as long as `open`.

        Args:
            asked: Conditions and range of the request.

        Raises:
            SlipgraspError: Any error of `open`.
        """
        expected = expected_revisions(asked.if_match)
        if expected is not None and self.tag.strip('"') not in expected:
            detail = f"'{self.name}' has changed; its ETag is {self.tag}"
            return problem_response(412, detail, headers={"ETag": self.tag})
        if is_known(self.tag, asked.if_none_match):
            return Response(status_code=304, headers={"ETag": self.tag})
        file = self.open()
        size = file.seek(0, SEEK_END)
        is_same = asked.if_range is None or asked.if_range.strip() == self.tag
        part = _part(asked.range, size) if is_same else None
        if part is not None and not part:
            file.close()
            detail = f"Range is '{printable(asked.range or '')}', but the file has {size} bytes"
            return problem_response(416, detail, headers={"Content-Range": f"bytes */{size}"})
        headers = {
            "ETag": self.tag,
            "Accept-Ranges": "bytes",
            "Content-Disposition": f'attachment; filename="{self.name}"',
        }
        if part is not None:
            headers["Content-Range"] = f"bytes {part.start}-{part.stop - 1}/{size}"
        return _FileAnswer(
            file,
            range(size) if part is None else part,
            206 if part else 200,
            headers,
            self.media_type,
        )


class _FileAnswer(StreamingResponse):
    """Sends a range of bytes of an open file, and closes it in any case."""

    def __init__(
        self,
        file: BinaryIO,
        part: range,
        status: int,
        headers: dict[str, str],
        media_type: str,
    ) -> None:
        headers["Content-Length"] = str(len(part))
        super().__init__(_pieces(file, part), status, headers, media_type)
        self._file = file

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["method"] == "HEAD":
            self.body_iterator = _pieces(self._file, range(0))
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._file.close()


async def _pieces(file: BinaryIO, part: range) -> AsyncIterator[bytes]:
    await run_in_threadpool(file.seek, part.start)
    left = len(part)
    while left and (piece := await run_in_threadpool(file.read, min(left, PIECE_BYTES))):
        left -= len(piece)
        yield piece


def _part(asked: str | None, size: int) -> range | None:
    """The bytes of a ``Range``: None for all, empty if the file has none of them.

    Malformed and multiple ranges are ignored, as the standard allows.
    """
    found = _RANGE.fullmatch(asked.strip()) if asked else None
    if found is None or found[1] == found[2] == "":
        return None
    if not found[1]:
        return range(max(size - _position(found[2]), 0), size)
    first, last = _position(found[1]), _position(found[2]) if found[2] else size
    if found[2] and last < first:
        return None
    return range(first, min(last + 1, size))


def _position(digits: str) -> int:
    """Parses the number; numbers that are too long become one beyond the end of any file."""
    significant = digits.lstrip("0") or "0"
    return _FAR_BEYOND_THE_END if len(significant) > 18 else int(significant)


@contextmanager
def as_text(stream: BinaryIO) -> Iterator[TextIO]:
    """A context that converts text for a binary stream, which stays open."""
    text = TextIOWrapper(stream, encoding="utf-8", newline="")
    yield text
    text.detach()


def download_responses(
    *media_types: str, problems: tuple[int, ...] = (404,)
) -> dict[int | str, dict[str, Any]]:
    """Declares that a route responds with a download.

    Args:
        media_types: Possible media types.
        problems: Statuses of errors other than those of conditions and range.
    """
    content = {kind: {"schema": _schema_of(kind)} for kind in media_types}
    parts = {kind: _JSON_PART if kind == JSON else each for kind, each in content.items()}
    tag = {"ETag": {"description": "Tag of the file", "schema": {"type": "string"}}}
    return {
        200: {"description": "The file", "content": content, "headers": tag},
        206: {"description": "The range of `Range`", "content": parts, "headers": tag},
        304: {"description": "The client has it, according to `If-None-Match`"},
        **ProblemPublic.responses((*problems, 412, 416)),
    }


def _schema_of(media_type: str) -> dict[str, str]:
    """Schema of a whole file with a media type."""
    if media_type == JSON:
        return {"type": "object"}
    return {"type": "string"} if media_type.startswith("text/") else BINARY_SCHEMA
