"""The page on custom laws: its examples run, its tables name what there is."""

import re
from pathlib import Path

import pytest

import slipgrasp
from slipgrasp.core.run.law_code import answer_views, seer
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.scenario.custom_laws import (
    INTERFACE_VERSION,
    OUTSIDE,
    custom_law,
    custom_laws,
    forget,
)
from tests.fenced_blocks import DOCS, blocks_of, output_of

pytestmark = pytest.mark.slow

TEXT = (DOCS / "laws.md").read_text(encoding="utf-8")
BLOCKS = blocks_of(TEXT, "python")


@pytest.fixture(autouse=True)
def _page_folder(tmp_path, monkeypatch):
    """The files of the page, in the present folder; its laws are forgotten afterwards."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for block in BLOCKS:
        if block.file:
            Path(block.file).write_text(block.text, encoding="utf-8")
    yield
    for law in custom_laws():
        forget(law.name)


def test_the_examples_of_the_page_run_in_their_order():
    names = {"__name__": "example"}
    for block in BLOCKS:
        if not block.file:
            output_of(block.text, names)
    assert names["result"].outcome == "completed"


@pytest.mark.parametrize(
    ("specification", "preset", "values"),
    [
        ("declared.py:Squeeze", "composite-case-2", {}),
        ("my_law_in_space.py:CarryInSpace", "spatial-composite", {}),
        ("my_law_in_space.py:CarryInSpace", "trifinger", {"estimates.3.initial": 0.094}),
    ],
)
def test_the_other_laws_of_the_page_hold_the_object(specification, preset, values):
    law = slipgrasp.load_law(specification)
    scenario = slipgrasp.with_values(slipgrasp.load_scenario(preset), values)
    scenario = slipgrasp.with_law(scenario, law.name)
    assert slipgrasp.simulate(scenario).outcome == "completed"


def test_the_first_law_takes_ten_lines():
    (first,) = (block.text for block in BLOCKS if block.file == "my_law.py")
    assert len([line for line in first.splitlines() if line.strip()]) <= 10


@pytest.mark.parametrize(
    ("preset", "mark", "n"),
    [("composite-case-2", "seen", 2), ("spatial-composite", "seen in space", 3)],
)
def test_the_page_tells_everything_that_a_law_sees_and_its_shape(preset, mark, n):
    own = Simulation(slipgrasp.load_scenario(preset))._run.own
    seen = seer(custom_law(OUTSIDE), own, (n, 4))()
    table = TEXT.partition(f"<!-- {mark} -->")[2].partition(f"<!-- end {mark} -->")[0]
    told = set(re.findall(r"`(\w+)`", table))
    assert {*seen._fields, *seen.model._fields} <= told
    for line in table.splitlines():
        for name in re.findall(r"`(\w+)`", line.partition("|")[2].partition("|")[0]):
            shape = re.search(r"\| (\([^|]*?\)) \|", line)
            actual = getattr(seen, name, None)
            if shape and hasattr(actual, "shape") and "," not in shape[1].strip("()").strip(","):
                wanted = shape[1].replace("n", str(n)).replace("p", "4")
                assert actual.shape == eval(wanted), name


def test_the_page_is_about_the_present_interface():
    assert f"**interface {INTERFACE_VERSION}**" in TEXT
    own = Simulation(slipgrasp.load_scenario("composite-case-2"))._run.own
    assert answer_views((), own, (2, 4))._fields == ("torque", "estimates")
