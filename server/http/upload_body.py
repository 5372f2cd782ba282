"""The content of an uploaded file, in pieces: from the body or a form."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from enum import Enum, auto

from python_multipart import MultipartParser
from python_multipart.exceptions import FormParserError
from python_multipart.multipart import parse_options_header
from starlette.requests import ClientDisconnect, Request

from slipgrasp.server.exceptions import UnreadableBodyError, UnsupportedBodyError

FORM = "multipart/form-data"
RAW_TYPES = (
    "application/octet-stream",
    "application/x-mcap",
    "application/mcap",
    # The default content type of curl with --data-binary.
    "application/x-www-form-urlencoded",
    "",
)


async def file_pieces(request: Request) -> AsyncIterator[bytes]:
    """Yields the uploaded file in pieces; for a form, the first file.

    Raises:
        UnsupportedBodyError: If its content type is not a file.
        UnreadableBodyError: If it is an incomplete form, a form without a file, or incomplete.
    """
    declared = request.headers.get("content-type", "")
    content_type, options = parse_options_header(declared)
    pieces = _pieces(request)
    if content_type.decode("latin-1") == FORM:
        pieces = _first_file(pieces, options.get(b"boundary", b""))
    elif content_type.decode("latin-1").strip().lower() not in RAW_TYPES:
        raise UnsupportedBodyError(declared, f"application/octet-stream or {FORM}")
    async for piece in pieces:
        yield piece


async def _pieces(request: Request) -> AsyncIterator[bytes]:
    try:
        async for piece in request.stream():
            if piece:
                yield piece
    except ClientDisconnect as error:
        raise UnreadableBodyError("its sender has disconnected", "complete") from error


class _Place(Enum):
    BEFORE = auto()
    INSIDE = auto()
    BEHIND = auto()


class _FormFile:
    """Extracts the first part with a file name from a form."""

    def __init__(self, boundary: bytes) -> None:
        self._header_name = self._header_value = b""
        self._is_file = False
        self.place = _Place.BEFORE
        self.is_whole = False
        self.pieces: list[bytes] = []
        self._parser = MultipartParser(
            boundary,
            {
                "on_part_begin": self._begin_part,
                "on_header_field": self._take(self._add_name),
                "on_header_value": self._take(self._add_value),
                "on_header_end": self._end_header,
                "on_headers_finished": self._end_headers,
                "on_part_data": self._take(self._add_data),
                "on_part_end": self._end_part,
                "on_end": self._end,
            },
        )

    def write(self, piece: bytes) -> None:
        """Receives bytes of the form.

        Raises:
            FormParserError: If they are not from a valid form.
        """
        self._parser.write(piece)

    @staticmethod
    def _take(add: Callable[[bytes], None]) -> Callable[[bytes, int, int], None]:
        return lambda data, start, end: add(data[start:end])

    def _begin_part(self) -> None:
        self._is_file = False

    def _add_name(self, text: bytes) -> None:
        self._header_name += text

    def _add_value(self, text: bytes) -> None:
        self._header_value += text

    def _end_header(self) -> None:
        if self._header_name.lower() == b"content-disposition":
            _, options = parse_options_header(self._header_value)
            self._is_file = b"filename" in options
        self._header_name = self._header_value = b""

    def _end_headers(self) -> None:
        if self._is_file and self.place is _Place.BEFORE:
            self.place = _Place.INSIDE

    def _add_data(self, data: bytes) -> None:
        if self.place is _Place.INSIDE:
            self.pieces.append(data)

    def _end_part(self) -> None:
        if self.place is _Place.INSIDE:
            self.place = _Place.BEHIND

    def _end(self) -> None:
        self.is_whole = True


async def _first_file(pieces: AsyncIterator[bytes], boundary: bytes) -> AsyncIterator[bytes]:
    try:
        form = _FormFile(boundary)
        async for piece in pieces:
            form.write(piece)
            for data in form.pieces:
                yield data
            form.pieces.clear()
    except FormParserError as error:
        raise UnreadableBodyError(str(error)[:200], f"valid {FORM}") from error
    if not form.is_whole:
        raise UnreadableBodyError("its end is missing", f"valid {FORM}")
    if form.place is _Place.BEFORE:
        raise UnreadableBodyError("it has no file", f"valid {FORM}")
