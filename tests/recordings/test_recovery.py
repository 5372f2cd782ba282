"""What a killed writer, a cut or a damaged block leaves is kept, and never as more than it is."""

import random
import shutil
from dataclasses import asdict

import pytest
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from benchmarks.faults.disk import KINDS, FailingFile, growing_files
from core.loading import load_scenario, with_values
from core.simulator import simulate
from core.types import Outcome
from recordings import DamagedRecordingError, RecordingError, read_recording, write_recording
from recordings.exceptions import AlteredRecordingError, NothingToRecoverError, RecordingBusyError
from recordings.file_lock import try_lock
from recordings.reader import read_back, read_unfinished
from recordings.recovery import recover, recover_orphans
from recordings.writer import RecordingWriter


@pytest.fixture(scope="module")
def small():
    """About 20 kB: few samples, in several chunks."""
    values = {"simulation.duration": 0.25, "simulation.output_rate": 50.0}
    return simulate(with_values(load_scenario("paper-case-2"), values))


@pytest.fixture(scope="module")
def part(small, tmp_path_factory):
    """What a writer leaves that is killed before it can end the file; in chunks of 3 samples."""
    path = tmp_path_factory.mktemp("part") / "run.mcap"
    with (
        pytest.raises(KeyboardInterrupt),
        RecordingWriter(path, small.scenario, small.trace.shape, keep_part=True) as writer,
    ):
        for start in range(0, len(small.trace), 3):
            end = start + 3
            span = small.trace.times[start : end + 1]
            changes = [c for c in small.phase_changes if span[0] <= c.time < span[-1]]
            writer.write(small.trace[start:end], changes)
            writer.flush()
        raise KeyboardInterrupt
    return path.with_name("run.mcap.part")


def assert_prefix(result, whole):
    """Every sample and phase change is one of the whole run, from its first on, to the bit."""
    rows = result.trace.to_rows()
    assert rows.tobytes() == whole.trace.to_rows()[: len(rows)].tobytes()
    assert result.phase_changes == whole.phase_changes[: len(result.phase_changes)]
    assert all(c.time <= result.end_time for c in result.phase_changes)
    assert result.scenario == whole.scenario


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
    for length in range(0, len(data), 67):
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
    for _ in range(300):
        damaged = bytearray(data)
        damaged[source.randrange(len(data))] ^= 1 << source.randrange(8)
        flipped.write_bytes(damaged)
        try:
            result = read_unfinished(flipped).result
        except RecordingError:
            continue
        assert_prefix(result, small)


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
        with pytest.raises(RecordingBusyError, match="right now"):
            recover(growing, tmp_path / "abc.mcap")
    assert [file.name for file in tmp_path.iterdir()] == [growing.name]


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


def test_samples_that_do_not_fit_the_hash_are_told_apart_from_damage(small, tmp_path):
    write_recording(small, tmp_path / "run.mcap")
    rewrite(tmp_path / "run.mcap", tmp_path / "same.mcap", changed=None)
    rewrite(tmp_path / "run.mcap", tmp_path / "changed.mcap", changed=40)

    assert_prefix(read_recording(tmp_path / "same.mcap"), small)
    with pytest.raises(AlteredRecordingError, match="altered"):
        read_recording(tmp_path / "changed.mcap")
    assert not read_back(tmp_path / "changed.mcap").is_unaltered


def rewrite(source, target, changed):
    """Copies a recording with the mcap library, which makes every checksum fit.

    Args:
        source: The recording.
        target: The copy.
        changed: Which message gets one bit flipped in its last number, None for none.
    """
    with source.open("rb") as old, target.open("wb") as new:
        writer = Writer(new, enable_data_crcs=True)
        writer.start(profile="slipgrasp", library="another program")
        for i, record in enumerate(StreamReader(old).records):
            match record:
                case Schema():
                    writer.register_schema(record.name, record.encoding, record.data)
                case Channel():
                    kind = record.topic, record.message_encoding, record.schema_id
                    writer.register_channel(*kind, record.metadata)
                case Attachment():
                    kind = record.create_time, record.log_time, record.name, record.media_type
                    writer.add_attachment(*kind, record.data)
                case Metadata():
                    writer.add_metadata(record.name, record.metadata)
                case Message():
                    data = bytearray(record.data)
                    data[-5] ^= i == changed
                    times = record.log_time, bytes(data), record.publish_time, record.sequence
                    writer.add_message(record.channel_id, *times)
                case _:
                    pass
        writer.finish()


def test_the_metrics_of_what_is_recovered_are_those_of_its_samples(part, small):
    found = asdict(read_unfinished(part).result.metrics)
    for name, expected in asdict(small.metrics).items():
        if name != "held":
            assert found[name] == pytest.approx(expected, rel=1e-12), name
