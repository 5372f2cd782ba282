"""Normal numbers from a seed: Random123's known answers, another implementation, statistics."""

import numba
import numpy as np
import pytest
from scipy import stats

from slipgrasp.core.kernel.compilation.compiler import OPTIONS, call
from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.numerics import noise
from tests.references.noise import normal_numbers

# Of Random123's file kat_vectors: counter, key and result.
ANSWERS = [
    (
        "00000000 00000000 00000000 00000000",
        "00000000 00000000",
        "6627e8d5 e169c58d bc57ac4c 9b00dbd8",
    ),
    (
        "ffffffff ffffffff ffffffff ffffffff",
        "ffffffff ffffffff",
        "408f276d 41c83b0e a20bc7c6 6d5451fd",
    ),
    (
        "243f6a88 85a308d3 13198a2e 03707344",
        "a4093822 299f31d0",
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
]
CHANNELS = 16


@numba.njit(**OPTIONS)
def philox(counter, key):
    return noise.philox(counter, key)


def words(text):
    return tuple(int(word, 16) for word in text.split())


def drawn(seed, ticks, channels=CHANNELS):
    room, numbers = make_record(noise.NOISE), []
    for tick in ticks:
        call(noise.draw_noise, room, seed, noise.STATE_NOISE, tick, channels)
        numbers.append(room.numbers[:channels].copy())
    return np.array(numbers)


@pytest.fixture(scope="module")
def sample():
    """480 000 numbers, as many as ten minutes of five coordinates."""
    return drawn(3, range(30_000))


@pytest.mark.parametrize(("counter", "key", "answer"), ANSWERS)
def test_philox_gives_the_known_answers(counter, key, answer):
    assert philox(words(counter), words(key)) == words(answer)


@pytest.mark.parametrize("seed", [0, 2**31 - 1, 2**45 + 7])
def test_the_numbers_are_those_of_another_implementation(seed):
    ticks = [0, 1, 2, 600_000, 2**32 + 5]
    for channels in (15, CHANNELS):
        expected = normal_numbers(seed, ticks, channels)
        np.testing.assert_allclose(drawn(seed, ticks, channels), expected, rtol=2e-14)


def test_any_tick_has_its_noise_in_any_order(sample):
    np.testing.assert_array_equal(drawn(3, [77, 5, 29_999]), sample[[77, 5, 29_999]])


def test_the_numbers_are_normal(sample):
    numbers = sample.ravel()
    assert stats.kstest(numbers, "norm").pvalue > 1e-3
    assert abs(numbers.mean()) * np.sqrt(numbers.size) < 3.5
    assert abs(numbers.var() - 1.0) * np.sqrt(numbers.size / 2.0) < 3.5
    assert abs(stats.skew(numbers)) * np.sqrt(numbers.size / 6.0) < 3.5
    assert abs(stats.kurtosis(numbers)) * np.sqrt(numbers.size / 24.0) < 3.5
    beyond = np.sum(np.abs(numbers) > 4.0)
    assert stats.binomtest(int(beyond), numbers.size, 2.0 * stats.norm.sf(4.0)).pvalue > 1e-3


def test_ticks_channels_and_seeds_are_independent(sample):
    other = drawn(4, range(len(sample)))
    bound = 4.5 / np.sqrt(len(sample))
    for lag in range(1, 20):
        assert np.abs((sample[lag:] * sample[:-lag]).mean(axis=0)).max() < bound
    between = sample.T @ sample / len(sample) - np.eye(CHANNELS)
    assert np.abs(between - np.diag(np.diag(between))).max() < bound
    assert np.abs((sample * other).mean(axis=0)).max() < bound
