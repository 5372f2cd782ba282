"""The bits of runs: those of the table in docs/portability.md, on every machine."""

from pathlib import Path

import pytest

from benchmarks.portable_runs import run_hash
from benchmarks.preset_hashes import read_presets
from slipgrasp.core.scenario.loading import load_scenario, preset_names
from slipgrasp.core.scenario.space import RAIL, SUPPORT

PAGE = Path(__file__).parents[2] / "docs" / "portability.md"
KEPT = read_presets(PAGE)

CHANGED = """the run of preset {name} has other bits than docs/portability.md says.

Either this machine computes what no other does, which is a fault; or the numerics have changed:
then recordings and studies that older versions have made are still read, but do not verify any
more, and their rows cannot be rebuilt bit for bit. If that is meant, say so in CHANGELOG.md, and
write the new table with

    python -m benchmarks preset-hashes --docs docs
"""


NAMES = (*preset_names(), *preset_names(SUPPORT), *preset_names(RAIL))


@pytest.mark.parametrize("name", NAMES)
def test_the_run_of_a_preset_has_the_bits_that_the_documentation_says(name):
    assert run_hash(load_scenario(name)) == KEPT[name], CHANGED.format(name=name)


def test_the_table_has_the_presets_and_no_others():
    assert set(KEPT) == set(NAMES)
