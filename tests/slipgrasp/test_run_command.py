import json
import resource
import signal
from dataclasses import replace

import pytest
from mcap.reader import make_reader

from slipgrasp.core.scenario import CONTROL_LAWS
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import load_scenario, scenario_to_toml, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.file.reader import read_recording

pytestmark = pytest.mark.slow

SHORT = ("paper-case-2", "--set", "simulation.duration=0.3")
LOST_GRIP = (
    *SHORT,
    *("--set", "controller.control_period=0.001", "--set", "fingers.1.friction=0.30"),
    *("--set", "estimates.0.minimum=0.05", "--set", "estimates.0.maximum=2"),
    *("--set", "estimates.1.minimum=0.05", "--set", "estimates.1.maximum=2"),
    *("--set", "estimates.2.minimum=0.05", "--set", "estimates.2.maximum=10"),
    *("--set", "estimates.3.minimum=0.002", "--set", "estimates.3.maximum=0.2"),
)
KEYS = {
    "law",
    "unknowns",
    "told",
    *("outcome", "reason", "end_time", "phase_changes", "estimates", "recording", "metrics"),
    *("warnings", "name", "sha256"),
}
METRICS = {
    *("held", "slipping_at_end", "last_slip_time", "slip_path", "peak_normal_force"),
    *("minimum_friction_margin", "rms_tracking_error", "final_tracking_error"),
    *("torque_effort", "phase_change_count", "spin_path", "spin_end"),
}


def test_a_completed_run_prints_the_json_of_the_contract_and_its_recording_holds_the_same(
    slipgrasp,
):
    result = slipgrasp.run_json(*SHORT)

    assert set(result) == KEYS
    assert set(result["metrics"]) == METRICS
    assert result["name"] == "paper-case-2 · duration 0.3 s"
    assert result["outcome"] == "completed"
    assert result["reason"] is None
    assert result["end_time"] == 0.3
    assert set(result["phase_changes"][0]) == {"time", "contact", "from", "to"}
    assert set(result["estimates"]) == {
        *("fingers.0.friction", "fingers.1.friction", "object.mass", "object.inertia")
    }

    recording = slipgrasp.data / result["recording"]
    assert recording.parent == slipgrasp.data
    recorded = read_recording(recording)
    summary = {**recorded.summary(), "sha256": recorded.sha256}
    assert json.loads(json.dumps(summary)) == {k: result[k] for k in KEYS - {"recording"}}


def test_the_data_directory_can_be_chosen_on_the_command_line(slipgrasp, tmp_path):
    result = slipgrasp.run_json(*SHORT, "--data-dir", tmp_path / "elsewhere")

    assert result["recording"].startswith(str(tmp_path / "elsewhere"))
    assert slipgrasp.saved() == []


def test_a_run_that_physics_ends_early_exits_with_3_and_is_kept(slipgrasp):
    result = slipgrasp.run_json(*LOST_GRIP, status=3)

    assert result["outcome"] == "separated"
    assert set(result["reason"]) == {
        *("code", "message", "contact", "time", "value", "limit", "hint")
    }
    assert read_recording(slipgrasp.data / result["recording"]).outcome is Outcome.SEPARATED


def test_a_run_at_its_step_limit_exits_with_4_and_is_kept(slipgrasp):
    result = slipgrasp.run_json("paper-case-1", "--set", "simulation.max_steps=50", status=4)

    assert result["outcome"] == "limit"
    assert read_recording(slipgrasp.data / result["recording"]).outcome is Outcome.LIMIT


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_exits_with_4_and_keeps_what_there_is(slipgrasp, number):
    long_run = ("simulation.duration=600", "controller.control_period=0.0001")
    process = slipgrasp.start(
        *("run", "paper-case-1", "--json", "--set", long_run[0], "--set", long_run[1])
    )
    with process:
        while "simulating" not in process.stderr.readline():
            assert process.poll() is None
        process.send_signal(number)
        result = json.loads(process.stdout.read())

    assert process.returncode == 4
    assert result["outcome"] == result["reason"]["code"] == "stopped"
    recorded = read_recording(slipgrasp.data / result["recording"])
    assert recorded.outcome is Outcome.STOPPED
    assert 0.0 < recorded.end_time < 600.0


