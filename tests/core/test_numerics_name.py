"""The name of the numerics changes when code that decides bits changes, and only then."""

import ast
import hashlib
import importlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from slipgrasp.core.kernel.compilation.compiler import all_units
from slipgrasp.core.kernel.compilation.normal_form import NormalForm, _trees_in, tree_of
from slipgrasp.core.kernel.planar import packing
from slipgrasp.core.run import numerics
from slipgrasp.core.run.numerics import SAME_BITS, compute_name, normal_form, numerics_name
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.space import PLANAR, SPACES
from slipgrasp.recordings.file.writer import write_recording

REPOSITORY = Path(__file__).parents[2]
PACKAGES = ("core", "scene", "recordings", "figures", "server", "web")

# A kernel in small: two modules, a record, closures, a table, a class.
MODULES = {
    "parts": '''
import numpy as np

LIMIT = 2.0
TABLE = np.array([1.0, 2.0])
STATE = np.dtype([("x", np.float64, (2,)), ("spare", np.int64)])
START = np.zeros(1, STATE)[0]


def half(x):
    """Half of it."""
    return 0.5 * x


def make(scale):
    def scaled(x):
        return scale * x

    return scaled


class Schedule:
    def begin(self):
        return 3.0

    def finger_names(self):
        return "left"
''',
    "root": """
from kernel.parts import LIMIT, START, STATE, TABLE, Schedule, half, make

scaled = make(4.0)


def run(t: float, h: float = 0.1) -> float:
    # The sum of everything.
    total = [half(value) for value in TABLE]
    if t > LIMIT:
        raise ValueError("too late")
    assert h > 0.0, "a step"
    schedule = Schedule()
    return scaled(t) + h * total[0] + START.x[0] + schedule.begin()
""",
}
HARMLESS = {
    "a comment": [("root", "# The sum of everything.", "# What comes of it,\n    # all in all.")],
    "a docstring": [("parts", "Half of it.", "It, divided by two.")],
    "an annotation": [("root", "t: float, h: float = 0.1) -> float", "t, h=0.1)")],
    "formatting": [
        ("root", "half(value) for value in TABLE", "(\n half( value )\n) for value in TABLE")
    ],
    "the way a number is written": [("parts", "LIMIT = 2.0", "LIMIT = 20e-1")],
    "the message of an error": [("root", "too late", "not any more")],
    "the message of an assertion": [("root", "a step", "steps are positive")],
    "a function moved to another module": [
        ("parts", 'def half(x):\n    """Half of it."""\n    return 0.5 * x\n', ""),
        (
            "root",
            "scaled = make(4.0)",
            "scaled = make(4.0)\n\n\ndef half(x):\n    return 0.5 * x\n",
        ),
        ("root", "Schedule, half, make", "Schedule, make"),
    ],
    "another order in a module": [
        (
            "parts",
            "LIMIT = 2.0\nTABLE = np.array([1.0, 2.0])",
            "TABLE = np.array([1.0, 2.0])\nLIMIT = 2.0",
        )
    ],
    "the name of a function": [
        ("parts", "def half", "def halved"),
        ("root", "half(", "halved("),
        ("root", "half,", "halved,"),
    ],
    "what nothing reaches": [
        ("parts", "class Schedule", "def unused():\n    return 7.0\n\n\nclass Schedule")
    ],
    "a method that nothing calls": [("parts", '"left"', '"the left one"')],
    "a field that nothing uses": [
        ("parts", '("spare", np.int64)', '("spare", np.int64), ("more", np.float64)')
    ],
    "the type of a field that nothing uses": [
        ("parts", '("spare", np.int64)', '("spare", np.bool_)')
    ],
    "the value of a field that nothing uses": [
        (
            "parts",
            "START = np.zeros(1, STATE)[0]",
            "START = np.zeros(1, STATE)[0]\nSTART['spare'] = 5",
        )
    ],
}
DECISIVE = {
    "an operator": [("root", "scaled(t) + h", "scaled(t) - h")],
    "a comparison": [("root", "t > LIMIT", "t >= LIMIT")],
    "a constant": [("parts", "0.5 * x", "0.25 * x")],
    "the kind of a constant": [("root", "h > 0.0", "h > 0")],
    "a constant of another module": [("parts", "LIMIT = 2.0", "LIMIT = 2.5")],
    "a number of a table": [("parts", "[1.0, 2.0]", "[1.0, 3.0]")],
    "a default": [("root", "h: float = 0.1", "h: float = 0.2")],
    "what a function has from the one around it": [("root", "make(4.0)", "make(5.0)")],
    "a function around which another is": [("parts", "return scale * x", "return scale / x")],
    "which function is called": [("root", "scaled(t)", "half(t)")],
    "a method that is called": [("parts", "return 3.0", "return 4.0")],
    "the type of a field that is used": [
        ("parts", '("x", np.float64, (2,))', '("x", np.float32, (2,))')
    ],
    "the size of a field that is used": [
        ("parts", '("x", np.float64, (2,))', '("x", np.float64, (3,))')
    ],
    "the value of a field that is used": [
        (
            "parts",
            "START = np.zeros(1, STATE)[0]",
            "START = np.zeros(1, STATE)[0]\nSTART['x'][0] = 1.0",
        )
    ],
    "which field is used": [("root", "START.x[0]", "START.spare")],
}


