"""What a killed writer, a cut or a damaged block leaves is kept, and never as more than it is."""

import random
import shutil
from dataclasses import asdict
from pathlib import Path

import pytest

from benchmarks.faults.damage import assert_prefix, small_run, write_part
from benchmarks.faults.disk import KINDS, FailingFile, growing_files
from slipgrasp.core.file_lock import try_lock
from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import (
    AlteredRecordingError,
    DamagedRecordingError,
    NothingToRecoverError,
    RecordingBusyError,
    RecordingError,
)
from slipgrasp.recordings.file import atomic_file, writer
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.file.reader import read_back, read_recording, read_unfinished
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.file.recovery import recover, recover_orphans
from slipgrasp.recordings.file.writer import RecordingWriter, write_recording
from tests.recordings.tampering import repack

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def small():
    return small_run()


@pytest.fixture(scope="module")
def part(small, tmp_path_factory):
    """What a writer leaves that is stopped before it can end the file, in small chunks."""
    path = tmp_path_factory.mktemp("part") / "run.mcap"
    write_part(small, path)
    return part_of(path)


def test_what_was_flushed_of_an_unfinished_file_is_read(part, small):
    result = read_unfinished(part).result

    assert result.outcome is Outcome.RECOVERED
    assert result.reason is not None and result.reason.code == "worker_died"
    assert len(result.trace) == len(small.trace)
    assert_prefix(result, small)


def test_a_file_cut_off_anywhere_gives_a_prefix_or_says_that_nothing_is_left(part, small, tmp_path):
    data = part.read_bytes()
    cut = tmp_path / "cut.mcap"
    lengths = []
    for length in range(0, len(data), 131):
        cut.write_bytes(data[:length])
        try:
            result = read_unfinished(cut).result
        except RecordingError:
            lengths.append(0)
            continue
        assert_prefix(result, small)
        lengths.append(len(result.trace))
    assert lengths == sorted(lengths)
    assert len(set(lengths)) >= 5


def test_no_flipped_bit_makes_an_unfinished_file_tell_something_else(part, small, tmp_path):
    data = part.read_bytes()
    flipped = tmp_path / "flipped.mcap"
    source = random.Random(2)
    recovered = 0
    for _ in range(120):
        damaged = bytearray(data)
        damaged[source.randrange(len(data))] ^= 1 << source.randrange(8)
        flipped.write_bytes(damaged)
        try:
            result = read_unfinished(flipped).result
        except RecordingError:
            continue
        assert_prefix(result, small)
        recovered += 1
    assert 0 < recovered < 120


def test_a_whole_run_whose_index_is_missing_is_recovered_as_it_ended(small, tmp_path):
    write_recording(small, tmp_path / "run.mcap")
    data = (tmp_path / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[:-300])
    with pytest.raises(DamagedRecordingError, match="slipgrasp recover"):
        read_recording(tmp_path / "cut.mcap")

    recover(tmp_path / "cut.mcap", tmp_path / "new.mcap")

    assert (tmp_path / "new.mcap").read_bytes() == data


def test_recovering_leaves_the_original_and_refuses_to_replace(part, small, tmp_path):
    source = tmp_path / "run.mcap.part"
    shutil.copy(part, source)
    before = source.read_bytes()

    recovered = recover(source, tmp_path / "run.mcap")

    assert source.read_bytes() == before
    assert read_recording(recovered.path).outcome is Outcome.RECOVERED
    with pytest.raises(RecordingError, match="already exists"):
        recover(source, tmp_path / "run.mcap")


def test_there_is_nothing_to_recover_from_a_whole_or_an_empty_recording(small, tmp_path):
    write_recording(small, tmp_path / "whole.mcap")
    with pytest.raises(NothingToRecoverError, match="whole"):
        recover(tmp_path / "whole.mcap", tmp_path / "new.mcap")

    with (
        pytest.raises(KeyboardInterrupt),
        RecordingWriter(tmp_path / "run.mcap", small.scenario, small.trace.shape, keep_part=True),
    ):
        raise KeyboardInterrupt
    with pytest.raises(NothingToRecoverError, match="before its first sample"):
        recover(tmp_path / "run.mcap.part", tmp_path / "new.mcap")
    assert not (tmp_path / "new.mcap").exists()


def test_orphans_become_recordings_of_their_age_and_their_parts_go(part, small, tmp_path):
    orphan = tmp_path / "abc.mcap.part"
    shutil.copy2(part, orphan)
    modified = orphan.stat().st_mtime_ns

    (found,) = recover_orphans(tmp_path)

    assert found.path == tmp_path / "abc.mcap"
    assert found.path.stat().st_mtime_ns == modified
    assert_prefix(read_recording(found.path), small)
    assert [file.name for file in tmp_path.iterdir()] == ["abc.mcap"]


