"""Errors of the core: only for invalid input, never for physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class SlipgraspError(Exception):
    """Base class of all errors of this project."""


@dataclass(frozen=True, slots=True)
class FieldError:
    """One wrong input: field, value, limit and a sentence.

    Attributes:
        field: Dotted key, empty for the scenario as a whole.
        value: Given value as finite number, short text or None.
        limit: Violated bound or set of choices as text.
        message: The error and its correction, in one sentence.
    """

    field: str
    value: float | int | bool | str | None
    limit: str | None
    message: str

    @classmethod
    def at(
        cls, field: str, value: float | int | bool | str | None, limit: str | None, problem: str
    ) -> FieldError:
        """The error of a field, whose message is its key and the problem."""
        return cls(field, value, limit, f"{field} {problem}")


class ScenarioError(SlipgraspError, ValueError):
    """A scenario that cannot be simulated, with one item per wrong field."""

    def __init__(self, errors: Sequence[FieldError]) -> None:
        self.errors = tuple(errors)
        super().__init__("; ".join(error.message for error in self.errors))
