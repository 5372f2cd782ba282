"""``slipgrasp study`` and ``slipgrasp rebuild``: in this process where no signal is needed."""

import contextlib
import csv
import io
import json
import shutil
import signal
from pathlib import Path

import pytest

from slipgrasp.cli.main import main
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.study.loading import load_study
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.recordings.study.results import read_results
from tests.recordings.studying import make_study, run_study
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

STUDY = """
title = "a grid"
base = "paper-case-2"
recordings = "ended-early"

[vary]
"fingers.0.friction" = {min = 0.2, max = 0.4, count = 3}
"fingers.1.friction" = {min = 0.2, max = 0.4, count = 3}
"controller.lyapunov_weight" = {values = [1.0, 20.0]}
"""
FILES = ["map.png", "map.svg", "recordings", "results.csv", "study.mcap"]


@pytest.fixture
def study(tmp_path, monkeypatch, kernel) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SLIPGRASP_DATA", str(tmp_path / "data"))
    path = tmp_path / "grid.toml"
    path.write_text(STUDY)
    return path


@pytest.fixture
def command(study, capsys):
    def run(*arguments, status=0):
        assert main([*map(str, arguments)]) == status
        return capsys.readouterr()

    return run


def inline(study, *arguments):
    return ("study", study, "--executor", "inline", *arguments)


@pytest.fixture(scope="module")
def finished(tmp_path_factory, kernel) -> tuple[Path, str]:
    """The folder of the study once it is done, and what the command said."""
    folder = tmp_path_factory.mktemp("finished")
    (folder / "grid.toml").write_text(STUDY)
    with contextlib.redirect_stdout(io.StringIO()) as said:
        arguments = inline(folder / "grid.toml", "--output", folder / "done")
        assert main([*map(str, arguments)]) == 0
    return folder / "done", said.getvalue()


@pytest.fixture
def done(study, finished) -> None:
    """A copy of that folder in the present one."""
    shutil.copytree(finished[0], "done")


