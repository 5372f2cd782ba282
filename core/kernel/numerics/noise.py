"""Standard normal random numbers from a seed, for any tick independently, in any order.

Salmon, Moraes, Dror, Shaw, *Parallel random numbers: as easy as 1, 2, 3*, SC11 (2011): Philox
4x32-10 maps a counter and a key to four words of 32 bits without a state. Two words give one
uniform number, which the quantile function maps to one normal number, so that every normal number
has a fixed position in the counter.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_COORDINATES, Record
from slipgrasp.core.kernel.numerics.elementary import inverse_normal

MAX_CHANNELS = 3 * MAX_COORDINATES
ROUNDS = 10

# Noise of all measurements at one tick.
NOISE = np.dtype([("numbers", np.float64, (MAX_CHANNELS + 1,))], align=True)

Words: TypeAlias = tuple[int, int, int, int]

_WORD = (1 << 32) - 1
_MULTIPLIERS = (0xD2511F53, 0xCD9E8D57)
_KEY_STEPS = (0x9E3779B9, 0xBB67AE85)


STATE_NOISE, FORCE_NOISE, DELAY_NOISE = range(3)
"""Purposes of numbers, each with a separate stream."""


@compiled_apart(types.void, NOISE, types.int64, types.int64, types.int64, types.int64)
def draw_noise(noise: Record, seed: int, stream: int, tick: int, count: int) -> None:
    """Writes the first ``count`` random numbers of a tick.

    Args:
        noise: Output.
        seed: Seed of the run, below 2^63.
        stream: Purpose.
        tick: Index of the tick in the run, from 0.
        count: Number of values; if it is odd, one more is written.
    """
    key = seed & _WORD, seed >> 32
    for pair in range((count + 1) // 2):
        words = philox((pair, stream, tick & _WORD, tick >> 32), key)
        noise.numbers[2 * pair] = _normal(words[0], words[1])
        noise.numbers[2 * pair + 1] = _normal(words[2], words[3])


@compiled_apart(types.float64, types.int64, types.int64, types.int64, types.int64)
def draw_number(seed: int, stream: int, place: int, event: int) -> float:
    """Random number of one event at one index, such as a contact."""
    counter = place, stream, event & _WORD, event >> 32
    words = philox(counter, (seed & _WORD, seed >> 32))
    return _normal(words[0], words[1])


@compiled
def philox(counter: Words, key: tuple[int, int]) -> Words:
    """Philox 4x32-10: four 32-bit words from a counter and a key of such words."""
    a, b, c, d = counter
    first, second = key
    for _ in range(ROUNDS):
        high_a, low_a = _wide_product(_MULTIPLIERS[0], a)
        high_c, low_c = _wide_product(_MULTIPLIERS[1], c)
        a, b, c, d = high_c ^ b ^ first, low_c, high_a ^ d ^ second, low_a
        first, second = (first + _KEY_STEPS[0]) & _WORD, (second + _KEY_STEPS[1]) & _WORD
    return a, b, c, d


@compiled
def _wide_product(x: int, y: int) -> tuple[int, int]:
    """Upper and lower word of the product of two words; the product may use the sign bit."""
    product = x * y
    return (product >> 32) & _WORD, product & _WORD


@compiled
def _normal(high: int, low: int) -> float:
    """Normal number from 52 bits of two words; adding 0.5 keeps the uniform number off 0 and 1."""
    uniform = (float((high << 20) | (low >> 12)) + 0.5) * 2.0**-52
    return inverse_normal(uniform)
