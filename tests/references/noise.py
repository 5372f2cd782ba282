"""The noise of docs/model.md in NumPy and SciPy: Philox over all counters at once, and `ndtri`."""

import numpy as np
from scipy.special import ndtri

WORD = np.uint64(2**32 - 1)
HALF = np.uint64(32)


def philox(counters, key):
    """Philox 4x32-10 of counters ``(k, 4)`` under a key of two words; ``(k, 4)``."""
    words = np.array(counters, np.uint64)
    keys = np.array(key, np.uint64)
    for _ in range(10):
        first = words[:, 0] * np.uint64(0xD2511F53)
        third = words[:, 2] * np.uint64(0xCD9E8D57)
        words = np.stack(
            [
                (third >> HALF) ^ words[:, 1] ^ keys[0],
                third & WORD,
                (first >> HALF) ^ words[:, 3] ^ keys[1],
                first & WORD,
            ],
            axis=1,
        )
        keys = (keys + np.array([0x9E3779B9, 0xBB67AE85], np.uint64)) & WORD
    return words


def normal_numbers(seed, ticks, channels, stream=0):
    """Standard normal numbers of the ticks in a stream, ``(ticks, channels)``."""
    ticks = np.arange(ticks) if isinstance(ticks, int) else np.asarray(ticks)
    pairs = -(-channels // 2)
    counters = np.zeros((len(ticks), pairs, 4), np.uint64)
    counters[..., 0], counters[..., 1] = np.arange(pairs), stream
    counters[..., 2], counters[..., 3] = ticks[:, None] & 0xFFFFFFFF, ticks[:, None] >> 32
    words = philox(counters.reshape(-1, 4), (seed & 0xFFFFFFFF, seed >> 32))
    bits = (words[:, ::2] << np.uint64(20)) | (words[:, 1::2] >> np.uint64(12))
    return ndtri((bits + 0.5) / 2.0**52).reshape(len(ticks), 2 * pairs)[:, :channels]
