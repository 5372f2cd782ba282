"""``slipgrasp page`` as its users meet it; the page itself: tests/web/test_page_in_a_browser.py."""

import json
import re

import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.writer import write_recording

pytestmark = pytest.mark.slow


def test_a_page_is_written_and_its_hash_is_printed(slipgrasp):
    done = slipgrasp("page", "paper-case-1", "--output", "hold.html")

    assert done.returncode == 0, done.stderr
    sha256 = simulate(load_scenario("paper-case-1")).sha256
    assert re.fullmatch(rf"hold\.html: \d\.\d\d MB, SHA-256 of its run {sha256}\n", done.stdout)
    page = (slipgrasp.folder / "hold.html").read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    assert "<title>paper-case-1 – slipgrasp</title>" in page


def test_a_recording_is_simulated_again(slipgrasp):
    scenario = with_values(load_scenario("paper-case-2"), {"simulation.duration": 0.2})
    result = simulate(scenario)
    write_recording(result, slipgrasp.folder / "run.mcap")

    done = slipgrasp("page", "run.mcap", "--controls", "object.mass", "--output", "run.html")

    assert done.returncode == 0, done.stderr
    assert result.sha256 in done.stdout


def test_a_run_writes_its_page_too(slipgrasp):
    done = slipgrasp(
        "run", "paper-case-1", "--set", "object.mass=1.1", "--json", "--page", "hold.html"
    )

    assert done.returncode == 0, done.stderr
    sha256 = json.loads(done.stdout)["sha256"]
    assert f"SHA-256 of its run {sha256}" in done.stderr
    page = (slipgrasp.folder / "hold.html").read_text(encoding="utf-8")
    assert "<title>paper-case-1 · mass 1.1 kg" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["paper-case-1", "--output", "no/page.html"], "an existing folder"),
        (["wet-patch", "--output", "page.html"], "patches"),
        (["paper-case-1", "--controls", "object.colour", "--output", "page.html"], "one number"),
        (["paper-case-1"], "--output"),
    ],
)
def test_bad_input_is_refused_in_one_line(slipgrasp, in_process, arguments, words):
    done = in_process("page", *arguments)

    assert done.returncode == 2
    assert words in done.stderr.splitlines()[-1]
    assert not (slipgrasp.folder / "page.html").exists()


def test_a_file_is_not_replaced_unless_that_is_wanted(slipgrasp):
    (slipgrasp.folder / "page.html").write_text("mine")
    done = slipgrasp("page", "paper-case-1", "--output", "page.html")

    assert done.returncode == 2
    assert "--force" in done.stderr
    assert (slipgrasp.folder / "page.html").read_text() == "mine"