@pytest.fixture
def digest(tmp_path, monkeypatch):
    """The name of the small kernel after some edits."""

    def digest_after(edits):
        folder = tmp_path / hashlib.sha256(repr(edits).encode()).hexdigest()[:8]
        (folder / "kernel").mkdir(parents=True)
        texts = dict(MODULES)
        for module, old, new in edits:
            assert old in texts[module]
            texts[module] = texts[module].replace(old, new)
        for module, text in texts.items():
            (folder / "kernel" / f"{module}.py").write_text(text, encoding="utf-8")
        monkeypatch.syspath_prepend(str(folder))
        for name in [name for name in sys.modules if name.partition(".")[0] == "kernel"]:
            monkeypatch.delitem(sys.modules, name)
        importlib.invalidate_caches()
        run = importlib.import_module("kernel.root").run
        return "\n".join(NormalForm([run], package="kernel").lines)

    return digest_after


@pytest.mark.parametrize("what", HARMLESS)
def test_the_name_stays_where_this_changes(what, digest):
    assert digest(HARMLESS[what]) == digest([])


@pytest.mark.parametrize("what", DECISIVE)
def test_the_name_changes_where_this_does(what, digest):
    assert digest(DECISIVE[what]) != digest([])


def test_code_without_its_source_counts_with_what_python_made_of_it():
    def form(text):
        names = {"__name__": "kernel.root"}
        exec(text, names)
        return NormalForm([names["f"]], package="kernel").lines

    plain = form("def f(x):\n    'Two of it.'\n    return 2.0 * x")
    assert form("def f(x):\n    'Twice.'\n    # why\n    return 2.0 * x") == plain
    assert form("def f(x):\n    return 3.0 * x") != plain


@pytest.fixture(scope="module")
def forms():
    return [normal_form(space) for space in SPACES]


@pytest.mark.slow
def test_every_unit_of_the_kernel_is_part_of_a_name(forms):
    reached = {code for form in forms for code in form.reached}
    assert [unit.symbol for unit in all_units() if unit.function not in reached] == []


@pytest.mark.slow
def test_all_code_that_is_part_of_a_name_has_its_source(forms):
    """Python's own code, which counts where there is no source, is another in each version."""
    functions = {code for form in forms for code in form.reached if not isinstance(code, type)}
    assert [code.__qualname__ for code in functions if tree_of(code) is None] == []


@pytest.mark.slow
def test_no_code_that_reads_checks_or_words_a_scenario_is_part_of_a_name(forms):
    for form in forms:
        modules = {code.__module__ for code in form.reached}
        assert not [m for m in modules if re.search(r"validation|field_errors|words|loading", m)]


@pytest.mark.slow
def test_the_name_is_kept_as_it_is_computed(forms, monkeypatch):
    kept = [*map(numerics_name, SPACES)]
    monkeypatch.setattr(numerics, "normal_form", dict(zip(SPACES, forms, strict=True)).get)
    assert kept == [*map(compute_name, SPACES)]


@pytest.mark.slow
def test_earlier_names_with_equal_bits_belong_to_present_names():
    assert set(SAME_BITS) <= {*map(numerics_name, SPACES)}


@pytest.mark.slow
def test_a_fact_of_a_law_that_the_kernel_reads_is_part_of_the_name(monkeypatch):
    before, facts = numerics_name(PLANAR), packing._FACTS.copy()
    monkeypatch.setattr(packing, "_FACTS", facts)
    facts["learns"][2] = not facts["learns"][2]
    assert compute_name(PLANAR) != before


NAMES = """
from slipgrasp.core.run.numerics import compute_name
from slipgrasp.core.scenario.space import SPACES
print(*(compute_name(each) for each in SPACES))
"""