def test_a_full_disk_exits_with_4_and_still_tells_the_result(slipgrasp):
    def no_large_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    done = slipgrasp("run", *SHORT, "--json", preexec_fn=no_large_files)

    assert done.returncode == 4
    assert "not saved" in done.stderr
    result = json.loads(done.stdout)
    assert result["recording"] is None
    assert result["metrics"]["phase_change_count"] == 4
    assert [warning["code"] for warning in result["warnings"]] == ["not_saved"]
    assert slipgrasp.saved() == []


BAD_INPUT = {
    "object.mass=-1": "object.mass is -1",
    "object.mass=heavy": "object.mass is 'heavy'",
    "object.mas=1": "did you mean 'object.mass'?",
    "controller.kind=theorem-5": "theorem-3, theorem-4",
    "estimates.0.parameter=fingers.0.link_masses.0": "cannot be estimated together",
    "fingers.0.friction=none": "fingers.0.friction",
    "simulation.duration": "--set needs KEY=VALUE",
}


@pytest.mark.parametrize("assignment", BAD_INPUT)
def test_bad_input_exits_with_2_in_one_clear_line_and_saves_nothing(
    slipgrasp, in_process, assignment
):
    done = in_process("run", "paper-case-2", "--json", "--set", assignment)

    assert done.returncode == 2
    assert done.stdout == ""
    assert BAD_INPUT[assignment] in done.stderr
    assert done.stderr.count("\n") == 1
    assert slipgrasp.saved() == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run",), "SCENARIO"),
        (("run", "paper-case-3"), "did you mean"),
        (("run", "nothing.toml"), "no scenario file"),
        (("run", "paper-case-1", "--frobnicate"), "--frobnicate"),
        (("run", "paper-case-1", "--output", "no/where.mcap"), "there is no folder"),
        (("run", "paper-case-1", "--output", "."), "is a folder"),
        (("run", "paper-case-1", "--data-dir", "/proc/nothing"), "/proc/nothing"),
        ((), "COMMAND"),
        (("simulate",), "invalid choice"),
    ],
)
def test_bad_arguments_exit_with_2_in_one_clear_line(in_process, arguments, message):
    done = in_process(*arguments)

    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


def test_an_existing_output_is_replaced_only_by_force(slipgrasp, tmp_path):
    (tmp_path / "mine.mcap").write_text("precious")
    done = slipgrasp("run", "paper-case-1", "--output", "mine.mcap")
    assert done.returncode == 2
    assert "already exists" in done.stderr
    assert (tmp_path / "mine.mcap").read_text() == "precious"
    result = slipgrasp.run_json(*SHORT, "--output", "mine.mcap", "--force")

    assert result["recording"] == str(tmp_path / "mine.mcap")
    assert read_recording(tmp_path / "mine.mcap").outcome is Outcome.COMPLETED
    assert slipgrasp.saved() == []


def test_values_reach_the_scenario_with_the_types_they_should_have(slipgrasp):
    result = slipgrasp.run_json(
        *(*SHORT, "--set", "title=5", "--set", "controller.position_gain=[100, 90.5, 80]"),
        *("--set", "estimates.0.maximum=2", "--set", "estimates.0.maximum=none"),
        *("--set", "simulation.duration=.2"),
    )
    scenario = read_recording(slipgrasp.data / result["recording"]).scenario
    assert scenario.title == "5"
    assert scenario.controller.position_gain == (100.0, 90.5, 80.0)
    assert scenario.estimates[0].maximum is None
    assert scenario.simulation.duration == 0.2


def test_without_json_the_result_is_told_in_words(slipgrasp):
    done = slipgrasp("run", *SHORT, "--set", "title=Mine")
    assert done.returncode == 0
    assert done.stdout.splitlines()[0].startswith("Mine")
    assert done.stdout.splitlines()[1] == ""
    (recording,) = (path for path in slipgrasp.saved() if path.suffix == ".mcap")
    assert "Completed at 0.3 s" in done.stdout
    assert "47.23 mm" in done.stdout
    assert "object.mass" in done.stdout
    assert str(recording) in done.stdout


def test_an_early_end_is_told_in_words_with_what_to_try(slipgrasp):
    done = slipgrasp("run", *LOST_GRIP)

    assert done.returncode == 3
    assert "Ended early" in done.stdout
    assert "What to try" in done.stdout


