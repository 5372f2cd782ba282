"""Intents about exported files, and the answers of the export thread."""

from __future__ import annotations

from slipgrasp.web.model.export import ExportFile
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


class ExportPicture(Intent):
    """Requests an image of the current scene."""


class ExportCharts(Intent):
    """Requests a drawing of the current charts."""


class ExportClip(Intent):
    """Requests an animation of the current time range at the current speed.

    Attributes:
        name: Format of the file.
        height: Height [px].
    """

    name: str
    height: int


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


class ExportPage(Intent):
    """Requests to export the displayed scenario as a live page."""


class CancelExport(Intent):
    """Cancels the export."""


class ExportMoved(LatestIntent):
    """Progress of an export, 0 to 1."""

    number: int
    share: float


class ExportFinished(Intent):
    """The file of an export is complete."""

    number: int
    file: ExportFile


class ExportFailed(Intent):
    """An export failed, with the reason."""

    number: int
    message: str
