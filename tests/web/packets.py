"""Packets for close-ups, read as the page reads them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np


def unpacked(packet: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The facts and arrays of a packet, as the page reads them."""
    length = int(np.frombuffer(packet, np.uint64, 1)[0])
    facts, offset = json.loads(packet[8 : 8 + length]), 8 + -(-length // 8) * 8
    arrays = {}
    for name, kind, shape in facts["arrays"]:
        array = np.frombuffer(packet, f"<{kind}", int(np.prod(shape)), offset)
        arrays[name] = array.reshape(shape)
        offset += -(-array.nbytes // 8) * 8
    return facts, arrays
