"""The first compilation: where its result is kept, and what happens where it cannot be."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba import types

from slipgrasp.core.kernel.compilation.cache import code_path, read_code, write_code
from slipgrasp.core.kernel.compilation.compiler import all_units, compiled
from slipgrasp.core.kernel.compilation.fingerprint import fingerprint
from slipgrasp.core.run.engine import engine_of
from slipgrasp.core.run.simulator import prepare_kernel
from slipgrasp.core.scenario import PLANAR, SPATIAL
from slipgrasp.core.scenario.space import SPACES

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).parents[2]

ASK = "from slipgrasp.core.kernel.compilation.cache import cache_root; print(cache_root())"
RUN = """
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.run.simulator import kernel_is_cached, kernel_progress, prepare_kernel, simulate

assert not kernel_is_cached()
shares = []
prepare_kernel(shares.append)
assert 0.0 < shares[0] < 0.9 and shares == sorted(shares) and shares[-1] > 0.9, shares
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


def is_planar(unit):
    others = (space.name for space in SPACES if space is not PLANAR)
    return not any(name in f"{unit.symbol} {unit.function.__module__}" for name in others)


@pytest.mark.timeout(600)
def test_what_is_missing_is_compiled_while_it_tells_how_far_it_is(tmp_path):
    """The nine smallest units, enough for two processes; a fresh checkout compiles them all."""
    prepare_kernel()
    folder = tmp_path / code_path("").parent.name
    folder.mkdir()
    # Other tests of this process may have loaded units of other spaces, which the run lacks.
    planar = [unit for unit in all_units() if is_planar(unit)]
    paths = [code_path(unit.name) for unit in planar]
    for path in sorted(paths, key=lambda path: path.stat().st_size)[9:]:
        shutil.copy(path, folder)
    assert float(python(RUN, tmp_path)) == pytest.approx(0.11293, abs=5e-6)


def test_one_source_is_compiled_for_both_mechanics_under_two_symbols():
    engine_of(SPATIAL)
    units = {unit.symbol: unit for unit in all_units()}
    planar, spatial = units["slipgrasp_advance"], units["slipgrasp_spatial_advance"]
    assert planar.function.__code__ is spatial.function.__code__
    assert planar.name != spatial.name


def function_of(source):
    """The function that a module with this source defines, as the kernel's modules do."""
    names = {"compiled": compiled, "LIMIT": 2.0}
    exec(source, names)
    return names["f"]


def digest_of(source):
    return fingerprint(function_of(source), types.float64(types.float64), {})


PLAIN = """
@compiled
def g(x):
    return LIMIT * x

def f(x):
    '''Says what it does.'''
    return g(x) + 1.0
"""


@pytest.mark.parametrize(
    ("old", "new", "changes"),
    [
        ("Says what it does.", "Says it\n\n    at length.", False),
        ("    return g", "    # why\n\n    return g", False),
        ("def g(x):", "def g(x):  # inlined", False),
        ("1.0", "1.5", True),
        ("LIMIT * x", "LIMIT + x", True),
        ("LIMIT * x", "3.0 * x", True),
    ],
)
def test_only_what_decides_the_machine_code_changes_the_name_it_is_kept_under(old, new, changes):
    assert (digest_of(PLAIN.replace(old, new)) != digest_of(PLAIN)) == changes


def test_a_constant_that_is_changed_elsewhere_changes_the_name():
    changed = function_of(PLAIN)
    changed.__globals__["LIMIT"] = 2.5
    name = fingerprint(changed, types.float64(types.float64), {})
    assert name != digest_of(PLAIN)


CLOSED = """
def make(scale):
    @compiled
    def g(x):
        return scale * x

    def f(x):
        'Says what it does.'
        return g(x) + 1.0

    return f

f = make(2.0)
"""


@pytest.mark.parametrize(
    ("old", "new", "changes"),
    [
        ("Says what it does.", "Says it.", False),
        ("make(2.0)", "make(3.0)", True),
        ("scale * x", "scale + x", True),
    ],
)
def test_what_a_function_has_from_the_one_around_it_decides_its_machine_code_too(old, new, changes):
    assert (digest_of(CLOSED.replace(old, new)) != digest_of(CLOSED)) == changes


def test_machine_code_that_the_disk_has_spoilt_counts_as_missing():
    name = "spoilt-by-a-test"
    try:
        write_code(name, b"code")
        assert read_code(name) == b"code"
        code_path(name).write_bytes(code_path(name).read_bytes()[:-1])
        assert read_code(name) is None
    finally:
        code_path(name).unlink()
    assert read_code(name) is None
