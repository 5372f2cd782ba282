"""What one kind of machine code recorded, another verifies bit for bit."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, preset_names
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.compare.verification import verify
from slipgrasp.recordings.file.reader import read_back, read_recording
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.study.rebuild import rebuild_run
from tests.recordings.test_study_file import make_study, run_study

pytestmark = [pytest.mark.slow, pytest.mark.other_code, pytest.mark.timeout(900)]

REPOSITORY = Path(__file__).parents[2]
# Machine code for any x86-64, without AVX and fused multiply-adds.
GENERIC = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""}
STUDY = {"sampling": {"method": "random", "runs": 4, "seed": 5}}

RECORD = """
import sys
from pathlib import Path
from tests.recordings.test_portability import STUDY, record_presets
from tests.recordings.test_study_file import make_study, run_study
record_presets(Path(sys.argv[1]))
run_study(make_study(**STUDY), Path(sys.argv[1]) / "study")
"""
VERIFY = """
import sys
from pathlib import Path
from tests.recordings.test_portability import describe
for path in sorted(Path(sys.argv[1]).glob("*.mcap")):
    print(describe(path))
"""


def record_presets(folder):
    for name in preset_names():
        write_recording(simulate(load_scenario(name)), folder / f"{name}.mcap")


def describe(path):
    read = read_back(path)
    found = verify(read.result, unaltered=read.is_unaltered)
    return path.stem, found.same, found.bit_for_bit, [m.what for m in found.mismatches]


def run_generic(code, *arguments):
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), **GENERIC}
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)


@pytest.fixture(scope="module")
def generic(tmp_path_factory):
    """All presets, recorded by generic code."""
    folder = tmp_path_factory.mktemp("generic")
    run_generic(RECORD, folder)
    return folder


def test_recordings_of_generic_code_verify_under_code_for_this_processor(generic):
    for name in preset_names():
        assert describe(generic / f"{name}.mcap") == (name, True, True, [])


def test_one_bit_altered_in_a_recording_of_generic_code_is_named(generic):
    run = read_recording(generic / "composite-case-2-noisy.mcap")
    rows = run.trace.to_rows().copy()
    place = [column.name for column in columns_of(run.trace)].index("torque_0_1")
    rows[17, place] = np.nextafter(rows[17, place], np.inf)
    (mismatch,) = verify(replace(run, trace=Trace.from_rows(run.trace.shape, rows))).mismatches
    assert (mismatch.what, mismatch.time) == ("torque_0_1", run.trace.times[17])


def test_recordings_of_this_processor_verify_under_generic_code(tmp_path):
    record_presets(tmp_path)
    told = run_generic(VERIFY, tmp_path).stdout.splitlines()
    assert sorted(told) == sorted(str((name, True, True, [])) for name in preset_names())


def test_a_study_is_the_same_file_whatever_code_its_workers_run(generic, tmp_path):
    rows = run_study(make_study(**STUDY), tmp_path / "study")
    assert (tmp_path / "study").read_bytes() == (generic / "study").read_bytes()
    rebuilt = rebuild_run(generic / "study", rows[-1].index)
    assert rebuilt.metrics.flattened() == rows[-1].metrics
