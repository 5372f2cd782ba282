"""Intents about files that a user takes away, and the answers of the thread that makes them."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.web.model.export import ExportFile
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


@dataclass(frozen=True, slots=True)
class ExportPicture(Intent):
    """The user wants the scene as it stands, as a picture."""


@dataclass(frozen=True, slots=True)
class ExportCharts(Intent):
    """The user wants the charts as they stand, as a drawing."""


@dataclass(frozen=True, slots=True)
class ExportClip(Intent):
    """The user wants what is played, as it is played, as a moving picture.

    Attributes:
        name: Format of the file.
        height: Of the picture [px].
    """

    name: str
    height: int


@dataclass(frozen=True, slots=True)
class ExportStill(Intent):
    """The user wants the instant at the play head as a drawing; its size is not validated yet.

    Attributes:
        name: Format of the file.
        width: Of the picture [px].
        height: Likewise.
    """

    name: str
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class ExportPage(Intent):
    """The user wants the scenario that is shown as a page that simulates it."""


@dataclass(frozen=True, slots=True)
class CancelExport(Intent):
    """The user does not want the file any more."""


@dataclass(frozen=True, slots=True)
class ExportMoved(LatestIntent):
    """A share of an export is done, 0 to 1."""

    number: int
    share: float


@dataclass(frozen=True, slots=True)
class ExportFinished(Intent):
    """The file of an export is there."""

    number: int
    file: ExportFile


@dataclass(frozen=True, slots=True)
class ExportFailed(Intent):
    """An export came to nothing, with the reason."""

    number: int
    message: str
