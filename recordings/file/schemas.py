"""Topics and messages of a recording, derived from the signals of the trace.

A topic is a protobuf message type. Its first field is the exact time, followed by one field per
signal, with the signal's name. Every field is always written and integers fit in one byte, so that
all messages of a topic have the same length and samples are converted with array operations alone
(`slipgrasp.recordings.file.packing`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal

from slipgrasp.core.scenario.space import PLANAR, RAIL, SPATIAL, SUPPORT, Space
from slipgrasp.core.trace.signals import SIGNALS, Signal, TraceShape
from slipgrasp.recordings.file.state_hash import HASH_BYTES
from slipgrasp.recordings.file.versions import (
    FIRST_FORMAT_WITH,
    FIRST_FORMAT_WITH_TICKS,
    FORMATS,
    PLANAR_FORMAT,
    PLANAR_FORMATS,
    RAIL_FORMATS,
    SOFT_FORMAT,
    SOFT_FORMATS,
    SUPPORT_FORMATS,
)

TIME_SIGNAL = SIGNALS[0]
PACKAGE = "slipgrasp"
SCHEMA_VERSION = 1
"""Version of the messages; new fields keep it, a changed meaning raises it."""

HASH_WORDS = HASH_BYTES // 8


@dataclass(frozen=True, slots=True)
class Field:
    """One field of a message.

    Attributes:
        name: Name of the field.
        kind: Protobuf type; ``sint32`` only for values that fit one byte (-64 … 63).
        repeated: Whether it is a packed list.
        text: Meaning with unit.
        width: Number of components of a list of fixed length; signals have the width of the trace.
    """

    name: str
    kind: Literal["double", "sint32", "fixed32", "fixed64"]
    repeated: bool
    text: str
    width: int = 1


@dataclass(frozen=True, slots=True)
class Topic:
    """A stream of messages of one type.

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


def signals_in(version: int) -> tuple[Signal, ...]:
    """The signals in a format."""
    has_pads = version in (*SOFT_FORMATS, *SUPPORT_FORMATS)
    space = _space_of(version)
    lacks = {"path": not space.has_paths, "pad": not has_pads}
    return tuple(
        signal
        for signal in SIGNALS
        if FIRST_FORMAT_WITH.get(signal.name, 1) <= version
        and not lacks.get(signal.per, False)
        and (space.has_hand or not signal.of_hand)
        and (space.has_control or not signal.of_control)
    )


def _space_of(version: int) -> Space:
    """The kind of scenario of a format."""
    if version in SUPPORT_FORMATS:
        return SUPPORT
    if version in RAIL_FORMATS:
        return RAIL
    return PLANAR if version in PLANAR_FORMATS else SPATIAL


def _topic(group: str, version: int) -> Topic:
    fields = [Field("t", "double", False, f"{TIME_SIGNAL.text} [{TIME_SIGNAL.unit}]")]
    fields += [_field(signal, version) for signal in signals_in(version) if signal.topic == group]
    return Topic(f"/slipgrasp/{group}", group.capitalize(), tuple(fields))


def _field(signal: Signal, version: int) -> Field:
    kind = "sint32" if signal.holds_phases else "double"
    space = _space_of(version)
    unit, text = signal.unit_in(space), signal.text_in(space)
    unit += f"; for slides: {signal.slides_unit}" if signal.slides_unit else ""
    return Field(signal.name, kind, signal.per != "", f"{text} [{unit}]" if unit else text)


_OF_HANDS = frozenset(signal.name for signal in SIGNALS if signal.of_hand or signal.of_control)


