"""Samples of the unit cube: the same for the same seed."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


@lru_cache(maxsize=4)
def unit_samples(method: str, count: int, dimension: int, seed: int) -> NDArray[np.float64]:
    """Samples of the unit cube.

    Args:
        method: ``random`` for independent samples, ``latin-hypercube`` for samples of which
            each coordinate alone is spread evenly.
        count: How many.
        dimension: Coordinates of each.
        seed: What decides them.

    Returns:
        The samples, shape ``(count, dimension)``, from 0 to below 1; not to be changed.
    """
    generator = np.random.default_rng(seed)
    if method == "latin-hypercube":
        from scipy.stats import qmc

        samples = qmc.LatinHypercube(dimension, rng=generator).random(count)
    else:
        samples = generator.random((count, dimension))
    samples.flags.writeable = False
    return samples
