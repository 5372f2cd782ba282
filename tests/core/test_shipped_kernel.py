"""Runs start on the WebAssembly of a wheel, and go over to machine code when it is compiled."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from slipgrasp.core.kernel.compilation.cache import code_path
from slipgrasp.core.kernel.compilation.compiler import all_units, kept_code, prepare_units
from slipgrasp.core.kernel.webassembly.build import kept_file
from slipgrasp.core.kernel.webassembly.shipped import sources_digest
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from tests.waiting import wait_until

pytestmark = [pytest.mark.slow, pytest.mark.other_code]

LAW = Path(__file__).parents[2] / "examples" / "laws" / "pd_gravity.py"
BEGIN = """
import json, sys, time
from pathlib import Path
from slipgrasp.core.kernel.webassembly import shipped
shipped.FOLDER = Path(sys.argv[1])
from slipgrasp.core.kernel.compilation.compiler import all_units, kept_code
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import kernel_is_cached, simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values

def native():
    return sum(unit.is_native for unit in all_units())
"""
GO_OVER = """
assert kernel_is_cached() and not kernel_is_cached(machine_code=True)
simulation = Simulation(load_scenario("composite-case-2-noisy"))  # of several parts
simulation.advance()
before = native()
while native() < len(all_units()):
    time.sleep(0.05)
assert not simulation.finished
while not simulation.finished:
    simulation.advance()
print(json.dumps([before, simulation.result().sha256]))
"""
OUTLIVE = """
print(json.dumps([native(), simulate(load_scenario("paper-case-1")).sha256]))
"""
CUSTOM_LAW = """
from slipgrasp.core.scenario.law_loading import load_law
before = len(kept_code())
short = {"controller.kind": load_law(sys.argv[2]).identity.name, "simulation.duration": 0.01}
simulate(with_values(load_scenario("composite-case-2"), short))
print(json.dumps([before < len(all_units()), native() == len(all_units())]))
"""


def code_without():
    """Names of machine code that planar hands need, and that is missing at first."""
    planar = [unit for unit in all_units() if ".kernel.planar." in unit.function.__module__]
    return {code_path(unit.name).name for unit in planar[:3]}


@pytest.fixture
def started(tmp_path):
    """Runs a program with the kernel of a wheel and an incomplete cache."""
    prepare_units()
    kernels, kernel = tmp_path / "kernels", tmp_path / "cache" / "kernel"
    kernels.mkdir()
    kernel.mkdir(parents=True)
    shutil.copy(kept_file(), kernels / f"{sources_digest()}.wasm")
    for path in kept_code():
        if path.name not in code_without():
            shutil.copy(path, kernel)

    def start(program, *arguments):
        done = subprocess.run(
            [sys.executable, "-c", BEGIN + program, str(kernels), *arguments],
            env={**os.environ, "SLIPGRASP_CACHE": str(tmp_path / "cache")},
            cwd=Path(__file__).parents[2],
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return start


def test_a_run_goes_over_to_machine_code_in_the_middle_with_the_same_bits(started):
    assert started(GO_OVER) == [0, simulate(load_scenario("composite-case-2-noisy")).sha256]


def test_a_program_that_ends_soon_leaves_the_machine_code_to_the_next_one(started, tmp_path):
    assert started(OUTLIVE) == [0, simulate(load_scenario("paper-case-1")).sha256]
    kept = tmp_path / "cache" / "kernel"
    wait_until(lambda: all((kept / name).exists() for name in code_without()), "nothing compiles")


def test_a_custom_law_waits_for_machine_code(started):
    assert started(CUSTOM_LAW, f"{LAW}:PdGravity") == [True, True]