def python(code, *, path=None, **environment):
    variables = {**os.environ, **environment, **({} if path is None else {"PYTHONPATH": str(path)})}
    command = [sys.executable, "-c", code]
    done = subprocess.run(
        command, env=variables, cwd=path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def names_of(**options):
    return tuple(python(NAMES, **options).split())


@pytest.mark.slow
def test_the_kernel_that_python_runs_has_the_names_of_the_compiled_one():
    compiled = tuple(map(numerics_name, SPACES))
    assert names_of(SLIPGRASP_KERNEL="python") == compiled
    assert compiled[0] != compiled[1]


@pytest.fixture
def tree(tmp_path):
    """A copy of the program, to be edited."""
    folder = tmp_path / "program"
    shutil.copytree(REPOSITORY / "slipgrasp", folder / "slipgrasp")
    for package in PACKAGES:
        shutil.copytree(REPOSITORY / package, folder / "slipgrasp" / package)

    def edit(file, old, new):
        path = folder / "slipgrasp" / file
        text = path.read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")

    edit.folder = folder
    return edit


VERIFY = """
import sys
import slipgrasp
assert slipgrasp.__file__.startswith({folder!r}), slipgrasp.__file__
from slipgrasp.cli.main import main
statuses = [main(["verify", recording, "--json"]) for recording in {recordings!r}]
sys.exit(any(statuses))
"""
PRODUCT = re.compile(r"@compiled\ndef _wide_product\(.*?\n\n\n", re.DOTALL)


@pytest.mark.slow
def test_a_recording_verifies_bit_for_bit_after_words_are_edited_and_code_is_moved(tree, tmp_path):
    recordings = []
    for preset in ("composite-case-2-noisy", "spatial-composite-noisy"):
        scenario = with_values(load_scenario(preset), {"simulation.duration": 0.05})
        recordings.append(str(tmp_path / f"{preset}.mcap"))
        write_recording(simulate(scenario), Path(recordings[-1]))
    tree("core/kernel/planar/steps.py", "from __future__", "# Every step.\nfrom __future__")
    tree("core/kernel/spatial/steps.py", "from __future__", "# Every step.\nfrom __future__")
    tree("core/scenario/laws.py", "Adaptation by least squares", "It adapts by least squares")
    noise = tree.folder / "slipgrasp" / "core" / "kernel" / "numerics" / "noise.py"
    text = noise.read_text(encoding="utf-8")
    (product,) = PRODUCT.findall(text)
    names = "from slipgrasp.core.kernel.numerics.elementary import "
    text = text.replace(product, "").replace(names, f"{names}_wide_product, ")
    noise.write_text(text, encoding="utf-8")
    elementary = noise.with_name("elementary.py")
    moved = f"{elementary.read_text(encoding='utf-8')}\n\n_WORD = (1 << 32) - 1\n\n\n{product}"
    elementary.write_text(moved, encoding="utf-8")
    code = VERIFY.format(folder=str(tree.folder), recordings=recordings)
    for line in python(code, path=tree.folder).splitlines():
        found = json.loads(line)
        assert found["same"] and found["bit_for_bit"] and found["whole"]
        assert found["recorded"]["kernel"] == found["present"]["kernel"]


@pytest.mark.slow
def test_an_operator_beside_the_kernel_gives_another_name_to_what_uses_it_alone(tree):
    plane, space, *others = map(numerics_name, SPACES)
    tree("core/run/spatial_schedule.py", "math.sqrt(x * x + y * y)", "math.sqrt(x * x - y * y)")
    edited = names_of(path=tree.folder)
    assert edited[0] == plane and edited[1] != space and [*edited[2:]] == others


def test_threads_that_need_the_name_at_once_compute_it_once(monkeypatch):
    """Runs that begin at once in a fresh service."""
    kept, under_way = {}, []

    def compute(space):
        under_way.append(space)
        assert len(under_way) == 1
        time.sleep(0.05)
        return "numerics-0"

    monkeypatch.setattr(numerics, "read_code", kept.get)
    monkeypatch.setattr(numerics, "write_code", kept.__setitem__)
    monkeypatch.setattr(numerics, "compute_name", compute)
    with ThreadPoolExecutor(4) as threads:
        names = list(threads.map(numerics_name.__wrapped__, [PLANAR] * 4))
    assert names == ["numerics-0"] * 4


def test_code_is_parsed_again_if_another_thread_parsed_at_the_same_time(monkeypatch):
    """Python 3.11 then raises a SystemError now and then."""
    parse, failures = ast.parse, ["AST constructor recursion depth mismatch"] * 2

    def parse_late(code):
        if failures:
            raise SystemError(failures.pop())
        return parse(code)

    with monkeypatch.context() as patch:
        patch.setattr(ast, "parse", parse_late)
        found = _trees_in.__wrapped__(packing.__file__)
    assert "make_table" in found and not failures
