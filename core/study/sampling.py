"""Samples of the unit cube, determined by a seed."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


@lru_cache(maxsize=4)
def unit_samples(method: str, count: int, dimension: int, seed: int) -> NDArray[np.float64]:
    """Returns samples of the unit cube.

    Args:
        method: ``random`` for independent samples, ``latin-hypercube`` for samples that are evenly
            spread along each coordinate.
        count: Number of samples.
        dimension: Number of coordinates.
        seed: Seed of the samples.

    Returns:
        The samples, shape ``(count, dimension)``, in [0, 1); read-only.
    """
    generator = np.random.default_rng(seed)
    if method == "latin-hypercube":
        from scipy.stats import qmc

        samples = qmc.LatinHypercube(dimension, rng=generator).random(count)
    else:
        samples = generator.random((count, dimension))
    samples.flags.writeable = False
    return samples