def test_a_part_that_is_being_written_is_left_alone(part, tmp_path):
    growing = tmp_path / "abc.mcap.part"
    shutil.copy(part, growing)
    with growing.open("ab") as stream:
        assert try_lock(stream)
        assert recover_orphans(tmp_path) == []
    assert [file.name for file in tmp_path.iterdir()] == [growing.name]


def test_a_part_that_lacks_only_its_name_becomes_the_recording_it_is(small, tmp_path):
    write_recording(small, tmp_path / "abc.mcap")
    data = (tmp_path / "abc.mcap").read_bytes()
    (tmp_path / "abc.mcap").rename(tmp_path / "abc.mcap.part")

    recover_orphans(tmp_path)

    assert [file.name for file in tmp_path.iterdir()] == ["abc.mcap"]
    assert (tmp_path / "abc.mcap").read_bytes() == data


def test_a_part_that_was_recovered_by_hand_goes_at_the_next_start(part, small, tmp_path):
    shutil.copy(part, tmp_path / "abc.mcap.part")
    recover(tmp_path / "abc.mcap.part", tmp_path / "abc.mcap")

    assert recover_orphans(tmp_path) == []
    assert [file.name for file in tmp_path.iterdir()] == ["abc.mcap"]


def test_a_part_beside_another_run_of_its_name_stays(part, tmp_path):
    shutil.copy(part, tmp_path / "abc.mcap.part")
    other = simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.05}))
    write_recording(other, tmp_path / "abc.mcap", part_suffix=".other.part")

    assert recover_orphans(tmp_path) == []
    assert {file.name for file in tmp_path.iterdir()} == {"abc.mcap", "abc.mcap.part"}


@pytest.mark.parametrize("kind", KINDS)
def test_a_full_disk_leaves_an_orphan_for_the_next_start(part, small, tmp_path, kind):
    shutil.copy(part, tmp_path / "abc.mcap.part")

    with growing_files(lambda descriptor: FailingFile(descriptor, 2, kind)):
        assert recover_orphans(tmp_path) == []
    assert [file.name for file in tmp_path.iterdir()] == ["abc.mcap.part"]

    (found,) = recover_orphans(tmp_path)
    assert_prefix(read_recording(found.path), small)


def test_copies_that_were_not_finished_go_and_what_they_copied_stays(part, small, tmp_path):
    write_recording(small, tmp_path / "abc.mcap")
    for suffix in (".regular.part", ".recovering.part"):
        shutil.copy(part, tmp_path / f"abc.mcap{suffix}")

    assert recover_orphans(tmp_path) == []
    assert [file.name for file in tmp_path.iterdir()] == ["abc.mcap"]


def test_a_part_that_is_being_written_is_not_recovered_on_request(part, tmp_path):
    growing = tmp_path / "abc.mcap.part"
    shutil.copy(part, growing)
    with growing.open("ab") as stream:
        assert try_lock(stream)
        with pytest.raises(RecordingBusyError, match="another run is writing"):
            recover(growing, tmp_path / "abc.mcap")
    assert [file.name for file in tmp_path.iterdir()] == [growing.name]


def test_who_comes_second_leaves_the_part_of_the_first(tmp_path):
    scenario, path = load_scenario("paper-case-1"), tmp_path / "abc.mcap"
    shape = simulate(with_values(scenario, {"simulation.duration": 0.001})).trace.shape
    with RecordingWriter(path, scenario, shape, keep_part=True):
        with pytest.raises(RecordingBusyError, match="another run is writing"):
            record(scenario, path)
        assert part_of(path).exists()


def test_what_is_damaged_never_replaces_what_was_damaged_before(part, tmp_path):
    (tmp_path / "abc.mcap.damaged").write_bytes(b"kept")
    (tmp_path / "abc.mcap.part").write_bytes(part.read_bytes()[:2000])

    recover_orphans(tmp_path)

    names = sorted(file.name for file in tmp_path.iterdir())
    assert names == ["abc.mcap.damaged", "abc.mcap.damaged.1"]
    assert (tmp_path / "abc.mcap.damaged").read_bytes() == b"kept"


def test_an_orphan_without_a_sample_is_kept_under_another_name(part, tmp_path):
    (tmp_path / "abc.mcap.part").write_bytes(part.read_bytes()[:2000])

    assert recover_orphans(tmp_path) == []
    assert [file.name for file in tmp_path.iterdir()] == ["abc.mcap.damaged"]


def test_an_empty_part_that_nobody_writes_is_deleted(tmp_path):
    (tmp_path / "abc.mcap.part").touch()
    growing = tmp_path / "def.mcap.part"
    with growing.open("wb") as stream:
        assert try_lock(stream)
        assert recover_orphans(tmp_path) == []
    assert [file.name for file in tmp_path.iterdir()] == [growing.name]


