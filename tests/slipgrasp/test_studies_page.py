"""The page on studies: its file runs, its example prints what it says, its maps have their runs."""

import re
from pathlib import Path

import pytest

from slipgrasp.cli.main import main
from slipgrasp.core.study.loading import load_study
from slipgrasp.recordings.study.map_axes import choose_axes
from tests.fenced_blocks import DOCS, blocks_of, output_of

pytestmark = pytest.mark.slow

PAGE = (DOCS / "studies.md").read_text(encoding="utf-8")


def block(kind):
    """The first one of a kind."""
    return blocks_of(PAGE, kind)[0].text


def test_the_file_of_the_page_runs_and_its_example_prints_what_the_page_says(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    Path("study.toml").write_text(block("toml"), encoding="utf-8")
    assert main(["study", "study.toml", "--executor", "inline", "--output", "done"]) == 0
    capsys.readouterr()

    assert output_of(block("python"), {"__name__": "example"}) == block("text")


def test_the_margin_of_the_page_is_what_its_command_prints(tmp_path, capsys):
    (command,) = re.findall(r"^slipgrasp (margin .*)$", PAGE, re.MULTILINE)
    assert main([*command.split(), "--data-dir", str(tmp_path)]) == 0

    answer, shown = (text.splitlines() for text in (capsys.readouterr().out, block("console")))
    assert answer[:4] == shown[:4]
    assert answer[6:] == shown[6:]
    assert len(answer) == len(shown) == 7


@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("case-1-mass-friction", ("object.mass", "fingers.*.friction")),
        ("case-2-friction", ("fingers.0.friction", "fingers.1.friction")),
    ],
)
def test_each_map_of_the_page_is_made_by_one_command_from_a_file_beside_it(name, axes):
    study = load_study(DOCS / "studies" / f"{name}.toml")

    assert f"slipgrasp study docs/studies/{name}.toml --output" in PAGE
    assert study.num_runs == 7442
    assert "7 442 runs" in PAGE
    assert choose_axes(study) == axes
    preset = "paper-case-1" if "case-1" in name else "paper-case-2"
    assert study.base_name == preset, "the paper's law, as it is printed"
