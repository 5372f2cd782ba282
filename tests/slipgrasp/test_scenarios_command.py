import pytest

from slipgrasp.core.scenario.loading import all_preset_names, load_scenario


def test_scenarios_lists_the_presets_with_their_titles(slipgrasp):
    done = slipgrasp("scenarios")

    listed = dict(line.split("\t") for line in done.stdout.splitlines())
    assert listed == {name: load_scenario(name).title for name in all_preset_names()}


@pytest.mark.slow
@pytest.mark.parametrize("name", all_preset_names())
def test_a_shown_preset_is_a_file_that_loads_to_the_same_scenario(slipgrasp, tmp_path, name):
    (tmp_path / "mine.toml").write_text(slipgrasp("scenarios", "show", name).stdout)

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
