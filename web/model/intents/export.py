"""Intents about exported files, and the answers of the export thread."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.export import ExportFile
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


@dataclass(frozen=True, slots=True)
class ExportPicture(Intent):
    """Requests an image of the current scene."""


@dataclass(frozen=True, slots=True)
class ExportCharts(Intent):
    """Requests a drawing of the current charts."""


@dataclass(frozen=True, slots=True)
class ExportClip(Intent):
    """Requests an animation of the current time range at the current speed.

    Attributes:
        name: Format of the file.
        height: Height [px].
    """

    name: str
    height: int


@dataclass(frozen=True, slots=True)
class ExportStill(Intent):
    """Requests a still image at the play head; its size is not validated yet.

    Attributes:
        name: Format of the file.
        width: Width [px].
        height: Height [px].
    """

    name: str
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class ExportPage(Intent):
    """Requests to export the displayed scenario as a live page."""


@dataclass(frozen=True, slots=True)
class CancelExport(Intent):
    """Cancels the export."""


@dataclass(frozen=True, slots=True)
class ExportMoved(LatestIntent):
    """Progress of an export, 0 to 1."""

    number: int
    share: float


@dataclass(frozen=True, slots=True)
class ExportFinished(Intent):
    """The file of an export is complete."""

    number: int
    file: ExportFile


@dataclass(frozen=True, slots=True)
class ExportFailed(Intent):
    """An export failed, with the reason."""

    number: int
    message: str
