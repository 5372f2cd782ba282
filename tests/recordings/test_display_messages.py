"""Messages of the display topics: which samples they show, and their bytes."""

from itertools import pairwise

import numpy as np
import pytest
from foxglove import messages
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.file.foxglove.layouts import DISPLAY_RATE, FrameClock, display_layouts
from slipgrasp.recordings.palette import PHASES
from slipgrasp.scene.states import states_of
from tests.recordings.reading_display import shown_rows


def test_times_up_to_the_longest_run_keep_every_nanosecond(short_run):
    times = np.array([0.0, 1e-9, 0.999999999, 1.0, 127.5, 128.000000001, 599.999999999, 600.0])
    rows = np.repeat(short_run.trace.to_rows()[:1], len(times), axis=0)
    rows[:, 0] = times
    transforms, _ = display_layouts(short_run.scenario, 1)
    records = np.empty(len(times), transforms.record_type)
    transforms.pack(records, states_of(Trace.from_rows(short_run.trace.shape, rows)), 0)
    for time, payload in zip(times, records["payload"], strict=True):
        stamp = FrameTransforms.FromString(payload.tobytes()).transforms[-1].timestamp
        assert stamp.seconds * 10**9 + stamp.nanos == round(time * 1e9)


def test_blocks_of_any_size_give_the_same_messages(short_run):
    samples = shown_rows(short_run)
    for layout, again in zip(
        display_layouts(short_run.scenario, 7), display_layouts(short_run.scenario, 7), strict=True
    ):
        whole = np.empty(len(samples), layout.record_type)
        layout.pack(whole, states_of(samples), 0)
        pieces = np.empty(len(samples), [("before", "u1"), ("record", layout.record_type)])
        bounds = [0, 1, 1, 6, len(samples)]
        for start, stop in pairwise(bounds):
            again.pack(pieces["record"][start:stop], states_of(samples[start:stop]), start)
        assert pieces["record"].tobytes() == whole.tobytes()
        assert (layout.schema, layout.channel) == (again.schema, again.channel)


def test_schemas_hold_every_definition_they_refer_to_once_and_first(short_run):
    for layout in display_layouts(short_run.scenario, 1):
        defined = []
        for file in FileDescriptorSet.FromString(layout.schema).file:
            assert set(file.dependency) <= set(defined)
            defined.append(file.name)
        assert len(set(defined)) == len(defined)


def test_our_schemas_are_those_of_the_foxglove_sdk(short_run):
    def fields(schema):
        return {
            (message.name, field.name, field.number, field.type, field.label, field.type_name)
            for file in FileDescriptorSet.FromString(schema).file
            for message in file.message_type
            for field in message.field
        }

    for layout in display_layouts(short_run.scenario, 1):
        theirs = getattr(messages, layout.schema_name.rpartition(".")[2]).get_schema()
        assert theirs.name == layout.schema_name
        assert fields(layout.schema) == fields(theirs.data)


def test_the_largest_numbers_a_recording_holds_still_draw_an_arrow(short_run):
    rows = short_run.trace.to_rows()[:2]
    trace = Trace.from_rows(short_run.trace.shape, rows)
    trace.normal_force[:] = trace.tangential_force[:] = np.finfo(float).max
    _, layout = display_layouts(short_run.scenario, 1)
    records = np.empty(2, layout.record_type)
    layout.pack(records, states_of(trace), 0)
    (arrow,) = SceneUpdate.FromString(records["payload"][1].tobytes()).entities[-1].arrows
    assert 1.0 < arrow.shaft_length < 100.0


def test_colours_are_those_of_the_true_phase_whatever_the_controller_believes(short_run):
    trace = Trace.from_rows(short_run.trace.shape, short_run.trace.to_rows()[:1])
    trace.phase[:] = ContactPhase.SLIP_BACKWARD
    trace.believed_phase[:] = ContactPhase.STICK
    _, layout = display_layouts(short_run.scenario, 1)
    records = np.empty(1, layout.record_type)
    layout.pack(records, states_of(trace), 0)
    contact = SceneUpdate.FromString(records["payload"][0].tobytes()).entities[-1]
    for colour in (contact.spheres[0].color, contact.arrows[0].color):
        rgb = [round(255.0 * channel) for channel in (colour.r, colour.g, colour.b)]
        assert tuple(rgb) == PHASES[ContactPhase.SLIP_BACKWARD]


def test_the_first_sample_at_or_after_each_tick_is_shown():
    times = np.array([0.0, 0.0, 0.01, 0.02, 0.02, 0.035, 0.05, 0.1, 0.101, 0.12, 0.1399])
    assert FrameClock(50.0).take(times).tolist() == [0, 3, 6, 7, 9]


@pytest.mark.parametrize("rate", [50.0, 30.0, 7.3, 1000.0])
def test_samples_on_the_ticks_are_shown_although_their_times_are_rounded(rate):
    times = np.arange(6000) / rate
    for rounded in (times, np.nextafter(times, 1e9), np.nextafter(times, -1.0).clip(0.0)):
        assert len(FrameClock(rate).take(rounded)) == len(times)


def test_what_is_shown_does_not_depend_on_how_samples_come_in_blocks():
    rng = np.random.default_rng(1)
    times = np.sort(np.concatenate([rng.uniform(0.0, 5.0, 500), np.arange(0.0, 5.0, 0.05)]))
    whole = FrameClock(DISPLAY_RATE).take(times)
    clock, rows, start = FrameClock(DISPLAY_RATE), [], 0
    for stop in (*np.sort(rng.integers(0, len(times), 80)), len(times)):
        rows += (start + clock.take(times[start:stop])).tolist()
        start = stop
    assert rows == whole.tolist()
    assert np.diff(np.floor(times[whole] * DISPLAY_RATE + 1e-6)).min() == 1.0
