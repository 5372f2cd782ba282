import subprocess
import sys
from pathlib import Path

import pytest

import slipgrasp
from slipgrasp.recordings.file.reader import read_recording

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", slipgrasp.__all__)
def test_every_public_name_can_be_imported(name):
    assert getattr(slipgrasp, name) is not None
    assert name in dir(slipgrasp)


def test_a_scenario_is_simulated_written_and_opened(tmp_path):
    scenario = slipgrasp.with_values(
        slipgrasp.load_scenario("paper-case-1"), {"simulation.duration": 0.1}
    )
    result = slipgrasp.simulate(scenario)
    slipgrasp.write_recording(result, tmp_path / "run.mcap")

    assert slipgrasp.open_recording(tmp_path / "run.mcap").summary() == result.summary()
    assert slipgrasp.open_recording is read_recording


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="simulat"):
        _ = slipgrasp.simulat


@pytest.mark.parametrize(
    "statement",
    ["import slipgrasp", "from slipgrasp.cli.main import main; main(['figures', '--help'])"],
)
def test_nothing_heavy_is_imported_before_it_is_needed(statement):
    check = (
        "import sys\n"
        "try:\n"
        f"    {statement}\n"
        "except SystemExit:\n"
        "    pass\n"
        "heavy = {'numpy', 'numba', 'pydantic', 'mcap', 'matplotlib'}\n"
        "heavy |= {'uvicorn', 'viser', 'fastapi'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", check], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def test_a_service_starts_without_what_draws_and_reads_tables():
    check = (
        "import sys, slipgrasp.web.dashboard\n"
        "heavy = {'matplotlib', 'pandas', 'pyarrow', 'dask', 'scipy.optimize'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    subprocess.run([sys.executable, "-c", check], cwd=ROOT, check=True)


@pytest.mark.parametrize(
    ("arguments", "printed"),
    [(["--help"], "usage: slipgrasp"), (["--version"], "slipgrasp ")],
)
def test_help_and_version_are_printed(arguments, printed):
    done = subprocess.run(
        [sys.executable, "-m", "slipgrasp", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith(printed)
