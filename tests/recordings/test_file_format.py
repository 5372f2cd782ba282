"""What other programs find in a recording; read with libraries, not with our own reader."""

import json

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from mcap.reader import make_reader
from mcap.records import Attachment, Message, Metadata
from mcap.stream_reader import StreamReader

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.recordings.file.versions import PLANAR_FORMAT
from slipgrasp.recordings.file.writer import write_recording

DISPLAY_TOPICS = {"/tf", "/scene"}
SAMPLE_TOPICS = {f"/slipgrasp/{s.topic}" for s in SIGNALS if s.topic != "time"}


@pytest.fixture(scope="module")
def path(short_run, tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "run.mcap"
    write_recording(short_run, path)
    return path


@pytest.fixture(scope="module")
def messages(path):
    """Every message, decoded by protobuf from the schema in the file, by topic."""
    pool = descriptor_pool.DescriptorPool()
    found = {}
    with path.open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
            if channel.topic not in found:
                found[channel.topic] = []
                for file in descriptor_pb2.FileDescriptorSet.FromString(schema.data).file:
                    pool.Add(file)
            kind = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.name))
            found[channel.topic].append((message, kind.FromString(message.data)))
    return found


def test_every_group_of_signals_is_a_topic_and_so_are_the_phase_changes(messages):
    others = {"/slipgrasp/phase_changes", "/slipgrasp/checkpoints", *DISPLAY_TOPICS}
    assert set(messages) == SAMPLE_TOPICS | others


def test_every_sample_is_one_message_per_topic_with_the_exact_time(messages, short_run):
    for topic in SAMPLE_TOPICS:
        times = [decoded.t for _, decoded in messages[topic]]
        assert times == short_run.trace.times.tolist(), topic


def test_log_time_is_simulation_time_in_nanoseconds_and_sequence_numbers_have_no_gap(messages):
    for topic, found in messages.items():
        for i, (message, decoded) in enumerate(found):
            assert message.log_time == message.publish_time, topic
            assert message.sequence == i, topic
            if topic not in DISPLAY_TOPICS:
                assert message.log_time == round(decoded.t * 1e9), topic


def test_protobuf_decodes_every_signal_to_the_value_it_has(messages, short_run):
    for signal in filter(short_run.trace.shape.has, SIGNALS[1:]):
        array = getattr(short_run.trace, signal.name)
        values = [getattr(m, signal.name) for _, m in messages[f"/slipgrasp/{signal.topic}"]]
        expected = array.tolist()
        assert [list(v) if signal.per else v for v in values] == expected, signal.name


def test_phase_changes_are_messages(messages, short_run):
    decoded = [m for _, m in messages["/slipgrasp/phase_changes"]]
    assert [(m.t, m.contact, m.from_phase, m.to_phase) for m in decoded] == [
        (c.time, c.contact, c.from_phase, c.to_phase) for c in short_run.phase_changes
    ]


def test_scenario_and_versions_stand_before_the_first_sample(path, short_run):
    with path.open("rb") as stream:
        records = list(StreamReader(stream, validate_crcs=True).records)
    first_message = next(i for i, record in enumerate(records) if isinstance(record, Message))
    start = next(r for r in records[:first_message] if isinstance(r, Metadata))
    attachments = {r.name: r.data for r in records[:first_message] if isinstance(r, Attachment)}
    assert start.metadata["format"] == str(PLANAR_FORMAT)
    assert start.metadata["program"] == program_version()
    scenario = scenario_from_mapping(json.loads(attachments["scenario.json"]))
    assert scenario == short_run.scenario
    assert json.loads(attachments["parameters.json"])["object.mass"]["unit"] == "kg"


def test_outcome_metrics_and_counts_stand_at_the_end(path, short_run, messages):
    with path.open("rb") as stream:
        stop = list(make_reader(stream).iter_metadata())[-1].metadata
    assert stop["outcome"] == short_run.outcome
    assert json.loads(stop["metrics"])["slip_path"] == list(short_run.metrics.slip_path)
    counts = {topic: len(found) for topic, found in messages.items()}
    assert json.loads(stop["counts"]) == {**counts, "/slipgrasp/ticks": len(short_run.ticks)}


def test_the_index_finds_messages_by_topic_and_time(path, short_run):
    with path.open("rb") as stream:
        found = make_reader(stream).iter_messages(
            topics="/slipgrasp/object", starting_at=100_000_000, ending_before=200_000_000
        )
        num_found = sum(1 for _ in found)
    times = short_run.trace.times
    assert num_found == np.count_nonzero((times >= 0.1) & (times < 0.2))


def test_other_programs_find_units_beside_the_signals(path):
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    described = {c.topic: c.metadata for c in summary.channels.values()}
    assert described["/slipgrasp/contacts"]["normal_force"].endswith("[N]")
