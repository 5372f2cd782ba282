"""The first compilation: where its result is kept, and what happens where it cannot be."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]

ASK = "from core.kernel.cache import cache_root; print(cache_root())"
RUN = """
from core.loading import load_scenario, with_values
from core.simulator import kernel_is_cached, kernel_progress, prepare_kernel, simulate

assert not kernel_is_cached()
shares = []
prepare_kernel(shares.append)
assert shares[0] == 0.0 and shares == sorted(shares) and shares[-1] > 0.9, shares
assert kernel_progress() == 1.0
result = simulate(with_values(load_scenario("paper-case-2"), {"simulation.duration": 0.2}))
print(result.metrics.last_slip_time)
"""


def python(code, cache):
    environment = {**os.environ, "SLIPGRASP_CACHE": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def unusable(tmp_path):
    """A place where not even root can make a folder."""
    file = tmp_path / "file"
    file.write_text("not a folder")
    return file / "cache"


def test_machine_code_is_kept_where_the_variable_says(tmp_path):
    assert python(ASK, tmp_path / "cache") == str(tmp_path / "cache")


def test_a_temporary_folder_serves_where_the_cache_cannot_be_written_and_is_removed(tmp_path):
    folder = Path(python(ASK, unusable(tmp_path)))
    assert folder.name.startswith("slipgrasp-")
    assert not folder.exists()


@pytest.mark.timeout(600)
def test_kernel_compiles_and_runs_without_a_cache_and_tells_how_far_it_is(tmp_path):
    assert float(python(RUN, unusable(tmp_path))) == pytest.approx(0.11293, abs=5e-6)
