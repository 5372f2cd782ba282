"""The table of a motion in a CSV file next to the scenario, and every way it can be wrong."""

import json

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.loading import (
    load_scenario,
    scenario_from_mapping,
    scenario_from_toml,
    scenario_to_toml,
    with_values,
)

ROWS = ((0.0, 1.466, 0.366, 0.0), (1.0, 1.5, 0.4, 0.1), (2.5, 1.45, 0.4, 0.0))
LINES = [", ".join(map(str, row)) for row in ROWS]
HEADER = "t, x, y, theta"


def scenario_text(name="moves.csv"):
    text = scenario_to_toml(load_scenario("paper-case-1"))
    text = text.replace('kind = "coast"', 'kind = "table"')
    return text.replace("table = []", f"table = {json.dumps(name)}")


def written(folder, content, name="moves.csv"):
    """A scenario file in a folder, beside it its table."""
    folder.mkdir(exist_ok=True)
    (folder / "scenario.toml").write_text(scenario_text(name), encoding="utf-8")
    raw = content if isinstance(content, bytes) else content.encode()
    (folder / "moves.csv").write_bytes(raw)
    return folder / "scenario.toml"


def error_of(path):
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path)
    (error,) = caught.value.errors
    assert error.field == "trajectory.table"
    assert error.limit
    assert "trajectory.table 'moves.csv'" in error.message or error.value != "moves.csv"
    return error


@pytest.mark.parametrize(
    "content",
    [
        "\n".join(LINES),
        "\n".join([HEADER, *LINES, ""]),
        "\r\n".join(["T [s],X [m],Y [m],Theta [rad]", *LINES]),
        "\ufeff" + "\n\n".join(['"t","x","y","theta"', *LINES]),
    ],
)
def test_a_table_is_read_and_becomes_part_of_the_scenario(tmp_path, content):
    scenario = load_scenario(written(tmp_path, content))
    assert scenario.trajectory.table == ROWS
    assert scenario_from_toml(scenario_to_toml(scenario).encode(), "again") == scenario


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("\n".join([HEADER, LINES[0], "1.0, 1.5, up, 0.1"]), "line 3, column 3 (y): 'up'"),
        ("\n".join([LINES[0], "1.0, nan, 0.4, 0.1"]), "line 2, column 2 (x): 'nan'"),
        ("\n".join([LINES[0], "1.0, 1.5, 0.4"]), "line 2: 3 columns"),
        (LINES[0].replace(",", ";"), "line 1: 1 columns"),
        ("t, theta, x, y\n" + LINES[0], "line 1, column 1 (t): 't'"),
        ("\n".join(LINES[:1] * 251), "line 251: more than 250 rows"),
        (" " * 200_001, "larger than 200 kB"),
        (b"\xff\xfe\x00", "not a text file"),
        ('"' + "1" * 150_000, "line"),
    ],
)
def test_a_bad_table_is_answered_with_line_and_column(tmp_path, content, words):
    assert words in error_of(written(tmp_path, content)).message


def test_an_empty_table_and_bad_rows_are_answered_like_any_field(tmp_path):
    with pytest.raises(ScenarioError, match=r"trajectory\.table is empty"):
        load_scenario(written(tmp_path, HEADER))
    with pytest.raises(ScenarioError, match=r"trajectory\.table\.1\.0.*increase"):
        load_scenario(written(tmp_path, "\n".join([LINES[0], LINES[0]])))


@pytest.mark.parametrize("name", ["../moves.csv", "/etc/hostname", "inside/../../moves.csv"])
def test_nothing_outside_of_the_folder_is_read(tmp_path, name):
    (tmp_path / "moves.csv").write_text("\n".join(LINES))
    error = error_of(written(tmp_path / "scenario", "\n".join(LINES), name))
    assert "outside" in error.message


def test_a_link_that_leads_outside_is_not_followed(tmp_path):
    path = written(tmp_path / "scenario", "")
    (tmp_path / "secret.csv").write_text("\n".join(LINES))
    (path.parent / "moves.csv").unlink()
    (path.parent / "moves.csv").symlink_to(tmp_path / "secret.csv")
    assert "outside" in error_of(path).message


@pytest.mark.parametrize("name", ["none.csv", ".", "", "a\0b", "x" * 5000])
def test_a_file_that_is_not_there_is_one_clear_error(tmp_path, name):
    error = error_of(written(tmp_path, "", name))
    assert "no such file" in error.message
    assert len(error.message) < 300


def test_without_a_folder_no_file_is_looked_up(tmp_path, monkeypatch):
    """What comes over the network, and single values, cannot make the program read files."""
    written(tmp_path, "\n".join(LINES))
    monkeypatch.chdir(tmp_path)
    mapping = load_scenario("paper-case-1").to_mapping()
    mapping["trajectory"] |= {"kind": "table", "table": "moves.csv"}
    attempts = [
        lambda: scenario_from_toml(scenario_text().encode(), "uploaded"),
        lambda: scenario_from_mapping(mapping),
        lambda: with_values(load_scenario("paper-case-1"), {"trajectory.table": "moves.csv"}),
    ]
    for attempt in attempts:
        with pytest.raises(ScenarioError, match="give the rows themselves") as caught:
            attempt()
        assert [error.field for error in caught.value.errors] == ["trajectory.table"]
