"""Annotations of a run by users: a name, notes and tags, with limits."""

from __future__ import annotations

import logging
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Annotated, Any, get_type_hints

from pydantic import AfterValidator, StringConstraints, TypeAdapter, ValidationError
from pydantic.types import Strict

from slipgrasp.recordings.exceptions import AnnotationError

MAX_NAME_LENGTH = 200
MAX_NOTES_LENGTH = 10_000
MAX_TAGS = 32
MAX_TAG_LENGTH = 64

_LINE_CONTROLS = "\n\r\t"

_logger = logging.getLogger(__name__)


def _check_printable(text: str) -> str:
    if not text.isprintable():
        raise ValueError("only printable characters are allowed, on one line")
    return text


def _check_text(text: str) -> str:
    unfit = (c for c in text if unicodedata.category(c) in ("Cc", "Cs") and c not in _LINE_CONTROLS)
    if any(unfit):
        raise ValueError("control characters and lone surrogates are not allowed")
    return text


def _check_tags(tags: tuple[str, ...]) -> tuple[str, ...]:
    """Removes duplicate tags, keeping the order."""
    if len(tags) > MAX_TAGS:
        raise ValueError(f"at most {MAX_TAGS} tags are allowed")
    return tuple(dict.fromkeys(tags))


RunName = Annotated[
    str,
    Strict(),
    StringConstraints(strip_whitespace=True, max_length=MAX_NAME_LENGTH),
    AfterValidator(_check_printable),
]
RunNotes = Annotated[
    str, Strict(), StringConstraints(max_length=MAX_NOTES_LENGTH), AfterValidator(_check_text)
]
RunTag = Annotated[
    str,
    Strict(),
    StringConstraints(strip_whitespace=True, min_length=1, max_length=MAX_TAG_LENGTH),
    AfterValidator(_check_printable),
]
RunTags = Annotated[tuple[RunTag, ...], AfterValidator(_check_tags)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Annotations:
    """Annotations of a run; all empty initially.

    Attributes:
        name: At most 200 printable characters.
        notes: At most 10 000 characters, in several lines.
        tags: At most 32 distinct tags of at most 64 printable characters.
    """

    name: RunName = ""
    notes: RunNotes = ""
    tags: RunTags = ()

    @classmethod
    def checked(cls, values: Mapping[str, Any]) -> Annotations:
        """Validates annotations.

        Raises:
            AnnotationError: If one exceeds its limits.
        """
        found = {}
        for name, value in values.items():
            try:
                found[name] = _validator(name).validate_python(value)
            except ValidationError as error:
                raise AnnotationError(name, _words(error)) from error
        return cls(**found)


def usable_part(document: Mapping[str, Any]) -> Annotations:
    """Reads the annotations in an untrusted document.

    Invalid ones are omitted with a warning in the log.
    """
    found = {}
    for name in (field.name for field in fields(Annotations) if field.name in document):
        try:
            found[name] = _validator(name).validate_python(document[name])
        except ValidationError as error:
            _logger.warning("invalid %s of a recording are omitted: %s", name, _words(error))
    return Annotations(**found)


@cache
def _validator(name: str) -> TypeAdapter[Any]:
    return TypeAdapter(get_type_hints(Annotations, include_extras=True)[name])


def _words(error: ValidationError) -> str:
    text = str(error.errors(include_url=False)[0]["msg"]).removeprefix("Value error, ")
    return f"{text[:1].lower()}{text[1:]}"
