"""Runs whose hashes must be the same on every machine; as a script, prints them as JSON."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator

from benchmarks.hands import holding_hand
from slipgrasp.core.run.simulator import prepare_kernel, simulate
from slipgrasp.core.scenario import CONTROL_LAWS, SPATIAL, Scenario
from slipgrasp.core.scenario.loading import load_scenario, preset_names, with_values
from slipgrasp.core.scenario.space import PLANAR, Space
from tests.core.drawn_hands_in_space import draw_hand_in_space
from tests.core.drawn_scenarios import KINDS, draw_scenario

LAWS, NOISE = "every control law", "noise, filters, latency"
FINGERS, RANDOM = "two to six fingers", "random scenarios"
NUM_RANDOM, NUM_RANDOM_IN_SPACE = 200, 50

_DURATION = {"simulation.duration": 1.0}
_SEEDS = 5
_DECIMALS = 9


def run_hash(scenario: Scenario) -> str:
    """Hash of the results of a run: rows, phase changes and outcome."""
    return simulate(scenario).sha256


def preset_hashes(*spaces: Space) -> dict[str, str]:
    """The hash of the run of every preset in some spaces."""
    names = (name for space in spaces for name in preset_names(space))
    return {name: run_hash(load_scenario(name)) for name in names}


def all_hashes(num_random: int = NUM_RANDOM) -> dict[str, str]:
    """The hashes of presets, and of groups of runs one for each group."""
    groups = {
        LAWS: _laws(),
        NOISE: _noisy(),
        FINGERS: _hands(),
        f"{num_random} {RANDOM}": _random(num_random),
    }
    return preset_hashes(PLANAR) | {name: _hash_of_all(runs) for name, runs in groups.items()}


def hashes_in_space(num_random: int = NUM_RANDOM_IN_SPACE) -> dict[str, str]:
    """The hashes of spatial hands, which no engine of WebAssembly runs."""
    drawn = (draw_hand_in_space(f"portable {k}") for k in range(num_random))
    name = f"{num_random} random spatial hands"
    return preset_hashes(SPATIAL) | {name: _hash_of_all(drawn)}


def _hash_of_all(scenarios: Iterable[Scenario]) -> str:
    digest = hashlib.sha256()
    for scenario in scenarios:
        digest.update(run_hash(scenario).encode())
    return digest.hexdigest()


def _laws() -> Iterator[Scenario]:
    """Each law with the hand that slips, continuous if possible."""
    for kind, law in CONTROL_LAWS.items():
        for period in (0.001,) if law.sampled else (0.0, 0.001):
            values = {"controller.kind": kind, "controller.control_period": period}
            yield with_values(load_scenario("composite-case-2"), values | _DURATION)


def _noisy() -> Iterator[Scenario]:
    """Each law in the noisy world, with other seeds."""
    for kind in CONTROL_LAWS:
        for seed in range(_SEEDS):
            values = {"controller.kind": kind, "simulation.seed": seed}
            yield with_values(load_scenario("composite-case-2-noisy"), values | _DURATION)


def _hands() -> Iterator[Scenario]:
    for n in range(2, 7):
        for period in (0.0, 0.001):
            yield with_values(holding_hand(n, period), _DURATION)


def _random(count: int) -> Iterator[Scenario]:
    for k in range(count):
        yield _rounded(draw_scenario(KINDS[k % len(KINDS)], f"portable {k}"))


def _rounded(scenario: Scenario) -> Scenario:
    """The same with bases rounded to 1 nm, because they were drawn with numpy's sine and cosine."""
    bases = {
        f"fingers.{i}.base": [round(x, _DECIMALS) for x in finger.base]
        for i, finger in enumerate(scenario.fingers)
    }
    return with_values(scenario, bases)


if __name__ == "__main__":
    prepare_kernel()
    print(json.dumps(all_hashes() | hashes_in_space()))
