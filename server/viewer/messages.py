"""The messages of a viewer that viser listens to, with the types of all that they carry.

viser trusts what it receives: it sets any attribute of a widget that an update names, and keeps
what it is sent of files until they are complete.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

MAX_VALUES = 16
"""The most numbers that one control has: a vector, a colour, a slider with several handles."""

Vector = tuple[float, float, float]
Rotation = tuple[float, float, float, float]
Point = tuple[float, float]
Count = Annotated[int, Meta(ge=0, le=2**31)]
Length = Annotated[float, Meta(ge=0.0, le=1e6)]
Plain = bool | int | float | str
Value = Plain | Annotated[list[Plain], Meta(max_length=MAX_VALUES)]


class Message(msgspec.Struct, tag_field="type", tag=True, forbid_unknown_fields=True):
    """A message of a viewer; its type is the name of the class."""


class Updates(msgspec.Struct, forbid_unknown_fields=True):
    """What a viewer may change of a control: its value, and nothing else that viser keeps of it."""

    value: Value


class GuiUpdateMessage(Message):
    """A control was changed."""

    uuid: str
    updates: Updates


class GuiButtonHoldMessage(Message):
    """A button is held down."""

    uuid: str
    frequency: float


class GuiFormDirtyMessage(Message):
    """A control of a form was changed."""

    uuid: str


class GuiFormSubmitMessage(Message):
    """A form is sent."""

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
    """A part of a file."""

    source_component_uuid: str | None
    transfer_uuid: str
    part_index: Count
    content: bytes


class LocalStorageGetItemResponseMessage(Message):
    """A value that the browser keeps."""

    value: str | None
    error: str | None
    request_uuid: str


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


class ScenePointerMessage(Message):
    """The pointer was used in the scene."""

    event_type: str
    ray_origin: Vector | None
    ray_direction: Vector | None
    screen_pos: Annotated[list[Point], Meta(max_length=MAX_VALUES)]
    modifier: str | None


class ShareUrlDisconnect(Message):
    """The public tunnel is to be closed."""


class ShareUrlRequest(Message):
    """A public tunnel is asked for."""


class TransformControlsDragEndMessage(Message):
    """A frame of the scene was let go."""

    name: str
    owner: str = ""


class TransformControlsDragStartMessage(Message):
    """A frame of the scene was seized."""

    name: str
    owner: str = ""


class TransformControlsUpdateMessage(Message):
    """A frame of the scene was moved."""

    name: str
    wxyz: Rotation
    position: Vector
    owner: str = ""


class ViewerCameraMessage(Message):
    """The viewer looks from another place."""

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
"""All of them."""
