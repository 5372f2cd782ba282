"""Common parts of sentences: lists, times, lengths."""

from __future__ import annotations

from collections.abc import Sequence

_LENGTHS = ((1e-3, "mm", 1e3), (1e-6, "µm", 1e6), (1e-9, "nm", 1e9))
_LEAST_LENGTH = 1e-9


def joined(words: Sequence[str], last: str = "and") -> str:
    """Joins words to a list in a sentence: ``a, b and c``.

    Args:
        words: The words.
        last: Conjunction before the last word.
    """
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def some_of(names: Sequence[str], total: int, noun: str) -> str:
    """Names of some of the fingers or fingertips: ``both fingers``, ``the left fingertip``.

    Args:
        names: Their names.
        total: Number of fingers of the hand.
        noun: ``finger`` or ``fingertip``.
    """
    if len(names) == total > 1:
        return f"{'both' if total == 2 else 'all'} {noun}s"
    return f"the {joined(names)} {noun}{'s' if len(names) > 1 else ''}"


def sentence(text: str) -> str:
    """Adds a capital letter and a full stop."""
    return text[:1].upper() + text[1:].rstrip(".") + "." if text else ""


def milliseconds(time: float) -> str:
    """Formats a time in milliseconds if it is short, else in seconds [s]."""
    return f"{1e3 * time:.0f} ms" if time < 1.0 else f"{time:.3f} s"


def length_words(length: float) -> str:
    """Formats a nonnegative length [m] with a suitable unit: ``2.59 mm``, ``6.03 µm``."""
    if length < _LEAST_LENGTH:
        return "less than 1 nm" if length > 0.0 else "0 mm"
    # A tenth of a millimetre is shown in millimetres.
    unit, factor = next((u, f) for least, u, f in _LENGTHS if length >= 0.1 * least or u == "nm")
    value = factor * length
    return f"{value:.0f} {unit}" if value >= 100.0 else f"{value:#.3g} {unit}"
