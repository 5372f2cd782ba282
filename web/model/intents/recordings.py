"""Intents about stored runs, and the answers of their worker."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Interval, MaxLen

from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent, Key, LatestIntent
from slipgrasp.web.model.replay import Replay


class ListRecordings(LatestIntent, right=Right.READ):
    """Requests a page of the stored runs; 0 is the newest."""

    page: Annotated[int, Interval(ge=0, le=1_000_000)]


class FilterRecordings(LatestIntent):
    """Filters the stored runs, see `slipgrasp.web.model.run_list`."""

    text: str
    outcome: str


class ChooseRecording(LatestIntent, right=Right.READ):
    """Selects a stored run; its id is not validated yet, empty for none."""

    run_id: Key


class OpenRecording(LatestIntent, right=Right.READ):
    """Opens a stored run; its id is not validated yet."""

    run_id: Key


class OpenLink(LatestIntent, right=Right.READ):
    """The page was opened with a link, of which only the lengths are checked.

    Attributes:
        run: Id of the stored run.
        time: Time in the link [s]; empty if there is none.
    """

    run: Annotated[str, MaxLen(200)]
    time: Annotated[str, MaxLen(40)]


class AnnotateRecording(Intent):
    """Changes the annotations of a stored run; not validated yet.

    Attributes:
        run_id: The run.
        revision: The revision that the user saw.
        name: Name of the run.
        tags: Tags, separated by commas.
        notes: Notes.
    """

    run_id: str
    revision: str
    name: str
    tags: str
    notes: str


class DeleteRecording(Intent):
    """Deletes a stored run after a confirmation.

    Attributes:
        run_id: The run.
        revision: The revision when the user confirmed.
    """

    run_id: str
    revision: str


class RecordingsListed(Intent):
    """A page of the stored runs.

    Attributes:
        page: Index of the page.
        count: Number of runs on all pages.
        runs: Runs of the page.
        recent: The newest runs, regardless of the filter.
        chosen_id: The selected run, empty for none.
        chosen: Its current description; None if it was deleted.
        elapsed: Duration of the query [s].
    """

    page: int
    count: int
    runs: tuple[StoredRun, ...]
    recent: tuple[StoredRun, ...] = ()
    chosen_id: str = ""
    chosen: StoredRun | None = None
    elapsed: float = 0.0


class RecordingChanged(Intent):
    """A stored run was changed.

    Attributes:
        run_id: The run.
        stored: Its current description; None if it was deleted.
    """

    run_id: str
    stored: StoredRun | None


class RecordingRefused(Intent):
    """An operation on a stored run failed: title and reason."""

    what: str
    message: str


class RecordingOpened(Intent):
    """A recording is loaded; ``number`` is that of the request."""

    number: int
    replay: Replay


class RecordingUnreadable(Intent):
    """A recording could not be opened, with the reason."""

    number: int
    message: str
