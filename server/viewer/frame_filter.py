"""Filter of the frames from viewers: only known messages of limited size reach viser."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Union

import msgspec

from slipgrasp.server.viewer.messages import MESSAGES, FileTransferPart, FileTransferStartUpload

KILOBYTE = 1 << 10
FRAME_BYTES = 64 * KILOBYTE
PART_BYTES = 600 * KILOBYTE
"""The page sends files in parts of 512 kB."""

MAX_TRANSFERS = 4
MAX_TRANSFER_BYTES = 16 << 20
MAX_PARTS = 1 + MAX_TRANSFER_BYTES // (512 * KILOBYTE)

_UNREADABLE = "a message cannot be read"
_TOO_LARGE = "the files are too large"

_decoder = msgspec.msgpack.Decoder(Union[MESSAGES])  # noqa: UP007


@dataclass(slots=True)
class _Transfer:
    """The missing part of a file: bytes, and numbers of its parts."""

    num_bytes: int
    parts: set[int] = field(default_factory=set)


class FrameFilter:
    """Checks the frames of one viewer, which is disconnected after an invalid one."""

    def __init__(self) -> None:
        self._transfers: dict[str, _Transfer] = {}

    def find_fault(self, frame: bytes) -> str:
        """Describes the defect of a frame; empty if it is valid."""
        if len(frame) > PART_BYTES:
            return "a message is too long"
        try:
            message = _decoder.decode(frame)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
            return _UNREADABLE
        if isinstance(message, FileTransferPart):
            return self._find_fault_of_part(message)
        if len(frame) > FRAME_BYTES:
            return "a message is too long"
        if isinstance(message, FileTransferStartUpload):
            return self._find_fault_of_start(message)
        return ""

    def _find_fault_of_start(self, start: FileTransferStartUpload) -> str:
        """Tracks unfinished files, which viser keeps in memory until they are complete."""
        if start.transfer_uuid in self._transfers or (start.size_bytes > 0) != (
            start.part_count > 0
        ):
            return _UNREADABLE
        on_the_way = start.size_bytes + sum(t.num_bytes for t in self._transfers.values())
        if (
            len(self._transfers) >= MAX_TRANSFERS
            or start.part_count > MAX_PARTS
            or on_the_way > MAX_TRANSFER_BYTES
        ):
            return _TOO_LARGE
        if start.size_bytes:
            parts = set(range(start.part_count))
            self._transfers[start.transfer_uuid] = _Transfer(start.size_bytes, parts)
        return ""

    def _find_fault_of_part(self, part: FileTransferPart) -> str:
        transfer = self._transfers.get(part.transfer_uuid)
        if transfer is None or part.part_index not in transfer.parts or not part.content:
            return _UNREADABLE
        transfer.parts.remove(part.part_index)
        transfer.num_bytes -= len(part.content)
        if transfer.num_bytes < 0:
            return _TOO_LARGE
        if not transfer.parts:
            del self._transfers[part.transfer_uuid]
            # viser would log a warning with the name of each such file.
            return _UNREADABLE if transfer.num_bytes else ""
        return ""