def test_a_writer_whose_new_file_recovery_deletes_before_it_is_locked_makes_another(
    tmp_path, monkeypatch
):
    path, deletions = tmp_path / "abc.mcap", []

    def recover_first(stream):
        if not deletions:
            deletions.append(part_of(path).exists())
            assert recover_orphans(tmp_path) == []
        return try_lock(stream)

    monkeypatch.setattr(atomic_file, "try_lock", recover_first)
    with atomic_file.atomic_file(path, overwrite=False) as stream:
        stream.write(b"whole")

    assert deletions == [True]
    assert path.read_bytes() == b"whole"


def test_samples_that_do_not_fit_the_hash_are_told_apart_from_damage(small, tmp_path):
    write_recording(small, tmp_path / "run.mcap")
    repack(tmp_path / "run.mcap", tmp_path / "same.mcap", "/slipgrasp/joints", None)
    repack(tmp_path / "run.mcap", tmp_path / "changed.mcap", "/slipgrasp/joints", 4)

    assert_prefix(read_recording(tmp_path / "same.mcap"), small)
    with pytest.raises(AlteredRecordingError, match="altered"):
        read_recording(tmp_path / "changed.mcap")
    assert not read_back(tmp_path / "changed.mcap").is_unaltered


def test_the_metrics_of_what_is_recovered_are_those_of_its_samples(part, small):
    found = asdict(read_unfinished(part).result.metrics)
    rate = small.scenario.simulation.output_rate
    stated = metrics_of_trace(small.trace, small.phase_changes, small.outcome, rate)
    for name, expected in asdict(stated).items():
        if name != "held":
            assert found[name] == pytest.approx(expected, rel=1e-12), name


def write_slowly(run, path, **options):
    """Records a run as a slow one is: flushed on the way, in chunks that are not full."""
    kept = {"keep_part": True, **options}
    with RecordingWriter(path, run.scenario, run.trace.shape, **kept) as slow:
        for start in range(0, len(run.trace), 5):
            piece = run.trace[start : start + 5]
            changes = run.phase_changes[slow.num_phase_changes :]
            slow.write(piece, [c for c in changes if c.time <= piece.times[-1]])
            slow.flush()
        slow.write_ending(run)


def killed(*_arguments, **_options):
    raise KeyboardInterrupt


def test_a_run_that_was_flushed_on_the_way_is_the_file_of_one_that_was_not(small, tmp_path):
    write_slowly(small, tmp_path / "slow.mcap")
    write_recording(small, tmp_path / "fast.mcap")

    assert (tmp_path / "slow.mcap").read_bytes() == (tmp_path / "fast.mcap").read_bytes()
    assert {file.name for file in tmp_path.iterdir()} == {"slow.mcap", "fast.mcap"}


@pytest.mark.parametrize("display_rate", [0.0, 200.0])
def test_a_run_killed_after_its_last_sample_becomes_the_file_of_an_equal_run(
    small, tmp_path, display_rate
):
    undisturbed, path = tmp_path / "undisturbed.mcap", tmp_path / "abc.mcap"
    write_recording(small, undisturbed, display_rate=display_rate)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "read_pieces", killed)
        with pytest.raises(KeyboardInterrupt):
            write_slowly(small, path, display_rate=display_rate)
    assert not path.exists() and part_of(path).stat().st_size != undisturbed.stat().st_size
    (tmp_path / "abc.mcap.regular.part").write_bytes(b"begun")

    (recovered,) = recover_orphans(tmp_path)

    assert recovered.path == path
    assert path.read_bytes() == undisturbed.read_bytes()
    assert {file.name for file in tmp_path.iterdir()} == {"abc.mcap", "undisturbed.mcap"}


def test_a_run_killed_before_its_part_is_gone_leaves_the_file_of_an_equal_run(small, tmp_path):
    undisturbed, path = tmp_path / "undisturbed.mcap", tmp_path / "abc.mcap"
    write_recording(small, undisturbed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Path, "unlink", killed)
        with pytest.raises(KeyboardInterrupt):
            write_slowly(small, path)
    assert path.read_bytes() == undisturbed.read_bytes()

    assert recover_orphans(tmp_path) == []
    assert {file.name for file in tmp_path.iterdir()} == {"abc.mcap", "undisturbed.mcap"}


def test_what_is_recovered_by_hand_leaves_no_copy_that_was_begun(small, tmp_path):
    path = tmp_path / "abc.mcap"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(writer, "read_pieces", killed)
        with pytest.raises(KeyboardInterrupt):
            write_slowly(small, path)
    (tmp_path / "abc.mcap.regular.part").write_bytes(b"begun")

    recover(part_of(path), path)

    assert {file.name for file in tmp_path.iterdir()} == {"abc.mcap", "abc.mcap.part"}
