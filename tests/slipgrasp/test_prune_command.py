import json

import pytest


def save_runs(command_line, number):
    """Runs of `slipgrasp run` go to files; those of the store are what is pruned."""
    from slipgrasp.core.run.simulator import simulate
    from slipgrasp.core.scenario.loading import load_scenario, with_values
    from slipgrasp.recordings.store.store import RecordingStore

    result = simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.01}))
    return [RecordingStore(command_line.data).save(result).id for _ in range(number)]


def test_what_would_go_is_listed_and_only_deleted_on_request(slipgrasp):
    ids = save_runs(slipgrasp, 3)
    listed = slipgrasp("prune", "--keep-runs", 1)
    assert listed.returncode == 0
    assert [line.split()[0] for line in listed.stdout.splitlines()[:-1]] == [ids[1], ids[0]]
    assert all("(unknown: " in line for line in listed.stdout.splitlines()[:-1])
    assert "2 runs" in listed.stdout and "--delete" in listed.stdout
    assert len(list(slipgrasp.data.glob("*.mcap"))) == 3

    told = json.loads(slipgrasp("prune", "--keep-runs", 1, "--delete", "--json").stdout)
    assert all(run["unknowns"] and run["told"] is False for run in told["runs"])
    assert told["deleted"] and [run["id"] for run in told["runs"]] == [ids[1], ids[0]]
    assert [path.stem for path in slipgrasp.data.glob("*.mcap")] == [ids[2]]
    assert "no runs to delete" in slipgrasp("prune", "--keep-runs", 1).stdout


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((), "prune needs a rule"),
        (("--keep-days", "-1"), "not a number of days"),
        (("--keep-days", "nan"), "not a number of days"),
        (("--keep-runs", "1.5"), "not a number of runs"),
        (("--keep-size", "much"), "is not a size"),
    ],
)
def test_a_rule_that_cannot_be_followed_is_refused_in_one_line(in_process, arguments, reason):
    done = in_process("prune", *arguments)
    assert done.returncode == 2 and done.stdout == ""
    assert reason in done.stderr and done.stderr.count("\n") == 1
