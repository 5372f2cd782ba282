"""What the messages of a recording look like; every topic follows from `core.trace.SIGNALS`.

A topic is a protobuf message type. Its first field is the exact time, then comes one
field per signal, named like the signal. Every field is written every time and integers
stay within one byte, so that all messages of a topic have one length and a table of
samples turns into messages with array operations alone (`recordings.packing`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from core.trace import SIGNALS, Signal, Trace, TraceShape

__all__ = [
    "PHASE_CHANGES",
    "SAMPLE_TOPICS",
    "Field",
    "Topic",
    "file_descriptor_set",
    "signals_of",
]

TIME_SIGNAL = SIGNALS[0]
PACKAGE = "slipgrasp"


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message.

    Attributes:
        name: Name of the field.
        kind: Protobuf type; ``sint32`` only for values that fit one byte (-64 … 63).
        repeated: Whether it is a packed list.
        text: What it means, with its unit.
    """

    name: str
    kind: Literal["double", "sint32", "fixed32"]
    repeated: bool
    text: str


@dataclass(frozen=True, slots=True)
class Topic:
    """One stream of messages of one type.

    Attributes:
        name: Topic of the channel.
        message: Name of the protobuf message.
        fields: Its fields; field number = position + 1.
    """

    name: str
    message: str
    fields: tuple[Field, ...]

    @property
    def schema_name(self) -> str:
        """Full name of the protobuf message."""
        return f"{PACKAGE}.{self.message}"


def _topic(group: str) -> Topic:
    fields = [Field("t", "double", False, f"{TIME_SIGNAL.text} [{TIME_SIGNAL.unit}]")]
    fields += [_field(signal) for signal in SIGNALS if signal.topic == group]
    return Topic(f"/slipgrasp/{group}", group.capitalize(), tuple(fields))


def _field(signal: Signal) -> Field:
    array = getattr(_EMPTY_TRACE, signal.name)
    kind = "sint32" if np.issubdtype(array.dtype, np.integer) else "double"
    unit = f" [{signal.unit}]" if signal.unit else ""
    return Field(signal.name, kind, signal.per != "", signal.text + unit)


def signals_of(topic: Topic) -> tuple[Signal, ...]:
    """The signals that a sample topic carries, in the order of its fields."""
    by_name = {signal.name: signal for signal in SIGNALS}
    return tuple(by_name[field.name] for field in topic.fields[1:])


_SHAPE = TraceShape(num_contacts=2, unknowns=())
_EMPTY_TRACE = Trace.from_rows(_SHAPE, np.empty((0, _SHAPE.num_columns)))

SAMPLE_TOPICS = tuple(map(_topic, dict.fromkeys(signal.topic for signal in SIGNALS[1:])))
"""One message per sample and topic, all at the same times."""

PHASE_CHANGES = Topic(
    "/slipgrasp/phase_changes",
    "PhaseChange",
    (
        Field("t", "double", False, "Simulation time. [s]"),
        Field("contact", "fixed32", False, "Index of the contact."),
        Field("from_phase", "sint32", False, "0 stick, 1 slip forward, -1 slip backward."),
        Field("to_phase", "sint32", False, "The phase from then on."),
    ),
)


@cache
def file_descriptor_set(topic: Topic) -> bytes:
    """The protobuf schema of a topic, as MCAP wants it: a serialised FileDescriptorSet."""
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet

    types = {
        "double": FieldDescriptorProto.TYPE_DOUBLE,
        "sint32": FieldDescriptorProto.TYPE_SINT32,
        "fixed32": FieldDescriptorProto.TYPE_FIXED32,
    }
    labels = (FieldDescriptorProto.LABEL_OPTIONAL, FieldDescriptorProto.LABEL_REPEATED)
    descriptors = FileDescriptorSet()
    file = descriptors.file.add()
    file.name = f"{PACKAGE}/{topic.message}.proto"
    file.package = PACKAGE
    file.syntax = "proto3"
    message = file.message_type.add()
    message.name = topic.message
    for number, field in enumerate(topic.fields, start=1):
        label = labels[field.repeated]
        message.field.add(name=field.name, number=number, label=label, type=types[field.kind])
    return descriptors.SerializeToString(deterministic=True)
