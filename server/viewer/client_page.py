"""The page of viser, divided into separate files.

viser packs its page into one file, whose script unpacks the rest at each load. With separate files,
a browser compiles the script while it arrives, caches the result, and requests only changed files.
"""

from __future__ import annotations

import gzip
import re
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np
import zstandard

from slipgrasp.core.exceptions import SlipgraspError

DIGITS = (
    b"!#$%()*+,-./0123456789:;=?@ABCDEFGHIJKLMNOPQRSTUVWXYZ[\\]^_abcdefghijklmnopqrstuvwxyz{|}~"
)
"""Digits of base 88, in which the page holds binary data."""
POWERS = len(DIGITS) ** np.arange(4, -1, -1)
"""Place values of the five digits of a 32-bit word."""

_HEAD, _END_OF_HEAD = b"<head>", b"</head>"
_NAME_AND_ICON = re.compile(rb"<title>.*?</title>|<link\s[^>]*rel=\"icon\"[^>]*>", re.DOTALL)
_SCRIPT = re.compile(
    rb'<script data-p="(?P<code>[^"]*)" data-ss="(?P<style>\d+)" data-cs="\d+".*?'
    rb'gzWasm="(?P<decoder>[^"]*)".*?</script>',
    re.DOTALL,
)
_CHANGES = (
    # Removes the environment map, which the first message turns off anyway; saves 40 kB and two
    # shaders.
    (re.compile(rb"`data:image/jpeg;base64,[\w+/=]{1000,}`"), b"null"),
    # Removes the lights, which it turns off too: else the first pictures would have shadows.
    (re.compile(rb"enableDefaultLights:!0"), b"enableDefaultLights:!1"),
    # Hides the plane of the background image, whose shader passes over every pixel of a picture.
    (
        re.compile(rb"\{(ref:\w+,material:\w+,children:\(0,\w+\.jsx\)\(`planeGeometry`)"),
        rb"{visible:!1,\1",
    ),
    # It would draw for a quarter of a second after each change, and would not respond meanwhile if
    # rendering is slow, as without a graphics card. One picture is enough, and one later for what
    # React draws late.
    (
        re.compile(rb"performance\.now\(\)<(\w+)\.current&&(\w+)\(\)\}\)"),
        rb"clearTimeout(\1.late);\1.seen!==\1.current&&"
        rb"(\1.late=setTimeout(()=>{\1.seen=\1.current;\2()},60))})",
    ),
    # The arrow to the mouse while something is dragged: grey and slender. It would be orange, which
    # is the colour of slip, with a head as large as the object.
    (re.compile(rb"16747586,.18,.09"), b"7829367,.04,.02"),
    (re.compile(rb"Math.min\(.18,"), b"Math.min(.04,"),
    (re.compile(rb"Math.min\(.09,"), b"Math.min(.02,"),
)


class PackingError(SlipgraspError):
    """A version of viser whose page is packed differently."""


class ClientPage(NamedTuple):
    """The page of viser.

    Attributes:
        page: HTML without the code.
        style: CSS.
        code: JavaScript module, without what our pages do not use.
        decoder: WebAssembly module that decompresses messages.
    """

    page: bytes
    style: bytes
    code: bytes
    decoder: bytes


def packed_page() -> bytes:
    """The page as shipped with viser, found without importing viser, which takes seconds."""
    spec = find_spec("viser")
    assert spec is not None and spec.origin is not None
    return (Path(spec.origin).parent / "client" / "build" / "index.html").read_bytes()


@cache
def unpack_page(page: bytes) -> ClientPage:
    """Takes viser's page apart.

    Raises:
        PackingError: If this version of viser packs its page differently.
    """
    found = _SCRIPT.search(page)
    if found is None:
        raise PackingError("this version of viser packs its page differently; use viser 1.1.1")
    content = zstandard.ZstdDecompressor().decompress(_decode(found["code"]))
    style, code = content[: int(found["style"])], content[int(found["style"]) :]
    for pattern, replacement in _CHANGES:
        code = pattern.sub(replacement, code)
    decoder = _decode(found["decoder"].replace(rb"\\", b"\\"))
    return ClientPage(_SCRIPT.sub(b"", page), style, code, gzip.decompress(decoder))


def with_head(page: bytes, head: str) -> bytes:
    """Inserts HTML at the start of the head of the page, in place of viser's title and icon.

    Does nothing if `head` is empty.

    Raises:
        RuntimeError: If the page does not have exactly one head.
    """
    if page.count(_HEAD) != 1:
        raise RuntimeError("expected exactly one <head> in viser's page")
    if not head:
        return page
    return _NAME_AND_ICON.sub(b"", page).replace(_HEAD, _HEAD + head.encode())


def with_end_of_head(page: bytes, html: str) -> bytes:
    """Inserts HTML at the end of the head of the page."""
    return page.replace(_END_OF_HEAD, html.encode() + _END_OF_HEAD)


def words_of(digits: bytes) -> np.ndarray:
    """The 32-bit words that groups of five digits encode."""
    values = np.zeros(256, np.int64)
    values[np.frombuffer(DIGITS, np.uint8)] = np.arange(len(DIGITS))
    return values[np.frombuffer(digits, np.uint8)].reshape(-1, 5) @ POWERS


def _decode(digits: bytes) -> bytes:
    """Bytes of viser's page: big-endian words, the last one possibly shorter by some bytes."""
    missing = -len(digits) % 5
    if not missing:
        return words_of(digits).astype(">u4").tobytes()
    whole = words_of(digits[: missing - 5]).astype(">u4").tobytes()
    (last,) = words_of(digits[missing - 5 :].rjust(5, DIGITS[:1])).tolist()
    return whole + last.to_bytes(4 - missing, "big")
