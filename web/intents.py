"""What a user, or a worker on the user's behalf, asks of a session; and what follows from it.

Callbacks put intents into the mailbox of their session and return. Decisions are plain
functions of plain values.
"""

from __future__ import annotations

import queue
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from core.exceptions import ScenarioError
from core.result import RunResult
from recordings.store import StoredRun
from web.playback import WindowChoice
from web.replay import Replay

__all__ = [
    "CameraMoved",
    "ChoosePreset",
    "ChooseWindow",
    "Close",
    "FrameHand",
    "Intent",
    "ListRecordings",
    "Mailbox",
    "OpenRecording",
    "RecordingOpened",
    "RecordingUnreadable",
    "RecordingsListed",
    "ResetScenario",
    "RunFinished",
    "RunRefused",
    "RunSaved",
    "SaveFailed",
    "Seek",
    "Send",
    "SetParameter",
    "SetSpeed",
    "Step",
    "TogglePlay",
    "Zoom",
    "coalesce",
]


@dataclass(frozen=True, slots=True)
class SetParameter:
    """The user moved the knob of a parameter; its value is not validated yet."""

    key: str
    value: float | int | str | list[float]


@dataclass(frozen=True, slots=True)
class ChoosePreset:
    """The user chose another scenario to start from."""

    name: str


@dataclass(frozen=True, slots=True)
class ResetScenario:
    """The user wants the preset back as it comes."""


@dataclass(frozen=True, slots=True)
class TogglePlay:
    """Play or pause."""


@dataclass(frozen=True, slots=True)
class Seek:
    """The user put the play head to a time [s]."""

    time: float


@dataclass(frozen=True, slots=True)
class Step:
    """The user wants the next (1) or the previous (-1) row of the trace."""

    direction: int


@dataclass(frozen=True, slots=True)
class SetSpeed:
    """The user chose how fast to play, by the name of a speed."""

    name: str


@dataclass(frozen=True, slots=True)
class ChooseWindow:
    """The user chose which stretch of the run to play and chart."""

    choice: WindowChoice


@dataclass(frozen=True, slots=True)
class Zoom:
    """The user wants a closer look at the time around the play head."""


@dataclass(frozen=True, slots=True)
class FrameHand:
    """The user wants to see the whole hand from the front again."""


@dataclass(frozen=True, slots=True)
class CameraMoved:
    """The viewer reports its camera: position [m] and size of its picture [px]."""

    position: tuple[float, float, float]
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class ListRecordings:
    """The user wants to see a page of the stored runs, 0 has the newest."""

    page: int


@dataclass(frozen=True, slots=True)
class OpenRecording:
    """The user wants to see a stored run; its id is not validated yet."""

    run_id: str


@dataclass(frozen=True, slots=True)
class RecordingsListed:
    """A page of the stored runs.

    Attributes:
        page: Which page.
        count: How many runs there are on all pages.
        runs: Those of this page.
    """

    page: int
    count: int
    runs: tuple[StoredRun, ...]


@dataclass(frozen=True, slots=True)
class RecordingOpened:
    """A recording is there to be shown; ``number`` is that of the request."""

    number: int
    replay: Replay


@dataclass(frozen=True, slots=True)
class RecordingUnreadable:
    """A recording could not be opened, with the reason."""

    number: int
    message: str


@dataclass(frozen=True, slots=True)
class RunFinished:
    """A run is there to be shown.

    Attributes:
        ticket: Which request it answers.
        result: The run.
        elapsed: How long it was computed [s].
    """

    ticket: int
    result: RunResult
    elapsed: float


@dataclass(frozen=True, slots=True)
class RunRefused:
    """A run could not be made of its scenario."""

    ticket: int
    error: ScenarioError


@dataclass(frozen=True, slots=True)
class RunSaved:
    """A run is on disk."""

    ticket: int
    stored: StoredRun


@dataclass(frozen=True, slots=True)
class SaveFailed:
    """A run could not be written, with the reason."""

    ticket: int
    message: str


@dataclass(frozen=True, slots=True)
class Close:
    """The viewer is gone."""


Intent = (
    SetParameter
    | ChoosePreset
    | ResetScenario
    | TogglePlay
    | Seek
    | Step
    | SetSpeed
    | ChooseWindow
    | Zoom
    | FrameHand
    | CameraMoved
    | ListRecordings
    | OpenRecording
    | RecordingsListed
    | RecordingOpened
    | RecordingUnreadable
    | RunFinished
    | RunRefused
    | RunSaved
    | SaveFailed
    | Close
)
Send = Callable[[Intent], None]

_LATEST_COUNTS = (Seek, CameraMoved, SetSpeed, ChooseWindow, ListRecordings, OpenRecording)


def coalesce(intents: Sequence[Intent]) -> list[Intent]:
    """Drops what a later intent of the same batch makes void, in unchanged order.

    A knob that is dragged sends many values; only its last one is worth a simulation.
    """
    kept: list[Intent] = []
    seen: set[object] = set()
    for intent in reversed(intents):
        subject: object = intent.key if isinstance(intent, SetParameter) else type(intent)
        if isinstance(intent, (SetParameter, *_LATEST_COUNTS)):
            if subject in seen:
                continue
            seen.add(subject)
        kept.append(intent)
    return kept[::-1]


class Mailbox:
    """Where the intents of one session wait; anyone may send, one loop receives."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Intent] = queue.SimpleQueue()

    def send(self, intent: Intent) -> None:
        """Puts an intent in and returns at once."""
        self._queue.put(intent)

    def receive(self, timeout: float | None) -> list[Intent]:
        """Everything that is in it, coalesced.

        Args:
            timeout: How long to wait for a first intent [s]; None waits without end.
        """
        intents: list[Intent] = []
        try:
            intents.append(self._queue.get(timeout=timeout))
            while True:
                intents.append(self._queue.get_nowait())
        except queue.Empty:
            return coalesce(intents)
