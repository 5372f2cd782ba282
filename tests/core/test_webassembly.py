"""The kernel as a WebAssembly file: the bits of the native one, in wasmtime and in Chromium."""

import json
from pathlib import Path

import pytest

from benchmarks.engines import Chromium
from benchmarks.portable_runs import run_hash
from slipgrasp.core.kernel.compilation.compiler import entered_by
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.packing import make_table
from slipgrasp.core.kernel.webassembly.build import build
from slipgrasp.core.kernel.webassembly.foreign import Wasmtime
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.table import TABLE, place_of
from tests.core.drawn_scenarios import KINDS, draw_scenario

pytestmark = [pytest.mark.slow, pytest.mark.other_code]


@pytest.fixture(scope="module")
def file(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("webassembly") / "slipgrasp.wasm"
    build(path)
    return path


@pytest.fixture(scope="module")
def wasmtime(file) -> Wasmtime:
    return Wasmtime(file)


def shortened(name, duration=0.5):
    return with_values(load_scenario(name), {"simulation.duration": duration})


SAMPLE = {
    "continuous control": shortened("paper-case-1"),
    "friction unknown": shortened("paper-case-2"),
    "noise": shortened("composite-case-2-noisy"),
    "quadratic program": shortened("three-fingers"),
    "motion of pieces": shortened("shake-test"),
    "patch": load_scenario("wet-patch"),
    "timed change": load_scenario("poured-mass"),
    "polygon and pulses": draw_scenario(KINDS[8], 3),
}


@pytest.mark.parametrize("name", SAMPLE)
def test_a_run_has_the_same_bits_in_wasmtime(name, wasmtime):
    native = run_hash(SAMPLE[name])
    with entered_by(wasmtime.enter):
        assert run_hash(SAMPLE[name]) == native
    assert run_hash(SAMPLE[name]) == native


def test_the_runs_above_are_computed_in_wasmtime(wasmtime):
    """An engine that does nothing is noticed: its run does not begin."""
    scenario = SAMPLE["continuous control"]
    calls = []

    def enter(unit):
        entry = wasmtime.enter(unit)
        return lambda *arguments: (calls.append(unit.symbol), entry(*arguments))[1]

    with entered_by(enter):
        simulate(scenario)
    assert {"slipgrasp_pack", "slipgrasp_begin_run", "slipgrasp_advance"} <= set(calls)


def test_the_file_tells_its_layout(file):
    from wasmtime import Engine, Module

    content = file.read_bytes()
    layout = json.loads(content[content.rindex(b'{"records"') :])
    assert layout["records"]["model"]["size"] == MODEL.itemsize
    assert layout["records"]["table"]["size"] == TABLE.itemsize
    first, shape, strides = layout["places"]["fingers.*.link_masses.*"]
    assert shape == [6, 2]
    assert first + 4 * strides[0] + strides[1] == place_of("fingers.4.link_masses.1")
    assert layout["choices"]["fingers.*.elbow"] == ["up", "down"]
    module = Module.from_file(Engine(), str(file))
    assert module.imports == []


@pytest.mark.browser
def test_the_script_of_the_documentation_runs_case_i_in_chromium(file, browser):
    scenario = load_scenario("paper-case-1")
    rows = Chromium(file, browser).rows_of_run(make_table(scenario))
    native = simulate(scenario).trace.to_rows()
    assert rows.shape == native.shape
    assert rows.tobytes() == native.tobytes()


@pytest.mark.browser
def test_a_noisy_run_has_the_same_bits_in_chromium(file, browser):
    native = run_hash(SAMPLE["noise"])
    with entered_by(Chromium(file, browser).enter):
        assert run_hash(SAMPLE["noise"]) == native
