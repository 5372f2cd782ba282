"""Parts of a page as text: compressed with zstd, in base 88, as in viser's page."""

from __future__ import annotations

import numpy as np
import zstandard

from slipgrasp.server.viewer.client_page import DIGITS, POWERS, words_of

_LEVEL = 19  # higher levels take longer and save less than 1 %


def pack(content: bytes) -> str:
    """Packs content; the scripts unpack it with ``unpack``."""
    packed = zstandard.ZstdCompressor(level=_LEVEL).compress(content)
    return encode(packed, len(content))


def encode(packed: bytes, size: int = 0) -> str:
    """Encodes bytes: five digits for each 32-bit word, after the sizes without and with packing."""
    words = np.array([size, len(packed)], "<u4").tobytes() + packed
    numbers = np.frombuffer(words + bytes(-len(words) % 4), "<u4")
    digits = numbers[:, None] // POWERS % len(DIGITS)
    return np.frombuffer(DIGITS, np.uint8)[digits].tobytes().decode()


def unpack(text: str) -> bytes:
    """Inverts `pack`."""
    words = words_of(text.encode()).astype("<u4").tobytes()
    _size, length = np.frombuffer(words[:8], "<u4").tolist()
    return zstandard.ZstdDecompressor().decompress(words[8 : 8 + length])
