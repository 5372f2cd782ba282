"""The kernel behind its backends: native, and WebAssembly in wasmtime, chosen at run time."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.portable_runs import run_hash
from slipgrasp.core.kernel.compilation.compiler import entered_by
from slipgrasp.core.kernel.webassembly.build import kept_file
from slipgrasp.core.kernel.webassembly.foreign import Wasmtime
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import prepare_kernel, simulate
from slipgrasp.core.scenario.loading import (
    load_scenario,
    preset_names,
    with_values,
)
from slipgrasp.core.scenario.space import SPATIAL

pytestmark = [pytest.mark.slow, pytest.mark.other_code]

DURATION = 0.25  # [s]
PAPER = ("paper-case-1", "paper-case-2")
PRESETS = (*preset_names(), *preset_names(SPATIAL))


@pytest.fixture(scope="module")
def wasmtime() -> Wasmtime:
    prepare_kernel(space=SPATIAL)
    return Wasmtime(kept_file())


def shortened(name):
    """A preset, cut short unless something happens later."""
    scenario = load_scenario(name)
    late = scenario.changes or scenario.pulses or scenario.patches
    return scenario if late else with_values(scenario, {"simulation.duration": DURATION})


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_has_the_same_bits_in_wasmtime(name, wasmtime):
    native = run_hash(shortened(name))
    with entered_by(wasmtime.enter):
        assert run_hash(shortened(name)) == native


def test_runs_that_take_turns_keep_their_rows(wasmtime):
    scenarios = [with_values(load_scenario(name), {"simulation.duration": 7.0}) for name in PAPER]
    native = [simulate(scenario).sha256 for scenario in scenarios]
    with entered_by(wasmtime.enter):
        runs = [Simulation(scenario) for scenario in scenarios]
        while not all(run.finished for run in runs):
            for run in runs:
                run.advance()
    assert [run.result().sha256 for run in runs] == native


SHOW_HASH = """
from slipgrasp.core.kernel.webassembly import foreign
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
calls = []
perform = foreign.Wasmtime.perform
foreign.Wasmtime.perform = lambda self, symbol, *rest: (
    calls.append(symbol), perform(self, symbol, *rest))[1]
result = simulate(load_scenario("paper-case-1"))
assert "slipgrasp_advance" in calls
print(result.sha256)
"""


def in_webassembly(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "SLIPGRASP_KERNEL": "webassembly"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )


def test_an_environment_variable_chooses_webassembly():
    done = in_webassembly(SHOW_HASH)
    assert done.stdout.strip() == simulate(load_scenario("paper-case-1")).sha256, done.stderr


def test_a_custom_law_is_refused_where_it_cannot_be_called():
    code = "from slipgrasp.core.run.law_code import LawCode\nLawCode(None, None, (2, 0))"
    done = in_webassembly(code)
    assert "custom laws need the native kernel" in done.stderr
