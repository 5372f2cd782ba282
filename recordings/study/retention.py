"""Which recordings may go: those beyond an age, a number or a size that nobody has marked.

What somebody has named, tagged or written notes about stays. A study names and tags its recordings
by itself, which marks none, as each can be made again from the study's results; while the study is
not finished they stay, too. The results of studies always stay.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum

from slipgrasp.recordings.exceptions import RecordingChangedError, RecordingNotFoundError
from slipgrasp.recordings.store.annotations import Annotations
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.stored_study import StoredStudy
from slipgrasp.recordings.study.study_store import StudyNotFoundError, StudyStore

_RUN_OF_STUDY = re.compile(r"(?s).*, run ([0-9]{1,9})")
_TAG_OF_STUDY = re.compile(r"study ([a-z0-9]{12})")


class Rule(StrEnum):
    """By what a run goes."""

    AGE = "age"
    COUNT = "count"
    SIZE = "size"


@dataclass(frozen=True, slots=True, kw_only=True)
class Retention:
    """How much is kept of what nobody has marked, the newest first; None is no bound.

    Attributes:
        max_age: Older ones go.
        max_runs: How many stay.
        max_bytes: How many bytes their recordings may take together.
    """

    max_age: timedelta | None = None
    max_runs: int | None = None
    max_bytes: int | None = None

    @property
    def keeps_all(self) -> bool:
        """Whether nothing ever goes."""
        return self.max_age is self.max_runs is self.max_bytes is None


KEEP_ALL = Retention()


@dataclass(frozen=True, slots=True)
class Expired:
    """A run that may go, and by which rule."""

    run: StoredRun
    rule: Rule


def find_expired(
    runs: RecordingStore, studies: StudyStore, retention: Retention, now: datetime
) -> list[Expired]:
    """The runs that may go, newest first; nothing is changed.

    Args:
        runs: Where they are kept.
        studies: The studies whose recordings are among them.
        retention: What stays.
        now: From when ages count.
    """
    marks = _Marks(studies)
    unmarked = [run for run in runs.list() if not marks.has(run)]
    expired, num_kept, bytes_kept = [], 0, 0
    full: Rule | None = None
    for run in unmarked:
        if _is_older(run, retention.max_age, now):
            expired.append(Expired(run, Rule.AGE))
            continue
        # Where one goes because those before it take all there is, the older ones go, too.
        full = full or _find_full(retention, num_kept, bytes_kept + run.size)
        if full is not None:
            expired.append(Expired(run, full))
            continue
        num_kept, bytes_kept = num_kept + 1, bytes_kept + run.size
    return expired


def delete_expired(runs: RecordingStore, expired: Iterable[Expired]) -> list[Expired]:
    """Deletes runs, but for those that were changed since they were found.

    Returns:
        Those that are gone.

    Raises:
        RecordingError: If one cannot be deleted.
    """
    deleted = []
    for each in expired:
        try:
            runs.delete(each.run.id, expected=[each.run.revision])
        except (RecordingChangedError, RecordingNotFoundError):
            continue
        deleted.append(each)
    return deleted


def _is_older(run: StoredRun, max_age: timedelta | None, now: datetime) -> bool:
    return max_age is not None and now - datetime.fromisoformat(run.created) > max_age


def _find_full(retention: Retention, num_kept: int, num_bytes: int) -> Rule | None:
    if retention.max_runs is not None and num_kept >= retention.max_runs:
        return Rule.COUNT
    if retention.max_bytes is not None and num_bytes > retention.max_bytes:
        return Rule.SIZE
    return None


class _Marks:
    """Tells which runs are marked, and looks at each study once.

    Args:
        studies: The studies.
    """

    def __init__(self, studies: StudyStore) -> None:
        self._studies = studies
        self._seen: dict[str, StoredStudy | None] = {}

    def has(self, run: StoredRun) -> bool:
        """Whether somebody has marked a run, or its study is not finished."""
        if run.annotations == Annotations():
            return False
        tag, name = _TAG_OF_STUDY.fullmatch(" ".join(run.tags)), _RUN_OF_STUDY.fullmatch(run.name)
        if tag is None or name is None:
            return True
        return not self._is_own_mark(run, tag[1], int(name[1]))

    def _is_own_mark(self, run: StoredRun, study_id: str, index: int) -> bool:
        if study_id not in self._seen:
            self._seen[study_id] = self._find_finished(study_id)
        stored = self._seen[study_id]
        if stored is None:
            return False
        return (run.id, run.annotations) == self._studies.mark_of(stored, index)

    def _find_finished(self, study_id: str) -> StoredStudy | None:
        with suppress(StudyNotFoundError):
            stored = self._studies.get(study_id)
            return stored if stored.end is not None else None
        return None
