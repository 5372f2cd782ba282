"""Intents about stored runs, and what their worker answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Interval, MaxLen

from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.intent import Intent, Key, LatestIntent
from slipgrasp.web.model.replay import Replay


@dataclass(frozen=True, slots=True)
class ListRecordings(LatestIntent):
    """The user wants to see a page of the stored runs, 0 has the newest."""

    page: Annotated[int, Interval(ge=0, le=1_000_000)]


@dataclass(frozen=True, slots=True)
class FilterRecordings(LatestIntent):
    """The user wants to see some of the stored runs only, by `slipgrasp.web.model.run_list`."""

    text: str
    outcome: str


@dataclass(frozen=True, slots=True)
class ChooseRecording(LatestIntent):
    """The user points at a stored run; its id is not validated yet, empty for none."""

    run_id: Key


@dataclass(frozen=True, slots=True)
class OpenRecording(LatestIntent):
    """The user wants to see a stored run; its id is not validated yet."""

    run_id: Key


@dataclass(frozen=True, slots=True)
class OpenLink(LatestIntent):
    """The page was opened with a link; of it only the lengths are checked.

    Attributes:
        run: Id of the stored run.
        time: Which time [s], as it is written in the link; empty if it names none.
    """

    run: Annotated[str, MaxLen(200)]
    time: Annotated[str, MaxLen(40)]


@dataclass(frozen=True, slots=True)
class AnnotateRecording(Intent):
    """The user has written something about a stored run; not validated yet.

    Attributes:
        run_id: The run.
        revision: The revision that the user saw.
        name: What to call it.
        tags: Words to find it by, with commas between them.
        notes: What else there is to say.
    """

    run_id: str
    revision: str
    name: str
    tags: str
    notes: str


@dataclass(frozen=True, slots=True)
class DeleteRecording(Intent):
    """The user wants a stored run to be gone, and has confirmed it.

    Attributes:
        run_id: The run.
        revision: The revision when the user confirmed.
    """

    run_id: str
    revision: str


@dataclass(frozen=True, slots=True)
class RecordingsListed(Intent):
    """A page of the stored runs.

    Attributes:
        page: Which page.
        count: How many runs there are on all pages.
        runs: Those of this page.
        recent: The newest runs, whatever is listed.
        chosen_id: The run that the user had chosen, empty for none.
        chosen: Its present description; None if it is gone.
        elapsed: How long it took to find out [s].
    """

    page: int
    count: int
    runs: tuple[StoredRun, ...]
    recent: tuple[StoredRun, ...] = ()
    chosen_id: str = ""
    chosen: StoredRun | None = None
    elapsed: float = 0.0


@dataclass(frozen=True, slots=True)
class RecordingChanged(Intent):
    """A stored run was changed as asked for.

    Attributes:
        run_id: The run.
        stored: Its present description; None if it was deleted.
    """

    run_id: str
    stored: StoredRun | None


@dataclass(frozen=True, slots=True)
class RecordingRefused(Intent):
    """Something about a stored run was not done: what, and why."""

    what: str
    message: str


@dataclass(frozen=True, slots=True)
class RecordingOpened(Intent):
    """A recording is there to be shown; ``number`` is that of the request."""

    number: int
    replay: Replay


@dataclass(frozen=True, slots=True)
class RecordingUnreadable(Intent):
    """A recording could not be opened, with the reason."""

    number: int
    message: str
