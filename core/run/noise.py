"""The noise of the sensors: the same seed, the same noise, however a run is cut into pieces."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.sensing import NOISE_TICKS
from slipgrasp.core.scenario import Scenario


def provide_noise(run: Record, scenario: Scenario) -> None:
    """Lays out standard normal numbers for the coming ticks of sampled control.

    Block ``b`` of ticks is drawn from a generator seeded with ``(seed, b)``. It is numpy's
    `RandomState`, whose numbers never change from one version to the next.

    Args:
        run: Progress of the run in the kernel.
        scenario: Its seed and number of fingers.
    """
    senses = run["senses"]
    block, place = divmod(int(senses["num_ticks"]), NOISE_TICKS)
    if place and senses["noise_start"] == block * NOISE_TICKS:
        return
    channels = 3 * (3 + len(scenario.fingers))
    sequence = np.random.SeedSequence([scenario.simulation.seed, block])
    generator = np.random.RandomState(np.random.MT19937(sequence))
    senses["noise"][:, :channels] = generator.standard_normal((NOISE_TICKS, channels))
    senses["noise_start"] = block * NOISE_TICKS
