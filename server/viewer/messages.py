"""Messages from viewers that our pages use, with the types of all fields.

viser trusts its input: it sets any attribute of a widget that an update names, and keeps parts of
files until they are complete.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

MAX_VALUES = 16
"""Largest number of values of one control: a vector, a colour, a slider with several handles."""

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]
Point = tuple[float, float]
Count = Annotated[int, Meta(ge=0, le=2**31)]
Length = Annotated[float, Meta(ge=0.0, le=1e6)]
Plain = bool | int | float | str
Value = Plain | Annotated[list[Plain], Meta(max_length=MAX_VALUES)]


class Message(msgspec.Struct, tag_field="type", tag=True, forbid_unknown_fields=True):
    """A message from a viewer; its type is the name of the class."""


class Updates(msgspec.Struct, forbid_unknown_fields=True):
    """Changes of a control that a viewer may send: its value only."""

    value: Value


class GuiUpdateMessage(Message):
    """A control was changed."""

    uuid: str
    updates: Updates


class GuiFormDirtyMessage(Message):
    """A control of a form was changed."""

    uuid: str


class GuiFormSubmitMessage(Message):
    """A form is submitted."""

    uuid: str


class CommandTriggerMessage(Message):
    """A command is chosen, by its key or in the palette."""

    uuid: str


class FileTransferStartUpload(Message):
    """A file is about to be sent."""

    source_component_uuid: str
    transfer_uuid: str
    filename: str
    mime_type: str
    part_count: Count
    size_bytes: Count


class FileTransferPart(Message):
    """Part of a file."""

    source_component_uuid: str | None
    transfer_uuid: str
    part_index: Count
    content: bytes


class SceneNodeClickMessage(Message):
    """An object of the scene was clicked."""

    name: str
    instance_index: int | None
    ray_origin: Vector
    ray_direction: Vector
    screen_pos: Point
    modifier: str | None
    owner: str = ""


class SceneNodeDragMessage(Message):
    """An object of the scene is dragged."""

    phase: str
    name: str
    instance_index: int | None
    start_position: Vector
    start_screen_pos: Point
    end_position: Vector
    end_screen_pos: Point
    button: str
    modifier: str | None
    owner: str = ""


class ViewerCameraMessage(Message):
    """The camera of the viewer has moved."""

    wxyz: Rotation
    position: Vector
    fov: float
    near: float
    far: float
    image_height: Length
    image_width: Length
    look_at: Vector
    up_direction: Vector


MESSAGES = tuple(Message.__subclasses__())
"""All kinds of messages."""
