"""Progress and results of a study as text for the terminal."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from slipgrasp.cli.progress import Progress
from slipgrasp.cli.tables import table_lines

if TYPE_CHECKING:
    from slipgrasp.recordings.study.results import StudyResults
    from slipgrasp.recordings.study.results_comparison import CombinationComparison
    from slipgrasp.recordings.study.study_row import StudyRow


MOST_REASONS = 3
LONGEST_VALUE = 48


def report(results: StudyResults, seconds: float, saved: dict[str, Any], message: str) -> str:
    """Outcomes of the runs, effect of the crossed values, and saved files.

    Args:
        results: The results.
        seconds: Duration of the runs [s].
        saved: Saved files: path, or paths, by name.
        message: A further paragraph.
    """
    from slipgrasp.core.study.knowledge import describe_knowledge_in

    study, compared = results.study, results.compare_combinations()
    blocks = [
        [study.title] if study.title else [],
        [*_outcome(results, seconds), *filter(None, [describe_knowledge_in(study)])],
        _outcomes(results),
        _comparison(compared) if compared is not None else [],
        [message] if message else [],
        list(_saved(saved)),
    ]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines)


def _outcome(results: StudyResults, seconds: float) -> list[str]:
    summary = results.summary()
    done = f"{summary.finished} of {summary.runs}" if summary.finished < summary.runs else "All"
    runs = "runs" if done != "All" else f"{summary.runs} runs"
    known = summary.finished - summary.too_short
    has_hand = results.study.base.space.has_hand
    done_well = "held the object" if has_hand else "came to rest"
    lines = [
        f"{done} {runs} done, in {duration_words(seconds)}; "
        f"{summary.held} {done_well} ({_percent(summary.held, known)})."
    ]
    if summary.too_short:
        lines.append(
            f"{summary.too_short} of them are completed, but too short to tell whether the "
            f"{'object is held' if has_hand else 'body rests'}; the share excludes them."
        )
    return lines


def _outcomes(results: StudyResults) -> list[str]:
    summary = results.summary()
    reasons: dict[str, dict[str, int]] = {}
    for word, code in zip(results.values("outcome"), results.values("reason"), strict=True):
        if code is not None:
            counts = reasons.setdefault(word, {})
            counts[code] = counts.get(code, 0) + 1
    rows = [
        (word, str(count), _percent(count, summary.finished), _reasons(reasons.get(word, {})))
        for word, count in summary.outcomes.items()
    ]
    return table_lines([("outcome", "runs", "share", "reasons"), *rows], left=(0, 3))


def _reasons(counts: dict[str, int]) -> str:
    if len(counts) < 2:
        return "".join(counts)
    ordered = sorted(counts.items(), key=lambda item: -item[1])
    words = [f"{count} {code}" for code, count in ordered[:MOST_REASONS]]
    return ", ".join(words) + (" …" if len(ordered) > MOST_REASONS else "")


def _comparison(compared: CombinationComparison) -> list[str]:
    names = [
        ", ".join(f"{key} = {_value(value)}" for key, value in combination.values.items())
        for combination in compared.combinations
    ]
    rows = [
        (name, str(one.runs), str(one.held), _percent(one.held, one.runs - one.too_short))
        for name, one in zip(names, compared.combinations, strict=True)
    ]
    lines = table_lines([("compared", "runs", "held", "share"), *rows])
    if len(compared.pairs) == 1:
        pair = compared.pairs[0]
        lines.append(
            f"On the same {pair.samples} samples both held {pair.held_by_both}, only the first "
            f"{pair.held_by_first}, only the second {pair.held_by_second}, "
            f"neither {pair.held_by_neither}."
        )
    return lines


def _value(value: Any) -> str:
    shown = f"{value:g}" if isinstance(value, float) else str(value)
    return shown[:LONGEST_VALUE]


def _saved(saved: dict[str, Any]) -> Iterator[str]:
    for name, place in saved.items():
        for path in place if isinstance(place, list) else [place]:
            if path is not None:
                yield f"{name:<10}  {path}"


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f} %" if whole else "–"


def duration_words(seconds: float) -> str:
    """A time in words: ``40 s``, ``12 min``, ``3.5 h``, ``2.1 days``."""
    if seconds < 100.0:
        return f"{seconds:.2g} s" if seconds < 10.0 else f"{seconds:.0f} s"
    if seconds < 6000.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.3g} h" if seconds < 172_800.0 else f"{seconds / 86_400.0:.3g} days"


def size_words(num_bytes: int) -> str:
    """A size in words: ``4.2 MB``."""
    for unit, factor in (("TB", 10**12), ("GB", 10**9), ("MB", 10**6)):
        if num_bytes >= factor:
            return f"{num_bytes / factor:.3g} {unit}"
    return f"{num_bytes / 1000:.3g} kB"


WINDOW = 200
"""Number of updates over which the rate is computed."""

NEWS_PERIOD = 0.1


class StudyProgress:
    """Reports the progress of a study.

    Args:
        progress: The line of progress.
        num_runs: Number of runs.
    """

    def __init__(self, progress: Progress, num_runs: int) -> None:
        self._progress = progress
        self._num_runs = num_runs
        self._news: deque[tuple[float, int]] = deque(maxlen=WINDOW)

    def note(self, results: StudyResults, row: StudyRow) -> None:
        """Appends a run to the results, and shows the progress."""
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
