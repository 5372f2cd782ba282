"""Layouts and sample times of display topics for the writer of recordings."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.file.packing import MESSAGE_HEAD, fill_heads

if TYPE_CHECKING:
    from google.protobuf.descriptor import Descriptor, FileDescriptor

    from slipgrasp.recordings.file.foxglove.template import Template
    from slipgrasp.scene.states import States


DISPLAY_RATE = 50.0
"""Default rate of the display topics [Hz]."""

_EARLY = 1e-6
"""Fraction of a tick by which a sample may be early, because of rounding."""


class FrameClock:
    """Selects the first sample at or after each tick, at k / rate for integer k.

    A sample that is the first after several ticks is selected once. The selection does not depend
    on the division into blocks.

    Args:
        rate: Ticks per second [Hz].
    """

    def __init__(self, rate: float) -> None:
        self._rate = rate
        self._ticks = 0

    def take(self, times: NDArray[np.float64]) -> NDArray[np.intp]:
        """Selects rows of the next block.

        Args:
            times: Times of the block's samples in order [s].

        Returns:
            Indices into the block, in order.
        """
        ticks = np.floor(times * self._rate + _EARLY).astype(np.int64) + 1
        rows = np.flatnonzero(np.diff(ticks, prepend=self._ticks) > 0)
        if len(ticks):
            self._ticks = int(ticks[-1])
        return rows


TRANSFORMS_TOPIC = "/tf"
SCENE_TOPIC = "/scene"


class DisplayLayout:
    """Positions of all numbers in the messages of a display topic.

    Args:
        topic: Topic of the channel.
        descriptor: Protobuf descriptor of the message.
        template: Template of the message.
        channel: Id of the topic's channel in the file.

    Attributes:
        topic: Topic of the channel.
        schema_name: Full name of the protobuf message.
        schema: Its definition as in MCAP: a serialised FileDescriptorSet.
        channel: Id of the topic's channel in the file.
        record_type: A complete message record, head and payload.
    """

    def __init__(
        self, topic: str, descriptor: Descriptor, template: Template, channel: int
    ) -> None:
        self.topic = topic
        self.schema_name: str = descriptor.full_name
        self.schema = _file_descriptor_set(descriptor.file)
        self.channel = channel
        self.record_type = np.dtype([("head", MESSAGE_HEAD), ("payload", "u1", (template.size,))])
        self._template = template

    def pack(self, records: NDArray[Any], states: States, first_sequence: int) -> None:
        """Fills message records of `record_type`.

        Args:
            records: The records, shape ``(states,)``, changed in place.
            states: States to show, one per message.
            first_sequence: Sequence number of the first message.
        """
        fill_heads(records, self.channel, states.times, first_sequence)
        self._template.fill(records["payload"], states)


def display_layouts(scenario: Scenario, first_channel: int) -> tuple[DisplayLayout, ...]:
    """The layouts of all display topics of a run.

    Args:
        scenario: Hand, object and contacts.
        first_channel: Id of the channel of the first topic; the others follow.
    """
    # Deferred, because protobuf's classes take long to import and only writers need them.
    from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

    from slipgrasp.recordings.file.foxglove.scene import scene_template
    from slipgrasp.recordings.file.foxglove.transforms import transforms_template

    topics = (
        (TRANSFORMS_TOPIC, FrameTransforms.DESCRIPTOR, transforms_template(scenario)),
        (SCENE_TOPIC, SceneUpdate.DESCRIPTOR, scene_template(scenario)),
    )
    return tuple(
        DisplayLayout(topic, descriptor, template, channel)
        for channel, (topic, descriptor, template) in enumerate(topics, start=first_channel)
    )


@cache
def _file_descriptor_set(file: FileDescriptor) -> bytes:
    """The definition of a file after those of all files that it imports, each once."""
    from google.protobuf.descriptor_pb2 import FileDescriptorSet

    descriptors = FileDescriptorSet()
    for each in _with_dependencies(file):
        each.CopyToProto(descriptors.file.add())
    return descriptors.SerializeToString(deterministic=True)


def _with_dependencies(file: FileDescriptor) -> list[FileDescriptor]:
    needed = [each for other in file.dependencies for each in _with_dependencies(other)]
    by_name = {each.name: each for each in [*needed, file]}
    return list(by_name.values())
