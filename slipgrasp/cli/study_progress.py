"""How far a study is, how fast it goes and how long it will take, in words."""

from __future__ import annotations

import time
from collections import deque
from typing import TYPE_CHECKING

from slipgrasp.cli.progress import Progress
from slipgrasp.cli.study_report import duration_words

if TYPE_CHECKING:
    from slipgrasp.recordings.study.results import StudyResults
    from slipgrasp.recordings.study.study_row import StudyRow

WINDOW = 200
"""The rate is that of the last so many pieces of news."""

NEWS_PERIOD = 0.1


class StudyProgress:
    """Tells how a study gets on.

    Args:
        progress: The line that is shown.
        num_runs: How many runs there are.
    """

    def __init__(self, progress: Progress, num_runs: int) -> None:
        self._progress = progress
        self._num_runs = num_runs
        self._news: deque[tuple[float, int]] = deque(maxlen=WINDOW)

    def note(self, results: StudyResults, row: StudyRow) -> None:
        """Takes a row into the results, and tells."""
        results.append(row)
        now = time.monotonic()
        if not self._news:
            self._news.append((now, results.num_rows))
        elif now - self._news[-1][0] >= NEWS_PERIOD:
            self._news.append((now, results.num_rows))
            self._progress.update(results.num_rows / self._num_runs, self._details())

    def _details(self) -> str:
        (start, before), (now, done) = self._news[0], self._news[-1]
        rate = (done - before) / (now - start)
        left = f", {duration_words((self._num_runs - done) / rate)} left" if rate > 0.0 else ""
        return f"{done} of {self._num_runs} runs, {rate:.3g} runs/s{left}"
