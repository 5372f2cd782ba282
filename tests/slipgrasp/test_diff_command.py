"""``slipgrasp diff`` as its users meet it."""

import json
from dataclasses import replace

import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.file.writer import write_recording

pytestmark = pytest.mark.slow

SHORT = {"simulation.duration": 0.3}
CHANGES = {
    "base": {},
    "slipperier": {"fingers.0.friction": 0.2525},
    "slower": {"simulation.output_rate": 50.0},
}


@pytest.fixture(scope="module")
def runs():
    base = with_values(load_scenario("paper-case-1"), SHORT)
    return {name: simulate(with_values(base, values)) for name, values in CHANGES.items()}


@pytest.fixture
def files(runs, tmp_path):
    for name, run in runs.items():
        write_recording(run, tmp_path / f"{name}.mcap")
    return tmp_path


def test_a_recording_and_itself_are_identical(slipgrasp, files, runs):
    done = slipgrasp("diff", "base.mcap", "base.mcap", "--json")
    assert done.returncode == 0
    base = runs["base"]
    assert json.loads(done.stdout) == json.loads(json.dumps(compare(base, base).to_mapping()))

    told = slipgrasp("diff", "base.mcap", "base.mcap")
    assert (told.returncode, told.stdout.count("\n")) == (0, 1)
    assert "all numbers are equal" in told.stdout


def test_the_words_name_parameter_phase_change_first_column_and_metric(slipgrasp, files, runs):
    done = slipgrasp("diff", "base.mcap", "slipperier.mcap")

    assert done.returncode == 1
    lines = [line.split() for line in done.stdout.splitlines()]
    assert ["fingers.0.friction", "0.25", "0.2525"] in lines
    assert any(
        " ".join(words).startswith("contact 1 right: slip backward to stick") for words in lines
    )
    first = compare(runs["base"], runs["slipperier"]).to_mapping()["first_divergence"]["error_x"]
    assert 0.015 < first <= 0.02
    assert any(words[:2] == [f"{first:g}", "s"] and "error_x" in words for words in lines)
    assert any(words[:1] == ["slip_path"] for words in lines)
    assert done.stdout.startswith("Different from 0 s on (object_acceleration_x first)")


def test_another_rate_is_equal_and_the_parameter_has_its_unit(slipgrasp, files):
    done = slipgrasp("diff", "base.mcap", "slower.mcap")

    assert done.returncode == 0
    assert done.stdout.startswith("Equal within the integration error")
    assert ["simulation.output_rate", "200", "50", "Hz"] in [
        line.split() for line in done.stdout.splitlines()
    ]


def test_the_tolerance_decides(slipgrasp, files):
    done = slipgrasp("diff", "base.mcap", "slipperier.mcap", "--tolerance", "1000")
    assert done.returncode == 0
    assert done.stdout.startswith("Equal within 1000")


@pytest.mark.parametrize("tolerance", ["nan", "-1"])
def test_a_tolerance_that_is_none_is_refused(in_process, files, tolerance):
    done = in_process("diff", "base.mcap", "base.mcap", f"--tolerance={tolerance}")

    assert (done.returncode, done.stdout) == (2, "")
    assert "tolerance" in done.stderr and done.stderr.count("\n") == 1


def test_stored_runs_are_found_by_their_ids(slipgrasp):
    paths = [
        slipgrasp.run_json("paper-case-1", "--set", f"simulation.duration={duration}")["recording"]
        for duration in ("0.1", "0.2")
    ]
    ids = [path.rpartition("/")[2].removesuffix(".mcap") for path in paths]

    assert slipgrasp("diff", ids[0], ids[0]).returncode == 0
    done = slipgrasp("diff", *ids)
    assert done.returncode == 1
    assert "a ends at 0.1 s, b at 0.2 s" in done.stdout


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ("missing.mcap", "there is no recording 'missing.mcap'"),
        ("abcdefghijkl", "there is no recording 'abcdefghijkl'"),
        ("cut.mcap", "is damaged"),
        ("text.mcap", "not an MCAP file"),
    ],
)
def test_what_cannot_be_read_exits_2_in_one_line(in_process, files, other, message):
    data = (files / "base.mcap").read_bytes()
    (files / "cut.mcap").write_bytes(data[: len(data) // 2])
    (files / "text.mcap").write_text("just some text")

    done = in_process("diff", "base.mcap", other)

    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr.splitlines()[-1] and "Traceback" not in done.stderr


def test_the_figure_is_drawn_in_the_format_of_its_name(slipgrasp, files):
    done = slipgrasp("diff", "base.mcap", "slipperier.mcap", "--figure", "both.pdf")
    assert done.returncode == 1
    assert (files / "both.pdf").read_bytes().startswith(b"%PDF")

    again = slipgrasp("diff", "base.mcap", "slipperier.mcap", "--figure", "both.pdf")
    assert again.returncode == 2 and "already exists" in again.stderr
    wrong = slipgrasp("diff", "base.mcap", "slipperier.mcap", "--figure", "both.bmp")
    assert wrong.returncode == 2 and ".svg, .pdf or .png" in wrong.stderr


def test_a_recording_that_contradicts_itself_is_not_equal_and_told_of(slipgrasp, files, runs):
    base = runs["base"]
    forged = replace(base, metrics=replace(base.metrics, slip_path=(5.0, 0.0)))
    write_recording(forged, files / "forged.mcap")

    done = slipgrasp("diff", "base.mcap", "forged.mcap")
    assert done.returncode == 1
    assert "Run b contradicts itself: slip_path_0 is stated as 5.0" in done.stdout
    alone = slipgrasp("diff", "forged.mcap", "forged.mcap", "--json")
    assert alone.returncode == 1
    assert {(c["run"], c["what"]) for c in json.loads(alone.stdout)["contradictions"]} == {
        (run, f"slip_path_{contact}") for run in "ab" for contact in (0, 1)
    }
