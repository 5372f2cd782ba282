"""A small sample of what recordings survive; ``python -m benchmarks faults`` does it all."""

import inspect
import itertools
import shutil
import string
import sys

import pytest

from benchmarks.faults import CAMPAIGNS, survivors
from benchmarks.faults.bombs import BOMBS, MAX_MEGABYTES, WHOLE_BOMBS, defuse, write_bombs
from benchmarks.faults.clients import hold_connections, read_signals
from benchmarks.faults.clock import jump_while_serving
from benchmarks.faults.damage import cut_everywhere, flip_bits
from benchmarks.faults.disk import cut_the_power, fail_every_write
from benchmarks.faults.kills import kill_writers
from benchmarks.faults.services import fill_the_disk, restart_with_unfinished, stop_runs
from slipgrasp.recordings.file.reader import read_recording

pytestmark = pytest.mark.slow


def test_what_a_killed_process_had_flushed_is_read_to_the_last_sample():
    kills = kill_writers(1, seed=3, duration=75.0)
    assert kills["readable"] == kills["count"] == 1
    assert kills["fewest"] > 1000


def test_what_survives_a_kill_at_any_instant_has_the_bytes_of_an_undisturbed_run(monkeypatch):
    monkeypatch.setitem(survivors.VALUES, "simulation.duration", 20.0)
    found = survivors.kill_and_compare(at_random=1, in_last_second=1, seed=5)
    assert found["whole"] + found["recovered"] + found["nothing"] == 2


def test_files_cut_off_anywhere_are_refused_and_unfinished_ones_give_a_prefix():
    cuts = cut_everywhere(step=997)
    assert cuts["finished"] > 15
    assert min(cuts["prefixes"], cuts["empty"]) > 4


def test_flipped_bits_are_refused_or_change_nothing():
    flips = flip_bits(60, seed=3)
    assert flips["refused"] + flips["identical"] == flips["count"]
    assert 0 < flips["recovered"] < flips["count"]


def test_a_disk_that_fails_at_any_write_leaves_a_prefix():
    failures = fail_every_write(duration=10.0, step=12)
    assert min(failures["readable"], failures["empty"]) > 0


def test_a_power_cut_loses_no_more_than_the_time_between_two_syncs():
    # A clock that no machine's speed moves.
    clock = (0.005 * look for look in itertools.count()).__next__
    assert 0.0 < cut_the_power(seed=3, duration=10.0, clock=clock)["loss"] < 1.3


@pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="takes the clock's place (Linux)"
)
def test_a_wall_clock_that_jumps_changes_no_run_and_no_study():
    jumps = jump_while_serving(3)
    assert jumps["runs"] == 6
    assert 0.0 < jumps["furthest"] <= 2 * jumps["jump"] + 1.0


def test_an_endless_run_is_kept_as_stopped_soon_after_somebody_stops_it():
    assert stop_runs(1)["p95"] > 0.0


def test_hostile_files_are_refused_in_little_memory(tmp_path):
    paths = write_bombs(tmp_path)
    assert len(paths) == len(BOMBS) >= 10
    for name, path in paths.items():
        _, megabytes, findings = defuse(path)
        assert megabytes < MAX_MEGABYTES, name
        assert all(len(finding) < 500 for finding in findings), name


def test_a_file_that_states_more_than_its_scenario_gives_is_refused_unread(tmp_path):
    for path in write_bombs(tmp_path, WHOLE_BOMBS).values():
        _, megabytes, findings = defuse(path, [read_recording])
        assert "it states 10000" in findings[0]
        assert megabytes < MAX_MEGABYTES


def test_a_crowd_that_asks_for_nothing_keeps_nobody_from_being_answered():
    crowd = hold_connections(idle=30, slow=10, seconds=0.2)
    assert crowd["log"] < 10.0


def test_readers_of_one_recording_share_it():
    readers = read_signals(clients=6, duration=1.0, names="t,slip")
    assert readers["statuses"] == "6 answered 200"


def test_large_unfinished_recordings_are_recovered_behind_the_answers():
    restart = restart_with_unfinished(count=2, duration=0.5)
    assert restart["count"] == 2
    assert restart["waited"] <= restart["seconds"]


def test_no_run_is_told_as_completed_where_the_disk_takes_no_more():
    full = fill_the_disk(runs=1)
    assert (full["refused"], full["failed"], full["left"]) == (1, 1, 0)


@pytest.mark.parametrize("campaign", CAMPAIGNS, ids=lambda campaign: campaign.happens)
def test_the_text_about_a_campaign_names_only_what_its_function_returns(campaign):
    documented = inspect.getdoc(getattr(campaign.work, "func", campaign.work))
    text = campaign.happens + campaign.left
    names = {name for _, name, _, _ in string.Formatter().parse(text) if name}
    assert names and all(f"``{name}``" in documented for name in names)
