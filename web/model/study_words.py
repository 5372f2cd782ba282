"""Studies in words: what varies, what it costs, how far it is, and where to find the others."""

from __future__ import annotations

from typing import Any

from slipgrasp.core.words.parameter_words import unit_after
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.web.model.replay import moment_words

_LONGEST_TITLE = 44


def value_words(value: Any, unit: str = "") -> str:
    """A value as a person writes it, with its unit."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    return f"{value:.4g}{unit_after(unit)}"


def number_words(count: int, noun: str) -> str:
    """A number of things: ``1 run``, ``225 runs``; studies are spelled right."""
    if count == 1:
        return f"1 {noun}"
    plural = f"{noun.removesuffix('y')}ies" if noun.endswith("y") else f"{noun}s"
    return f"{count:,} {plural}".replace(",", "\u202f")


def share_words(count: int, total: int) -> str:
    """A share in percent, such as ``59 %``."""
    if not total:
        return "–"
    share = 100.0 * count / total
    return "< 1 %" if 0.0 < share < 1.0 else f"{share:.0f} %"


def time_words(seconds: float) -> str:
    """A time to wait, as roughly as it is known [s]."""
    if seconds < 1.0:
        return "less than a second"
    if seconds < 90.0:
        return f"about {seconds:.0f} s"
    if seconds < 5400.0:
        return f"about {seconds / 60.0:.0f} min"
    return f"about {seconds / 3600.0:.1f} h"


def progress_words(status: StudyStatus, behind: int) -> str:
    """How far a study is, in a line.

    Args:
        status: The study.
        behind: How many others come first, where it waits.
    """
    total = status.stored.num_runs
    runs = f"{status.finished} of {number_words(total, 'run')}"
    match status.state:
        case StudyState.QUEUED:
            return (
                f"Waiting behind {number_words(behind, 'study')}." if behind else "About to begin."
            )
        case StudyState.RUNNING if not status.finished:
            return f"{number_words(total, 'run')}: starting the processes that simulate …"
        case StudyState.RUNNING:
            rate = "" if status.rate is None else f" · {status.rate:.0f} runs/s"
            left = "" if status.time_left is None else f" · {time_words(status.time_left)} left"
            return f"{runs}{rate}{left}"
        case StudyState.COMPLETED:
            return f"Completed: {number_words(total, 'run')}."
        case StudyState.CANCELLED:
            return f"Cancelled after {runs}."
        case StudyState.FAILED:
            return f"Failed after {runs}."


def list_label(status: StudyStatus) -> str:
    """A study among others to choose from; its id keeps equal ones apart."""
    stored = status.stored
    title = stored.title or " × ".join(stored.keys) or "unreadable study"
    if len(title) > _LONGEST_TITLE:
        title = f"{title[: _LONGEST_TITLE - 1].rstrip()}…"
    moment = moment_words(stored.created)
    runs = number_words(stored.num_runs, "run")
    return f"{title} · {runs} · {status.state.value} · {moment} · {stored.id}"
