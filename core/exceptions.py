"""Errors that the core raises: only for invalid input, never for physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class SlipgraspError(Exception):
    """Base of all errors this project raises."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldError:
    """One wrong input: which field, what it held, what is allowed, and a sentence.

    Attributes:
        field: Dotted key, empty for the scenario as a whole.
        value: What was given, as finite number, short text or None.
        limit: The bound or set of choices that was violated, in words.
        message: What is wrong and the way out, in one sentence.
    """

    field: str
    value: float | int | bool | str | None
    limit: str | None
    message: str


class ScenarioError(SlipgraspError, ValueError):
    """A scenario that cannot be simulated, with one entry per wrong field."""

    def __init__(self, errors: Sequence[FieldError]) -> None:
        self.errors = tuple(errors)
        super().__init__("; ".join(error.message for error in self.errors))
