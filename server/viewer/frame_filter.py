"""What of a viewer's frames reaches viser, which trusts them: known types, of a size."""

from __future__ import annotations

from typing import Any

import msgspec

KILOBYTE = 1 << 10
FRAME_BYTES = 64 * KILOBYTE
PART_BYTES = 600 * KILOBYTE
"""The page sends files in parts of 512 kB."""

MAX_TRANSFERS = 4
MAX_TRANSFER_BYTES = 16 << 20

START, PART = "FileTransferStartUpload", "FileTransferPart"
LIMITS = {
    "CommandTriggerMessage": FRAME_BYTES,
    START: FRAME_BYTES,
    PART: PART_BYTES,
    "GuiButtonHoldMessage": FRAME_BYTES,
    "GuiFormDirtyMessage": FRAME_BYTES,
    "GuiFormSubmitMessage": FRAME_BYTES,
    "GuiUpdateMessage": FRAME_BYTES,
    "LocalStorageGetItemResponseMessage": FRAME_BYTES,
    "SceneNodeClickMessage": FRAME_BYTES,
    "SceneNodeDragMessage": FRAME_BYTES,
    "ScenePointerMessage": FRAME_BYTES,
    "ShareUrlDisconnect": FRAME_BYTES,
    "ShareUrlRequest": FRAME_BYTES,
    "TransformControlsDragEndMessage": FRAME_BYTES,
    "TransformControlsDragStartMessage": FRAME_BYTES,
    "TransformControlsUpdateMessage": FRAME_BYTES,
    "ViewerCameraMessage": FRAME_BYTES,
}
"""What viser listens to, and how long it may be [bytes]."""


class FrameFilter:
    """Looks at the frames of one viewer; one that sends anything else is turned away."""

    def __init__(self) -> None:
        self._transfers: dict[str, int] = {}

    def find_fault(self, frame: bytes) -> str:
        """What is wrong with a frame; empty if it may pass."""
        if len(frame) > PART_BYTES:
            return "a message is too long"
        try:
            content: Any = msgspec.msgpack.decode(frame)
        except (msgspec.DecodeError, RecursionError, UnicodeDecodeError):
            return "a message cannot be read"
        kind = content.get("type") if isinstance(content, dict) else None
        limit = LIMITS.get(kind) if isinstance(kind, str) else None
        if limit is None:
            return "a message is of no kind that is listened to"
        if len(frame) > limit:
            return "a message is too long"
        return self._find_fault_of_transfer(content) if kind in (START, PART) else ""

    def _find_fault_of_transfer(self, content: dict[str, Any]) -> str:
        """Keeps count of the files on their way, which viser holds until they are whole."""
        transfer = content.get("transfer_uuid")
        if not isinstance(transfer, str):
            return "a message cannot be read"
        if content["type"] == START:
            size = content.get("size_bytes")
            if not isinstance(size, int) or size < 0 or transfer in self._transfers:
                return "a message cannot be read"
            on_the_way = sum(self._transfers.values()) + size
            if len(self._transfers) >= MAX_TRANSFERS or on_the_way > MAX_TRANSFER_BYTES:
                return "the files are too large"
            if size:
                self._transfers[transfer] = size
            return ""
        part = content.get("content")
        if transfer not in self._transfers or not isinstance(part, bytes) or not part:
            return "a message cannot be read"
        self._transfers[transfer] -= len(part)
        if self._transfers[transfer] < 0:
            return "the files are too large"
        if self._transfers[transfer] == 0:
            del self._transfers[transfer]
        return ""
