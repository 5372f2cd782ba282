"""Custom laws on the command line, in studies, on workers and in the service."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from slipgrasp import open_study
from slipgrasp.cli.main import main
from slipgrasp.core.scenario.custom_laws import custom_law, custom_laws, forget
from slipgrasp.core.scenario.law_loading import LawError, admit, load_law, refer_to
from slipgrasp.core.scenario.loading import load_scenario, scenario_to_toml, with_values

pytestmark = pytest.mark.slow

LAW = '''"""A law."""
import numpy as np

class Carry:
    """Carries the object."""

    def command(self, seen, memory, out):
        force = 40.0 * seen.contact_normal
        force[:, 1] += seen.model.object_mass * seen.model.gravity / len(seen.slip)
        out.torque[:] = np.einsum("nij,ni->nj", seen.jacobian, force)


class Broken(Carry):
    """Raises."""

    def command(self, seen, memory, out):
        super().command(seen, memory, out)
        if seen.tick == 9:
            out.torque[:] = undefined
'''


@pytest.fixture(autouse=True)
def _folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("law.py").write_text(LAW, encoding="utf-8")
    yield
    for law in custom_laws():
        forget(law.name)


def run(capsys, *arguments):
    status = main([*arguments, "--json"])
    return status, json.loads(capsys.readouterr().out)


def test_a_law_of_a_file_runs_is_recorded_and_verifies_without_it(capsys):
    common = ("--set", "simulation.duration=0.2", "--output", "run.mcap")
    status, found = run(capsys, "run", "composite-case-2", "--law", "law.py:Carry", *common)
    assert (status, found["outcome"]) == (0, "completed")
    assert (found["law"]["name"], len(found["law"]["digest"])) == ("carry", 64)
    forget("carry")
    status, found = run(capsys, "verify", "run.mcap")
    assert (status, found["same"], found["bit_for_bit"], found["replayed"]) == (0, True, True, True)
    status, found = run(capsys, "verify", "run.mcap", "--law", "law.py:Carry")
    assert (status, found["same"], found["replayed"]) == (0, True, False)
    Path("law.py").write_text(LAW.replace("40.0", "41.0"), encoding="utf-8")
    status, found = run(capsys, "verify", "run.mcap", "--law", "law.py:Carry")
    assert (status, found["mismatches"][0]["what"]) == (1, "law")
    assert found["present"]["law"]["digest"] != found["recorded"]["law"]["digest"]
    Path("law.py").write_text(f"{LAW}# A comment.\n", encoding="utf-8")
    assert main(["verify", "run.mcap", "--law", "law.py:Carry"]) == 1
    told = capsys.readouterr().out
    assert "another version of the law ran, with the same samples" in told
    assert "its code was run as well" not in told


def test_a_file_may_name_the_law_that_comes_with_it(capsys):
    load_law("law.py:Carry")
    own = with_values(load_scenario("composite-case-2"), {"controller.kind": "carry"})
    Path("own.toml").write_text(scenario_to_toml(own), encoding="utf-8")
    forget("carry")
    common = ("--set", "simulation.duration=0.2")
    status, found = run(capsys, "run", "own.toml", "--law", "law.py:Carry", *common)
    assert (status, found["law"]["name"]) == (0, "carry")


def test_a_broken_law_tells_its_line_and_nothing_is_lost(capsys):
    status, found = run(
        capsys, "run", "composite-case-2", "--law", "law.py:Broken", "--output", "run.mcap"
    )
    assert (status, found["outcome"], found["reason"]["code"]) == (4, "failed", "law_failed")
    line = 1 + LAW.splitlines().index("            out.torque[:] = undefined")
    assert f"law.py, line {line}: out.torque[:] = undefined" in found["reason"]["message"]
    assert found["end_time"] == pytest.approx(0.009)
    assert run(capsys, "verify", "run.mcap")[1]["same"]


ROUGH = '''import numba
import sys

class Leaves:
    """Ends its program."""

    def command(self, seen, memory, out):
        sys.exit(7)


@numba.njit
def command(seen, memory, out):
    out.torque[0, 0] = seen.slipp[0]


class Misspelt:
    """Asks for what is not there, and is compiled."""

    command = staticmethod(command)
'''


@pytest.mark.parametrize(
    ("name", "told", "line"),
    [
        ("Leaves", "SystemExit: 7", "sys.exit(7)"),
        ("Misspelt", "has no attribute 'slipp'", "out.torque[0, 0] = seen.slipp[0]"),
    ],
)
def test_a_law_that_ends_the_program_or_cannot_be_compiled_is_a_failed_run(
    name, told, line, capsys
):
    Path("rough.py").write_text(ROUGH, encoding="utf-8")
    status, found = run(
        capsys, "run", "composite-case-2", "--law", f"rough.py:{name}", "--output", "run.mcap"
    )
    assert (status, found["reason"]["code"]) == (4, "law_failed")
    assert told in found["reason"]["message"] and line in found["reason"]["message"]
    assert run(capsys, "verify", "run.mcap")[1]["same"]


def test_what_numba_alone_refuses_is_told_in_a_line(capsys):
    text = ROUGH.replace("seen.slipp[0]", "str(seen.tick, []) and 0.0")
    Path("rough.py").write_text(text.replace("str(", "dict("), encoding="utf-8")
    _, found = run(capsys, "run", "composite-case-2", "--law", "rough.py:Misspelt")
    assert len(found["reason"]["message"]) < 500


def test_what_a_law_tells_is_a_column_of_the_table(capsys):
    text = LAW.replace('"""Carries the object."""', 'diagnostics = {"grip": ("N", "Asked for.")}')
    Path("law.py").write_text(text.replace("force = 40.0", "out.grip[0] = 40.0; force = 40.0"))
    run(capsys, "run", "composite-case-2", "--law", "law.py:Carry", "--output", "run.mcap")
    assert main(["export", "run.mcap", "--output", "run.csv"]) == 0
    head, first, *_ = Path("run.csv").read_text().splitlines()
    assert dict(zip(head.split(","), first.split(","), strict=True))["law_grip"] == "40.0"


def test_a_study_over_a_law_is_read_and_rebuilt_where_the_law_comes_from_a_file(capsys):
    text = LAW.replace(
        '"""Carries the object."""',
        'parameters = {"grip": LawParameter(value=40.0, minimum=0.0, maximum=90.0, text="Force.")}',
    ).replace("40.0 * seen", "seen.parameters.grip * seen")
    Path("law.py").write_text(f"from slipgrasp import LawParameter\n{text}", encoding="utf-8")
    study = (
        'base = "composite-case-2"\nlaw = "law.py:Carry"\nrecordings = "none"\n'
        '[set]\n"simulation.duration" = 0.05\n'
        '[vary]\n"controller.parameters.grip" = {min = 30.0, max = 60.0, count = 2}\n'
    )
    Path("study.toml").write_text(study, encoding="utf-8")
    run(capsys, "study", "study.toml", "--output", "out", "--executor", "inline")
    forget("carry")
    assert open_study("out/study.mcap").study.keys == ("controller.parameters.grip",)
    rebuild = ["rebuild", "out/study.mcap", "1", "--output", "run.mcap"]
    assert main(rebuild) == 2
    assert "is not a known control law" in capsys.readouterr().err
    assert main([*rebuild, "--law", "law.py:Carry"]) == 0


@pytest.mark.parametrize(
    ("specification", "told"),
    [
        ("nowhere.py:Carry", "cannot be read"),
        ("law.py:Nothing", "has no class 'Nothing'; laws in it: Carry, Broken"),
        ("law.py", "add the class: law.py:Name"),
        ("no-such-law", "laws: adaptive-mass, adaptive-friction, theorem-3"),
    ],
)
def test_a_law_that_is_not_there_is_refused_in_a_sentence(specification, told, capsys):
    assert main(["run", "composite-case-2", "--law", specification]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize("executor", ["processes", "dask"])
def test_a_study_names_a_law_and_workers_give_the_rows_of_this_process(executor, capsys):
    text = (
        'base = "composite-case-2"\nlaw = "law.py:Carry"\nrecordings = "none"\n'
        '[set]\n"simulation.duration" = 0.1\n'
        '[vary]\n"object.mass" = {min = 0.8, max = 1.2, count = 4}\n'
    )
    Path("study.toml").write_text(text, encoding="utf-8")
    hashes = []
    for where in (("inline",), (executor, "--workers", "2")):
        forget("carry")
        output = f"out-{where[0]}"
        status, found = run(capsys, "study", "study.toml", "--output", output, "--executor", *where)
        assert (status, found["outcomes"]) == (0, {"completed": 4})
        lines = Path(output, "results.csv").read_text(encoding="utf-8").splitlines()
        place = lines[0].split(",").index("state_hash")
        hashes.append([line.split(",")[place] for line in lines[1:]])
    assert hashes[0] == hashes[1]
    assert len(set(hashes[0])) == 4


def test_a_worker_whose_copy_is_another_refuses():
    law = load_law("law.py:Carry")
    reference = refer_to(law)
    forget("carry")
    admit(reference)
    assert custom_law("carry").identity == law.identity
    forget("carry")
    other = type(reference)(law.identity, reference.origin, LAW.replace("40.0", "41.0"))
    with pytest.raises(LawError, match=r"a worker rejects the task.*digest"):
        admit(other)
    assert custom_law("carry") is None


def test_a_new_law_works_as_it_is_written_and_its_test_passes(capsys):
    assert main(["laws", "new", "my_grip.py"]) == 0
    assert main(["laws", "new", "my_grip.py"]) == 2
    assert "exists" in capsys.readouterr().err
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_my_grip.py"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout
    assert "3 passed" in done.stdout


def test_the_laws_are_listed_with_those_of_installed_packages(capsys, tmp_path, monkeypatch):
    folder = tmp_path / "site"
    information = folder / "mylaws-1.0.dist-info"
    information.mkdir(parents=True)
    (folder / "mylaws.py").write_text(LAW, encoding="utf-8")
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: mylaws\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text("[slipgrasp.laws]\ncarry = mylaws:Carry\n")
    monkeypatch.syspath_prepend(str(folder))
    status, found = run(capsys, "laws")
    names = [law["name"] for law in found["laws"]]
    assert (status, names[-1], len(names)) == (0, "carry", 8)
    forget("carry")
    common = ("--set", "simulation.duration=0.1", "--output", "run.mcap")
    status, found = run(capsys, "run", "composite-case-2", "--law", "carry", *common)
    assert (status, found["law"]["name"]) == (0, "carry")
    reference = refer_to(custom_law("carry"))
    forget("carry")
    admit(reference)
    assert custom_law("carry").identity == reference.identity