def test_a_suggested_command_names_the_scenario_with_its_law(slipgrasp):
    done = slipgrasp("run", "paper-case-2", "--law", "composite", "--set", "simulation.duration=2")

    command = "slipgrasp margin paper-case-2 --law composite --set simulation.duration=2 --over "
    assert f"{command}'fingers.*.friction'" in done.stdout


def test_the_help_of_run_lists_the_parameters_with_unit_and_bounds(slipgrasp):
    done = slipgrasp("run", "--help")

    assert done.returncode == 0
    assert "object.mass  (0.001 … 1000 kg)" in done.stdout
    assert "controller.grasp_force  (one of minimum, none)" in done.stdout
    assert "pulses.0.duration  (0.0001 … 600 s)" in done.stdout
    assert "trajectory.start.2  (-3.2 … 3.2 rad)" in done.stdout
    assert "object.height  (0.001 … 10 m)" in done.stdout
    assert done.stdout.count("\n  object.mass  ") == 1


@pytest.mark.parametrize(
    ("arguments", "rate"),
    [((), 50.0), (("--display-rate", "10"), 10.0), (("--display-rate", "0"), 0)],
)
def test_the_recording_shows_the_hand_at_the_display_rate(slipgrasp, arguments, rate):
    result = slipgrasp.run_json(*SHORT, *arguments)

    with (slipgrasp.data / result["recording"]).open("rb") as stream:
        summary = make_reader(stream).get_summary()
    by_topic = {
        channel.topic: summary.statistics.channel_message_counts.get(channel.id, 0)
        for channel in summary.channels.values()
    }
    expected = 0.3 * rate + 1 if rate else None
    assert by_topic.get("/tf") == by_topic.get("/scene") == expected


@pytest.mark.parametrize("rate", ["-1", "nan", "fast", "1e4"])
def test_a_display_rate_out_of_bounds_is_refused(in_process, rate):
    done = in_process("run", *SHORT, f"--display-rate={rate}")

    assert done.returncode == 2
    assert "allowed: 0 … 1000 Hz" in done.stderr


def test_a_law_comes_with_its_settings_in_one_line_and_what_is_set_wins(slipgrasp):
    done = slipgrasp("run", *SHORT, "--law", "composite", "--set", "controller.grip_safety=1.2")

    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[0] == (
        "slipgrasp: composite: control every 1 ms, grip safety 1.05, distribution hold, estimates "
        "within physical bounds; unknown: friction, mass, inertia"
    )
    (recording,) = (path for path in slipgrasp.saved() if path.suffix == ".mcap")
    scenario = read_recording(recording).scenario
    values = {"simulation.duration": 0.3, "controller.grip_safety": 1.2}
    assert scenario == with_values(with_law(load_scenario("paper-case-2"), "composite"), values)


def test_a_run_without_estimates_says_that_everything_was_given(slipgrasp):
    scenario = replace(load_scenario("paper-case-2"), estimates=())
    file = slipgrasp.folder / "blind.toml"
    file.write_text(scenario_to_toml(with_values(scenario, {"simulation.duration": 0.1})))
    given = "given the true friction and mass at every instant"

    done = slipgrasp("run", file, "--law", "composite")
    first = done.stderr.splitlines()[0]
    assert first.endswith(f"; nothing unknown, {given}")
    assert f"The controller was {given}; nothing was unknown to it." in done.stdout
    told = slipgrasp.run_json(file)
    assert (told["unknowns"], told["told"]) == ([], True)
    # What is set after the law may make its model wrong.
    wrong = ("--set", "controller.link_mass_ratio=1.2")
    line = slipgrasp("run", file, "--law", "composite", *wrong).stderr.splitlines()[0]
    assert line.endswith("; unknown: link masses")


def test_the_kind_alone_keeps_its_plain_meaning(in_process):
    done = in_process("run", *SHORT, "--set", "controller.kind=composite")

    assert done.returncode == 2
    assert "needs sampled control" in done.stderr


@pytest.mark.parametrize(
    "command", [("run",), ("margin", "--over=object.mass", "--from=1", "--to=2")]
)
def test_a_law_that_does_not_exist_exits_with_2_and_lists_those_that_do(in_process, command):
    done = in_process(command[0], "paper-case-2", *command[1:], "--law", "nonsense")

    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "'nonsense' is not a control law" in done.stderr
    assert all(kind in done.stderr for kind in CONTROL_LAWS)
