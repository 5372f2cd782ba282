"""Runs, parameters and numbers in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from core.result import RunResult
from core.types import Outcome

__all__ = [
    "Verdict",
    "describe_outcome",
    "key_words",
    "milliseconds",
    "unit_words",
]

Tone = Literal["good", "warning", "bad"]

_HEADLINES = {
    Outcome.SEPARATED: "Dropped: a contact came apart",
    Outcome.LEFT_FACE: "Lost: a fingertip slid off its face",
    Outcome.SINGULAR: "Ended: a finger ran out of reach",
    Outcome.CHATTERING: "Never settles: stick and slip alternate without end",
    Outcome.INCONSISTENT: "Ended: no phase of the contacts is consistent",
    Outcome.DIVERGED: "Ended: the numbers ran away",
    Outcome.LIMIT: "Cut short: the run reached a limit",
    Outcome.STOPPED: "Stopped",
    Outcome.FAILED: "Failed",
    Outcome.RECOVERED: "Recovered from an unfinished recording",
}

_SUPERSCRIPTS = str.maketrans({"2": "²", "3": "³"})


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a run went: a tone, a headline, and a few sentences."""

    tone: Tone
    headline: str
    sentences: tuple[str, ...]


def describe_outcome(result: RunResult) -> Verdict:
    """Says in words how a run ended, what slipped, and what to try."""
    slips = _describe_slips(result)
    if result.outcome is not Outcome.COMPLETED:
        return Verdict("bad", _HEADLINES[result.outcome], (*_describe_reason(result), slips))
    if result.metrics.held:
        return Verdict("good", "Held", (slips,))
    if result.metrics.slipping_at_end:
        return Verdict("warning", "Not held: still slipping at the end", (slips,))
    return Verdict("warning", "Not settled: it slipped in the last half second", (slips,))


def _describe_reason(result: RunResult) -> tuple[str, ...]:
    reason = result.reason
    if reason is None:
        return ()
    return tuple(_sentence(text) for text in (reason.message, reason.hint) if text)


def _describe_slips(result: RunResult) -> str:
    """Who slipped how far, and until when."""
    names = result.scenario.finger_names
    paths = result.metrics.slip_path
    slipped = [i for i, path in enumerate(paths) if path > 0.0]
    if not slipped:
        return "No fingertip slipped."
    lengths = _join([f"{1e3 * paths[i]:.3g} mm {names[i]}" for i in slipped])
    who = _fingertips([names[i] for i in slipped], len(names))
    return f"{who} slipped, {lengths}{_describe_end_of_slip(result)}."


def _fingertips(names: Sequence[str], total: int) -> str:
    """Some of the fingertips, as the subject of a sentence."""
    if len(names) == 1:
        return f"The {names[0]} fingertip"
    if len(names) == total:
        return "Both fingertips" if total == 2 else "All fingertips"
    return f"The {_join(names)} fingertips"


def _describe_end_of_slip(result: RunResult) -> str:
    last = result.metrics.last_slip_time
    if last is None or result.metrics.slipping_at_end:
        return ""
    return f", and stopped at t = {milliseconds(last)}"


def key_words(key: str, names: Sequence[str]) -> str:
    """A dotted key in words: ``fingers.0.link_masses.1`` as ``left link mass 2``.

    Args:
        key: The key.
        names: What the fingers are called.
    """
    parts = key.split(".")
    words: list[str] = []
    for i, part in enumerate(parts):
        following_is_index = i + 1 < len(parts) and parts[i + 1].isdigit()
        if not part.isdigit():
            words += [] if part == "fingers" else [_singular(part) if following_is_index else part]
        elif parts[i - 1] == "fingers":
            words.append(names[int(part)])
        else:
            words.append(str(int(part) + 1))
    return " ".join(words).replace("_", " ")


def unit_words(unit: str) -> str:
    """A unit for a label, such as `` [kg m²]``; nothing for pure numbers."""
    return "" if unit in ("", "1") else f" [{unit.replace('^', '').translate(_SUPERSCRIPTS)}]"


def milliseconds(time: float) -> str:
    """A time in milliseconds while that is short, else in seconds [s]."""
    return f"{1e3 * time:.0f} ms" if time < 1.0 else f"{time:.2f} s"


def _join(words: Sequence[str]) -> str:
    """Words as a list in a sentence: ``a, b and c``."""
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _singular(word: str) -> str:
    return word.removesuffix("es") if word.endswith("sses") else word.removesuffix("s")


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."
