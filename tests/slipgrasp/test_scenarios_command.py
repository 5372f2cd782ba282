from dataclasses import replace

import pytest

from slipgrasp.core.scenario.loading import all_preset_names, load_scenario, preset_text


def test_scenarios_lists_the_presets_with_their_titles(slipgrasp):
    done = slipgrasp("scenarios")

    listed = dict(line.split("\t") for line in done.stdout.splitlines())
    assert listed == {name: load_scenario(name).title for name in all_preset_names()}


@pytest.mark.slow
@pytest.mark.parametrize("name", all_preset_names())
def test_a_shown_preset_is_a_file_that_loads_to_the_same_scenario(in_process, tmp_path, name):
    (tmp_path / "mine.toml").write_text(in_process("scenarios", "show", name).stdout)

    assert load_scenario(tmp_path / "mine.toml") == load_scenario(name)


@pytest.mark.slow
def test_a_shown_preset_runs_to_the_identical_recording(slipgrasp, tmp_path):
    (tmp_path / "mine.toml").write_text(slipgrasp("scenarios", "show", "paper-case-1").stdout)

    for scenario, output in (("paper-case-1", "preset.mcap"), ("mine.toml", "mine.mcap")):
        slipgrasp.run_json(scenario, "--set", "simulation.duration=0.3", "--output", output)

    assert (tmp_path / "preset.mcap").read_bytes() == (tmp_path / "mine.mcap").read_bytes()


def test_every_parameter_is_listed_with_value_bounds_and_meaning(slipgrasp):
    done = slipgrasp("scenarios", "parameters", "paper-case-2")

    rows = [line.split("\t") for line in done.stdout.splitlines()]
    assert all(len(row) == 4 for row in rows)
    table = {row[0]: row[1:] for row in rows}
    assert table["fingers.1.friction"][:2] == ["0.25", "0 … 10"]
    assert table["estimates.0.maximum"][0] == "none"


def test_an_unknown_preset_is_refused_with_the_nearest_name(slipgrasp):
    done = slipgrasp("scenarios", "show", "paper-case-9")

    assert done.returncode == 2
    assert "did you mean 'paper-case-" in done.stderr


@pytest.mark.parametrize("name", all_preset_names())
def test_a_new_scenario_is_its_preset_with_a_comment_for_each_key(in_process, tmp_path, name):
    file = tmp_path / "mine.toml"
    assert in_process("scenarios", "new", file, "--from", name).returncode == 0

    assert replace(load_scenario(file), title="") == replace(load_scenario(name), title="")
    keys = [line.partition(" = ")[0] for line in preset_text(name).splitlines() if " = " in line]
    lines = file.read_text().splitlines()
    for key in set(keys) - {"title"}:
        first = next(i for i, line in enumerate(lines) if line.startswith(f"{key} = "))
        assert lines[first - 1].startswith("# ") and lines[first - 1].endswith("."), key


def test_a_new_scenario_says_what_it_needs(in_process, tmp_path):
    file = tmp_path / "mine.toml"
    done = in_process("scenarios", "new", file)
    assert f"slipgrasp run {file}" in done.stdout
    text = file.read_text()
    assert "# True mass of the object (0.001 … 1000 kg).\nmass = 1.0\n" in text

    for arguments, words in (
        ((file,), "exists; choose another name"),
        (("mine.json",), "does not end in .toml"),
        (("other.toml", "--from", "composite-case"), "did you mean"),
    ):
        refused = in_process("scenarios", "new", *arguments)
        assert refused.returncode == 2 and words in refused.stderr
    assert file.read_text() == text