def files_in(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def test_a_study_gives_table_map_recordings_and_one_object_of_what_happened(study, command):
    said = command(*inline(study, "--output", "done", "--json"))

    told = json.loads(said.out)
    assert told["runs"] == told["planned"] == 18
    assert told["outcomes"] == {"diverged": 12, "left_face": 3, "completed": 3}
    assert told["held"] == 3
    assert "object.mass" in told["unknowns"] and told["told"] is False
    assert told["seconds"] > 0.0
    assert "18 runs, about" in said.err
    assert files_in("done") == FILES
    with open(told["results"], encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["outcome"] for row in rows].count("diverged") == 12
    assert rows[0]["controller.lyapunov_weight"] == "1.0"
    assert {"fingers.0.friction", "reason", "slip_path_1", "held"} <= rows[0].keys()


@pytest.mark.usefixtures("done")
def test_recordings_are_kept_as_the_study_says_and_named_in_the_table():
    results = read_results("done/study.mcap")
    kept = {row["recording"]: row for row in results.rows()[0] if row["recording"] is not None}
    assert files_in("done/recordings") == sorted(f"{name}.mcap" for name in kept)
    assert {row["outcome"] for row in kept.values()} == {"diverged", "left_face"}
    name, row = next(iter(kept.items()))
    assert state_hash(read_recording(f"done/recordings/{name}.mcap")) == row["state_hash"]


def test_a_person_is_told_how_the_runs_ended_and_what_the_crossed_values_did(finished):
    folder, said = finished
    assert "All 18 runs done, in " in said
    assert "3 held the object (16.7 %)" in said
    assert "diverged     12  66.7 %  model_estimate_singular" in said
    assert "controller.lyapunov_weight = 20     9     3  33.3 %" in said
    assert "both held 0, only the first 0, only the second 3, neither 6" in said
    assert str(folder / "results.csv") in said


def test_without_output_each_study_gets_a_new_folder_in_the_data_folder(study, command):
    first = json.loads(command(*inline(study, "--json")).out)["results"]
    second = json.loads(command(*inline(study, "--json")).out)["results"]

    folder = Path("data/study-results").absolute()
    assert (Path(first), Path(second)) == (
        folder / "grid" / "results.csv",
        folder / "grid-2" / "results.csv",
    )


def test_an_estimate_counts_and_simulates_nothing(study, command):
    told = json.loads(command(*inline(study, "--estimate", "--json")).out)

    assert (told["runs"], told["workers"]) == (18, 1)
    assert told["seconds"] > 0.0
    assert told["bytes"] > 18 * 1000
    assert "18 runs, about" in command(*inline(study, "--estimate")).out
    assert not Path("data").exists()


BAD = {
    "unknown preset": ('base = "paper-case-2"', 'base = "paper-case-9"', "did you mean"),
    "a bad member": (
        "[vary]",
        '[vary]\n"trajectory.start.0" = {values = [1.466, 3.9]}',
        "run 18: ",
    ),
    "no TOML": ("[vary]", "[vary", "is not valid TOML"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_study_is_refused_in_one_line_before_anything_is_simulated(study, command, case):
    old, new, finding = BAD[case]
    study.write_text(study.read_text().replace(old, new))

    said = command(*inline(study, "--output", "done"), status=2)
    assert finding in said.err
    assert said.out == ""
    assert not Path("done/results.csv").exists()


@pytest.mark.parametrize(
    ("arguments", "finding"),
    [
        (
            ["--executor", "threads"],
            "'threads' is not an executor; choose one of processes, inline",
        ),
        (["--output", "grid.toml"], "is a file; give a folder"),
    ],
)
def test_a_wrong_argument_is_refused_in_one_line(study, command, arguments, finding):
    assert finding in command("study", study, *arguments, status=2).err


@pytest.mark.parametrize("workers", ["0", "many"])
def test_a_wrong_number_of_workers_is_refused(study, workers):
    with pytest.raises(SystemExit, match="2"):
        main(["study", str(study), "--workers", workers])


@pytest.mark.usefixtures("done")
def test_what_is_in_the_folder_is_replaced_only_on_request(study, command):
    refused = command(*inline(study, "--output", "done"), status=2)
    assert "study.mcap' already exists; --force replaces it" in refused.err

    study.write_text(study.read_text().replace("max = 0.4", "max = 0.5"))
    assert "--force replaces it" in command(*inline(study, "--output", "done"), status=2).err
    command(*inline(study, "--output", "done", "--force"))
    assert read_results("done/study.mcap").study == load_study(study)

    Path("notes").mkdir()
    Path("notes/results.csv").write_text("mine")
    assert (
        "results.csv' already exists" in command(*inline(study, "--output", "notes"), status=2).err
    )


def test_a_study_that_was_begun_is_not_mixed_with_another(study, command):
    Path("done").mkdir()
    begun = make_study(vary={"object.mass": {"values": [0.5 + 0.01 * k for k in range(40)]}})
    run_study(begun, Path("done/study.mcap"), until=20)
    assert files_in("done") == ["study.mcap.part"]

    refused = command(*inline(study, "--output", "done"), status=2).err
    assert "belongs to another study" in refused
    assert "--force" in refused
    assert files_in("done") == ["study.mcap.part"]
    command(*inline(study, "--output", "done", "--force"))
    assert read_results("done/study.mcap").study == load_study(study)


# Writes rows at once, and after the twentieth says so and waits until it is told to end.
HELD = """
import sys, time
from pathlib import Path
from slipgrasp.recordings.study import scheduler
from slipgrasp.cli.main import main

schedule_runs = scheduler.schedule_runs
scheduler.WRITE_INTERVAL = 0.0

def schedule_and_wait(*arguments, watch, should_stop, **others):
    def watch_and_wait(row):
        watch(row)
        if row.index == 19:
            Path("waits").touch()
            while not should_stop():
                time.sleep(0.01)
    return schedule_runs(*arguments, watch=watch_and_wait, should_stop=should_stop, **others)

scheduler.schedule_runs = schedule_and_wait
sys.exit(main(sys.argv[1:]))
"""


def study_of_sixty(path):
    path.write_text(
        'base = "paper-case-1"\nrecordings = "none"\n[sampling]\nmethod = "random"\nruns = 60\n'
        '[set]\n"simulation.duration" = 0.2\n'
        '[vary]\n"object.mass" = {min = 0.5, max = 1.5}\n'
        '"fingers.*.friction" = {min = 0.2, max = 0.4}\n'
    )
    return path


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_an_interrupted_study_keeps_what_is_done_and_the_same_command_goes_on(
    slipgrasp, tmp_path, number
):
    study = study_of_sixty(tmp_path / "sixty.toml")
    arguments = ("study", study, "--output", tmp_path / "done", "--json", "--executor", "inline")
    process = slipgrasp.start_script(HELD, *arguments)
    with process:
        wait_until(lambda: (slipgrasp.folder / "waits").exists() or process.poll() is not None)
        process.send_signal(number)
        said = process.stdout.read()

    before = read_results(tmp_path / "done" / "study.mcap.part").num_rows
    assert 20 <= before < 60
    if number == signal.SIGINT:
        assert process.returncode == 4
        told = json.loads(said)
        assert (told["state"], told["runs"]) == ("cancelled", before)
        assert len((tmp_path / "done" / "results.csv").read_text().splitlines()) == before + 1
    done = slipgrasp(*arguments)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["runs"] == 60
    results = read_results(tmp_path / "done" / "study.mcap")
    assert results.values("index") == list(range(60))
    alone = simulate(results.study.scenario_of(59))
    assert results.row(59)["state_hash"] == state_hash(alone)


@pytest.mark.usefixtures("done")
def test_a_row_becomes_a_recording_that_is_what_the_study_computed(command):
    printed = command("rebuild", "done/study.mcap", "17", "--output", "run.mcap").out

    assert printed == "run.mcap\n"
    row = read_results("done/study.mcap").row(17)
    assert row["recording"] is None
    assert state_hash(read_recording("run.mcap")) == row["state_hash"]
    assert "Equal: " in command("verify", "run.mcap").out
    assert (
        "already exists"
        in command(*("rebuild", "done/study.mcap", "3", "--output", "run.mcap"), status=2).err
    )


@pytest.mark.usefixtures("done")
def test_a_row_becomes_a_run_of_the_data_folder_by_default(command):
    path = Path(command("rebuild", "done/study.mcap", "0").out.strip())

    assert path.parent == Path("data").absolute()
    assert "Equal: " in command("verify", path.stem).out


@pytest.mark.usefixtures("done")
def test_a_run_that_is_not_there_is_refused(command):
    said = command("rebuild", "done/study.mcap", "18", status=2).err
    assert "there is no run 18 in 'done/study.mcap'; it has 18, counted from 0" in said


@pytest.mark.parametrize("name", ["verify", "export"])
@pytest.mark.usefixtures("done")
def test_commands_for_recordings_say_what_to_do_with_a_study(command, name):
    assert "'slipgrasp rebuild'" in command(name, "done/study.mcap", status=2).err
