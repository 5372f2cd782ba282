import pytest

from slipgrasp.cli import figures
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_to_toml, with_values
from slipgrasp.figures.files import FORMATS
from slipgrasp.recordings.file.writer import write_recording
from tests.slipgrasp.conftest import without_waiting

pytestmark = pytest.mark.slow

PAPER_CASE_1 = ("fig-4-schematic", "fig-5-tracking", "fig-6-estimates", "fig-7-forces", "premises")
OTHER = ("schematic", "tracking", "estimates", "forces", "premises")


@pytest.fixture
def scenario_file(tmp_path):
    scenario = with_values(load_scenario("paper-case-2"), {"simulation.duration": 0.2})
    path = tmp_path / "short.toml"
    path.write_text(scenario_to_toml(scenario))
    return path


def names(printed):
    return [line.rpartition("/")[2] for line in printed.splitlines()]


def test_a_preset_gives_the_papers_figures_in_a_folder_of_its_name(slipgrasp):
    done = slipgrasp("figures", "paper-case-1")

    assert done.returncode == 0, done.stderr
    assert names(done.stdout) == [f"{name}.{f}" for name in PAPER_CASE_1 for f in FORMATS]
    for line in done.stdout.splitlines():
        assert line.startswith("paper-case-1-figures")
        assert (slipgrasp.folder / line).stat().st_size > 10_000


def test_formats_are_chosen_figures_drawn_anew_and_those_of_a_recording_are_the_same(
    slipgrasp, scenario_file, tmp_path
):
    recording, command = tmp_path / "run.mcap", ("figures", scenario_file, "--format")
    write_recording(simulate(load_scenario(scenario_file)), recording)
    simulated = slipgrasp(*command, "svg")
    recorded = slipgrasp("figures", recording, "--format", "svg", "--output", "recorded")

    assert simulated.returncode == recorded.returncode == 0
    assert names(simulated.stdout) == names(recorded.stdout) == [f"{name}.svg" for name in OTHER]
    for name in names(simulated.stdout):
        files = [slipgrasp.folder / folder / name for folder in ("short-figures", "recorded")]
        assert files[0].read_bytes() == files[1].read_bytes()

    again = slipgrasp(*command, "PNG, svg")

    assert again.returncode == 0, again.stderr
    assert names(again.stdout) == [f"{name}.{f}" for name in OTHER for f in ("png", "svg")]
    folder = slipgrasp.folder / "short-figures"
    assert sorted(path.name for path in folder.iterdir()) == sorted(names(again.stdout))


def test_somebody_elses_file_is_in_the_way_until_forced(slipgrasp, scenario_file):
    folder = slipgrasp.folder / "mine"
    folder.mkdir()
    (folder / "forces.svg").write_text("<svg>drawn by hand</svg>")
    command = ("figures", scenario_file, "--output", folder, "--format", "svg")

    refused = slipgrasp(*command)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "already exists" in refused.stderr
    assert [path.name for path in folder.iterdir()] == ["forces.svg"]

    assert slipgrasp(*command, "--force").returncode == 0
    assert "drawn by hand" not in (folder / "forces.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.mcap"], "there is no recording"),
        (["paper-case-1", "--format", "jpg"], "unknown format 'jpg'; use svg, pdf, png"),
        (["paper-case-1", "--output", "damaged.mcap"], "it is a file, not a folder"),
        (["paper-case-1", "--output", "damaged.mcap/below"], "cannot write 'damaged.mcap/below'"),
        ([], "SOURCE"),
    ],
)
def test_bad_input_exits_with_2_in_one_clear_line(slipgrasp, in_process, arguments, message):
    (slipgrasp.folder / "damaged.mcap").write_bytes(b"not a recording at all")
    done = in_process("figures", *arguments)

    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr
    assert without_waiting(done.stderr).count("\n") == 1
    assert [path.name for path in slipgrasp.folder.iterdir()] == ["damaged.mcap"]


def test_the_command_offers_every_format_there_is():
    assert figures.FORMATS == FORMATS
