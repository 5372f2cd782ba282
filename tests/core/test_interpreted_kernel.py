"""The kernel as Python runs it, for a debugger or a coverage report: the same physics."""

import os
import subprocess
import sys

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values

pytestmark = [pytest.mark.slow, pytest.mark.other_code]

RUN = """
import sys
import numba.core.compiler

def refuse(*arguments, **options):
    raise AssertionError("something is compiled")

numba.core.compiler.compile_extra = refuse

import numpy as np
from slipgrasp.core.run.simulator import kernel_is_cached, prepare_kernel, simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values

prepare_kernel()
assert kernel_is_cached()
preset, duration, path = sys.argv[1:]
scenario = with_values(load_scenario(preset), {"simulation.duration": float(duration)})
result = simulate(scenario)
np.savez(path, rows=result.trace.to_rows(), kernel=result.provenance.kernel)
"""


@pytest.mark.parametrize(
    ("preset", "duration"),
    [
        ("paper-case-1", 0.05),  # continuous control
        ("composite-case-2-noisy", 0.02),  # sampled control, noise and recursive least squares
        ("three-fingers", 0.02),  # the grasp force as a quadratic program
    ],
)
def test_python_and_machine_code_give_the_same_run_bit_for_bit(preset, duration, tmp_path):
    path = tmp_path / "run.npz"
    environment = {**os.environ, "SLIPGRASP_KERNEL": "python"}
    command = [sys.executable, "-c", RUN, preset, str(duration), str(path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    compiled = simulate(with_values(load_scenario(preset), {"simulation.duration": duration}))
    with np.load(path) as interpreted:
        rows, kernel = interpreted["rows"], str(interpreted["kernel"])
    np.testing.assert_array_equal(rows, compiled.trace.to_rows())
    assert kernel == compiled.provenance.kernel
