"""Files that are not whole, not ours or not from this time are refused in one sentence."""

import random
import struct
import warnings
import zlib
from dataclasses import replace

import pytest
import zstandard
from mcap.writer import Writer

from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.interruptions import describe_stop
from slipgrasp.recordings.exceptions import (
    DamagedRecordingError,
    ForeignRecordingError,
    NewerRecordingError,
    RecordingBusyError,
    RecordingError,
    RecordingExistsError,
    RecordingNotFoundError,
    RecordingWriteError,
)
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.file.container import McapContainer
from slipgrasp.recordings.file.documents import START, start_document
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def small(short_run):
    """A run of few samples, so that its file can be read hundreds of times."""
    trace = short_run.trace[:20]
    changes = tuple(c for c in short_run.phase_changes if c.time <= trace.times[-1])
    rate = short_run.scenario.simulation.output_rate
    metrics = metrics_of_trace(trace, changes, Outcome.STOPPED, rate)
    return replace(
        short_run,
        trace=trace,
        phase_changes=changes,
        outcome=Outcome.STOPPED,
        reason=describe_stop(float(trace.times[-1])),
        metrics=metrics,
        has_sample_metrics=True,
    )


@pytest.fixture(scope="module")
def whole(small, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "run.mcap"
    write_recording(small, path)
    return path.read_bytes()


def read_bytes(data, folder):
    path = folder / "damaged.mcap"
    path.write_bytes(data)
    return read_recording(path)


def test_a_missing_file_is_not_found(tmp_path):
    with pytest.raises(RecordingNotFoundError, match="there is no recording"):
        read_recording(tmp_path / "nothing.mcap")


def test_a_folder_cannot_be_read_as_a_recording(tmp_path):
    with pytest.raises(RecordingError, match="cannot read"):
        read_recording(tmp_path)


def test_an_empty_file_is_damaged(tmp_path):
    with pytest.raises(DamagedRecordingError, match="it is empty"):
        read_bytes(b"", tmp_path)


def test_text_is_not_an_mcap_file(tmp_path):
    with pytest.raises(ForeignRecordingError, match="not an MCAP file"):
        read_bytes(b"t,x,y\n0.0,1.0,2.0\n" * 100, tmp_path)


def test_an_mcap_file_of_another_program_is_foreign(tmp_path):
    with (tmp_path / "other.mcap").open("wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="another program")
        writer.finish()

    with pytest.raises(ForeignRecordingError, match="another program"):
        read_recording(tmp_path / "other.mcap")


def test_a_recording_of_a_newer_format_is_refused_with_the_way_out(small, tmp_path):
    with (tmp_path / "newer.mcap").open("wb") as stream:
        container = McapContainer(stream, profile="slipgrasp", library="slipgrasp 99")
        container.add_metadata(
            START, {**start_document(small.trace.shape, small.provenance, 0, 0.0), "format": "99"}
        )
        container.finish()

    with pytest.raises(NewerRecordingError, match=r"format 99.*install a newer slipgrasp"):
        read_recording(tmp_path / "newer.mcap")


def test_a_recording_without_an_ending_is_damaged(small, tmp_path):
    with (tmp_path / "cut.mcap").open("wb") as stream:
        container = McapContainer(stream, profile="slipgrasp", library="slipgrasp 1")
        container.add_metadata(START, start_document(small.trace.shape, small.provenance, 0, 0.0))
        container.finish()

    with pytest.raises(DamagedRecordingError, match="missing"):
        read_recording(tmp_path / "cut.mcap")


def test_a_file_cut_off_anywhere_is_damaged(whole, tmp_path):
    for length in range(0, len(whole), 61):
        with pytest.raises(DamagedRecordingError):
            read_bytes(whole[:length], tmp_path)


def test_no_flipped_bit_goes_unnoticed(whole, tmp_path):
    source = random.Random(1)
    for _ in range(200):
        damaged = bytearray(whole)
        position = source.randrange(len(whole))
        damaged[position] ^= 1 << source.randrange(8)
        with pytest.raises(RecordingError):
            read_bytes(bytes(damaged), tmp_path)


def test_bytes_after_the_end_are_noticed(whole, tmp_path):
    with pytest.raises(DamagedRecordingError):
        read_bytes(whole + whole, tmp_path)


def test_a_chunk_that_unpacks_to_more_than_it_claims_is_refused(small, tmp_path):
    zeros = b"\0" * (1 << 28)
    assert_bomb_is_refused(small, tmp_path, zeros, claimed=1000)


def test_a_chunk_that_claims_to_be_huge_is_refused(small, tmp_path):
    zeros = b"\0" * (1 << 28)
    assert_bomb_is_refused(small, tmp_path, zeros, claimed=len(zeros))


def assert_bomb_is_refused(small, folder, content, claimed):
    compressed = zstandard.ZstdCompressor(level=19).compress(content)
    chunk = struct.pack(
        "<QQQII4sQ", 0, 0, claimed, zlib.crc32(content), 4, b"zstd", len(compressed)
    )
    with (folder / "bomb.mcap").open("wb") as stream:
        container = McapContainer(stream, profile="slipgrasp", library="slipgrasp 1")
        container.add_metadata(START, start_document(small.trace.shape, small.provenance, 0, 0.0))
        stream.write(struct.pack("<BQ", 6, len(chunk) + len(compressed)) + chunk + compressed)
        container.finish()

    with pytest.raises(DamagedRecordingError, match="chunk"):
        read_recording(folder / "bomb.mcap")


def test_an_existing_file_is_not_overwritten_unless_asked(small, short_run, tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(small, path)
    before = path.read_bytes()

    with pytest.raises(RecordingExistsError, match="already exists"):
        write_recording(short_run, path)
    assert path.read_bytes() == before

    write_recording(short_run, path, overwrite=True)
    assert path.read_bytes() != before


@pytest.mark.parametrize("wrong", [float("nan"), float("inf"), float("-inf")])
def test_a_number_that_is_not_finite_is_not_written_and_leaves_no_file(small, wrong, tmp_path):
    rows = small.trace.to_rows()
    rows[7, 4] = wrong
    run = replace(small, trace=Trace.from_rows(small.trace.shape, rows))

    with pytest.raises(RecordingWriteError, match=r"object_velocity.*not finite"):
        write_recording(run, tmp_path / "run.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_metric_that_is_not_finite_is_not_written(small, tmp_path):
    run = replace(small, metrics=replace(small.metrics, torque_effort=float("nan")))

    with pytest.raises(RecordingWriteError, match="not a finite number"):
        write_recording(run, tmp_path / "run.mcap")
    assert list(tmp_path.iterdir()) == []


def test_a_failed_overwrite_leaves_the_file_that_was_there(small, tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(small, path)
    before = path.read_bytes()
    broken = replace(small, metrics=replace(small.metrics, torque_effort=float("nan")))

    with pytest.raises(RecordingWriteError):
        write_recording(broken, path, overwrite=True)

    assert path.read_bytes() == before


def test_two_writers_of_one_file_keep_apart(small, tmp_path):
    (tmp_path / "run.mcap.part").write_bytes(b"another run is writing")

    with pytest.raises(RecordingBusyError, match=r"run\.mcap\.part.*slipgrasp recover"):
        write_recording(small, tmp_path / "run.mcap")
    assert (tmp_path / "run.mcap.part").read_bytes() == b"another run is writing"


def test_a_folder_that_does_not_exist_is_named(small, tmp_path):
    with pytest.raises(RecordingWriteError, match="nowhere"):
        write_recording(small, tmp_path / "nowhere" / "run.mcap")


def test_display_messages_of_our_own_are_never_too_many(small, tmp_path, monkeypatch):
    monkeypatch.setattr("slipgrasp.recordings.file.scan.MAX_UNWANTED_MESSAGES", 0)
    write_recording(small, tmp_path / "run.mcap", display_rate=1000.0)

    assert len(read_recording(tmp_path / "run.mcap").trace) == len(small.trace)


@pytest.mark.parametrize("time", [-1.0, 1.7e308])
def test_a_time_that_no_run_has_is_damage(small, tmp_path, time):
    rows = small.trace.to_rows()
    rows[0 if time < 0.0 else -1, 0] = time
    run = replace(small, trace=Trace.from_rows(small.trace.shape, rows), phase_changes=())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        write_recording(run, tmp_path / "run.mcap", display_rate=0.0)

    with pytest.raises(DamagedRecordingError, match="time"):
        read_recording(tmp_path / "run.mcap")


def test_what_a_killed_process_left_of_another_file_is_no_obstacle(tmp_path):
    (tmp_path / "notes.json.part").write_bytes(b"half a sid")

    with atomic_file(tmp_path / "notes.json", overwrite=True) as stream:
        stream.write(b"whole")

    assert [file.name for file in tmp_path.iterdir()] == ["notes.json"]
    assert (tmp_path / "notes.json").read_bytes() == b"whole"


@pytest.mark.parametrize("contact", [-1, 2])
def test_a_reason_that_concerns_a_contact_that_does_not_exist_is_refused(small, contact, tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(replace(small, reason=replace(small.reason, contact=contact)), path)
    with pytest.raises(DamagedRecordingError, match="a contact that does not exist"):
        read_recording(path)
