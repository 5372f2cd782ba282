"""Retention of recordings: deletes unmarked ones beyond an age, a number or a size.

Runs with a name, a tag or notes from a user are retained. Names and tags that a study gives to its
recordings do not count, because these can be simulated again from the study's results; they are
retained until the study is finished. Results of studies are always retained.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum

from slipgrasp.recordings.exceptions import RecordingChangedError, RecordingNotFoundError
from slipgrasp.recordings.store.annotations import Annotations
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.recordings.study.study_store import StoredStudy, StudyNotFoundError, StudyStore

_RUN_OF_STUDY = re.compile(r"(?s).*, run ([0-9]{1,9})")
_TAG_OF_STUDY = re.compile(r"study ([a-z0-9]{12})")


class Rule(StrEnum):
    """The rule by which a run is deleted."""

    AGE = "age"
    COUNT = "count"
    SIZE = "size"


@dataclass(frozen=True, slots=True, kw_only=True)
class Retention:
    """Limits for unmarked runs, of which the newest are retained; None is no limit.

    Attributes:
        max_age: Older runs are deleted.
        max_runs: Number of retained runs.
        max_bytes: Total size of retained recordings [bytes].
    """

    max_age: timedelta | None = None
    max_runs: int | None = None
    max_bytes: int | None = None

    @property
    def keeps_all(self) -> bool:
        """Whether there is no limit."""
        return self.max_age is self.max_runs is self.max_bytes is None


KEEP_ALL = Retention()

LARGEST_SHARE = 10
"""Inverse of the largest fraction of runs that is deleted at a time; at least one run is."""

LONGEST_GAP = timedelta(days=3)
"""Largest distance of the clock from the newest run; beyond it, the clock may be wrong."""


@dataclass(frozen=True, slots=True)
class Expired:
    """A run that may be deleted, with the rule that allows it."""

    run: StoredRun
    rule: Rule


def find_expired(
    runs: RecordingStore,
    studies: StudyStore,
    retention: Retention,
    now: datetime,
    used: Collection[str] = (),
) -> list[Expired]:
    """Finds the runs that may be deleted, newest first, without deleting them.

    Args:
        runs: Store of the runs.
        studies: Store of the studies of these recordings.
        retention: Retention rules.
        now: Reference time of ages.
        used: Ids of runs that stay, whatever their age.
    """
    marks = _Marks(studies)
    unmarked = [run for run in runs.list() if run.id not in used and not marks.has(run)]
    expired, num_kept, bytes_kept = [], 0, 0
    full: Rule | None = None
    for run in unmarked:
        if _is_older(run, retention.max_age, now):
            expired.append(Expired(run, Rule.AGE))
            continue
        # If a run exceeds the size limit, all older ones are deleted too.
        full = full or _find_full(retention, num_kept, bytes_kept + run.size)
        if full is not None:
            expired.append(Expired(run, full))
            continue
        num_kept, bytes_kept = num_kept + 1, bytes_kept + run.size
    return expired


def in_share(expired: Sequence[Expired], num_runs: int, *, at_start: bool) -> list[Expired]:
    """Selects runs to delete at one time: at most a fraction of the folder, the oldest first.

    A wrong rule, or a wrong clock, then costs a tenth of an archive before somebody notices. The
    limit applies to all runs at a start, and later to runs deleted by age: number and size do not
    depend on the clock, and must also be enforced in a folder that grows fast.

    Args:
        expired: Result of `find_expired`.
        num_runs: Number of runs in the folder.
        at_start: Whether this is the first deletion since the service started.
    """
    most = max(num_runs // LARGEST_SHARE, 1)
    bounded = [each for each in expired if at_start or each.rule is Rule.AGE]
    others = [each for each in expired if not at_start and each.rule is not Rule.AGE]
    return [*others, *bounded[-most:]]


class TrustedClock:
    """The wall clock, limited by the age of the newest run at the start.

    It is at most some days, plus the time since the start, ahead of that run. Beyond that,
    ages are counted from an earlier time, and runs are retained longer.

    Args:
        runs: Store of the runs, read at the first call.
        clock: The wall clock.
        passed: Returns the elapsed time [s].
    """

    def __init__(
        self,
        runs: RecordingStore,
        clock: Callable[[], datetime] = lambda: datetime.now(UTC),
        passed: Callable[[], float] = time.monotonic,
    ) -> None:
        self._runs = runs
        self._clock = clock
        self._passed = passed
        self._latest: tuple[datetime, float] | None = None

    def now(self) -> datetime:
        """Reference time of ages: the wall clock, or an earlier time."""
        told = self._clock()
        if self._latest is None:
            newest = [datetime.fromisoformat(run.created) for run in self._runs.list(limit=1)]
            latest = newest[0] + LONGEST_GAP if newest else told
            self._latest = latest, self._passed()
        latest, began = self._latest
        return min(told, latest + timedelta(seconds=self._passed() - began))

    def lag(self) -> timedelta:
        """Difference of the wall clock from the trusted time."""
        return self._clock() - self.now()


def delete_expired(runs: RecordingStore, expired: Iterable[Expired]) -> list[Expired]:
    """Deletes runs, except those that were changed since they were found.

    Returns:
        The deleted runs.

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
    """Finds the marked runs, reading each study once.

    Args:
        studies: Store of the studies.
    """

    def __init__(self, studies: StudyStore) -> None:
        self._studies = studies
        self._seen: dict[str, StoredStudy | None] = {}

    def has(self, run: StoredRun) -> bool:
        """Whether a user has marked a run, or its study is unfinished."""
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