def kept_fields(topic: Topic, signals: frozenset[str]) -> list[str]:
    """The fields of a sample topic to read for some signals: these and the times, or none.

    Every sample topic has the times. The first one, which all kinds of scenarios have, gives them
    if the others may be missing: if no signal is wanted, or only signals of hands.
    """
    if topic.name not in {each.name for each in SAMPLE_TOPICS}:
        return []
    wanted = signals - {TIME_SIGNAL.name}
    kept = [field.name for field in topic.fields if field.name in wanted]
    gives_times = topic.name == SAMPLE_TOPICS[0].name and wanted <= _OF_HANDS
    return ["t", *kept] if kept or gives_times else []


def signals_of(topic: Topic) -> tuple[Signal, ...]:
    """The signals of a sample topic, in the order of its fields."""
    by_name = {signal.name: signal for signal in SIGNALS}
    return tuple(by_name[field.name] for field in topic.fields[1:])


def _sample_topics(version: int) -> tuple[Topic, ...]:
    groups = dict.fromkeys(signal.topic for signal in SIGNALS[1:])
    topics = (_topic(group, version) for group in groups)
    return tuple(topic for topic in topics if len(topic.fields) > 1)


SAMPLE_TOPICS = _sample_topics(PLANAR_FORMAT)
"""One message per sample and topic, with common times; the names are the same in all formats."""


def format_of(shape: TraceShape) -> int:
    """The format for runs of a given shape."""
    return SOFT_FORMAT if shape.soft and shape.space.has_hand else FORMATS[shape.space]


PHASE_CHANGES = Topic(
    "/slipgrasp/phase_changes",
    "PhaseChange",
    (
        Field("t", "double", False, "Simulation time. [s]"),
        Field("contact", "fixed32", False, "Index of the contact."),
        Field("from_phase", "sint32", False, "0 stick, 1 slip forward, -1 slip backward."),
        Field("to_phase", "sint32", False, "New phase."),
    ),
)

_COMMANDS = "Torque that the law commanded, before limits. [N m; for slides: N]"
TICKS = Topic(
    "/slipgrasp/ticks",
    "Tick",
    (
        Field("t", "double", False, "Time of a tick of sampled control. [s]"),
        Field("commands", "double", True, _COMMANDS),
        Field("estimates", "double", True, "Estimates at the tick."),
        Field("diagnostics", "double", True, "Diagnostics of a custom law."),
    ),
)
"""One message per tick of sampled control, so that a run can be simulated without its law."""


def _checkpoints(version: int) -> Topic:
    fields = (
        Field("t", "double", False, "Time of the last sample so far. [s]"),
        Field("samples", "fixed32", False, "Number of samples so far."),
        Field("phase_changes", "fixed32", False, "Number of phase changes so far."),
        Field("documents_hash", "fixed64", True, "Hash of start and scenario.", HASH_WORDS),
        Field("state_hash", "fixed64", True, "Hash of the run so far.", HASH_WORDS),
    )
    if version >= FIRST_FORMAT_WITH_TICKS:
        fields += (Field("ticks", "fixed32", False, "Number of ticks so far."),)
    return Topic("/slipgrasp/checkpoints", "Checkpoint", fields)


CHECKPOINTS = _checkpoints(PLANAR_FORMAT)
"""One message at the end of every chunk, which proves that an unfinished file is valid so far."""


def own_topics(version: int) -> tuple[Topic, ...]:
    """The topics of a format, in the order of their channels."""
    topics = (*_sample_topics(version), PHASE_CHANGES, _checkpoints(version))
    return (*topics, TICKS) if version >= FIRST_FORMAT_WITH_TICKS else topics


OWN_TOPICS = own_topics(PLANAR_FORMAT)


@cache
def file_descriptor_set(topic: Topic) -> bytes:
    """The protobuf schema of a topic as in MCAP: a serialised FileDescriptorSet."""
    from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet

    types = {
        "double": FieldDescriptorProto.TYPE_DOUBLE,
        "sint32": FieldDescriptorProto.TYPE_SINT32,
        "fixed32": FieldDescriptorProto.TYPE_FIXED32,
        "fixed64": FieldDescriptorProto.TYPE_FIXED64,
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
