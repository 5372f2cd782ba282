"""Parts of a page as text: compressed with zstd, in base 88, as in viser's page."""

from __future__ import annotations

import gzip
import re
from functools import cache
from typing import NamedTuple

import numpy as np
import zstandard

from slipgrasp.core.exceptions import SlipgraspError

_DIGITS = (
    b"!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
)
_BASE = len(_DIGITS)
_POWERS = _BASE ** np.arange(4, -1, -1)
_LEVEL = 19  # higher levels take longer and save less than 1 %

_SCRIPT = re.compile(
    rb'<script data-p="(?P<code>[^"]*)" data-ss="(?P<style>\d+)" data-cs="\d+".*?'
    rb'gzWasm="(?P<decoder>[^"]*)".*?</script>',
    re.DOTALL,
)
_CHANGES = (
    # Without the environment map that the first message turns off: 40 kB, and two shaders.
    (re.compile(rb"`data:image/jpeg;base64,[\w+/=]{1000,}`"), b"null"),
    # Without the lights that it turns off: the first pictures would have shadows.
    (re.compile(rb"enableDefaultLights:!0"), b"enableDefaultLights:!1"),
)


class PackingError(SlipgraspError):
    """A version of viser whose page is packed in another way."""


class Viewer(NamedTuple):
    """The page of viser.

    Attributes:
        page: HTML without the code.
        style: CSS.
        code: JavaScript module, without what pages do not use.
        decoder: WebAssembly module that decompresses.
    """

    page: bytes
    style: bytes
    code: bytes
    decoder: bytes


def pack(content: bytes) -> str:
    """Packs content; the scripts unpack it with ``unpack``."""
    packed = zstandard.ZstdCompressor(level=_LEVEL).compress(content)
    return encode(packed, len(content))


def encode(packed: bytes, size: int = 0) -> str:
    """Encodes bytes: five digits for each 32-bit word, after the sizes without and with packing."""
    words = np.array([size, len(packed)], "<u4").tobytes() + packed
    numbers = np.frombuffer(words + bytes(-len(words) % 4), "<u4")
    digits = numbers[:, None] // _POWERS % _BASE
    return np.frombuffer(_DIGITS, np.uint8)[digits].tobytes().decode()


def unpack(text: str) -> bytes:
    """Inverts `pack`."""
    words = _words(text.encode()).astype("<u4").tobytes()
    _size, length = np.frombuffer(words[:8], "<u4").tolist()
    return zstandard.ZstdDecompressor().decompress(words[8 : 8 + length])


@cache
def unpack_viewer(page: bytes) -> Viewer:
    """Takes viser's page apart.

    Raises:
        PackingError: If this version of viser packs its page in another way.
    """
    found = _SCRIPT.search(page)
    if found is None:
        raise PackingError("pages cannot be written with this version of viser: use 1.1.1")
    content = zstandard.ZstdDecompressor().decompress(_decode(found["code"]))
    style, code = content[: int(found["style"])], content[int(found["style"]) :]
    for pattern, replacement in _CHANGES:
        code = pattern.sub(replacement, code)
    decoder = _decode(found["decoder"].replace(rb"\\", b"\\"))
    return Viewer(_SCRIPT.sub(b"", page), style, code, gzip.decompress(decoder))


def _words(digits: bytes) -> np.ndarray:
    values = np.zeros(256, np.int64)
    values[np.frombuffer(_DIGITS, np.uint8)] = np.arange(_BASE)
    return values[np.frombuffer(digits, np.uint8)].reshape(-1, 5) @ _POWERS


def _decode(digits: bytes) -> bytes:
    """Bytes of viser's page: big-endian words, the last one possibly shorter by some bytes."""
    missing = -len(digits) % 5
    if not missing:
        return _words(digits).astype(">u4").tobytes()
    whole = _words(digits[: missing - 5]).astype(">u4").tobytes()
    (last,) = _words(digits[missing - 5 :].rjust(5, _DIGITS[:1])).tolist()
    return whole + last.to_bytes(4 - missing, "big")
