"""Reads an untrusted JSON request body.

Beyond ``json``, it requires unique, short names in ASCII, text that can be stored as UTF-8, and
limited depth and size, so that later code need not protect itself against recursion or
millions of names. Numbers that exceed floats are read as infinite; validation then rejects them by
the name of their field.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request

from slipgrasp.core.exceptions import FieldError
from slipgrasp.server.exceptions import (
    InvalidRequestError,
    UnreadableBodyError,
    UnsupportedBodyError,
    printable,
)
from slipgrasp.server.http.errors import invalid_fields

JSON_TYPE = "application/json"
MERGE_TYPE = "application/merge-patch+json"

MAX_DEPTH = 12
MAX_NAMES = 200
MAX_NAME_LENGTH = 100
MAX_VALUES = 10_000
MAX_FINDINGS = 20
_MAX_DIGITS = 308

Body = TypeVar("Body", bound=BaseModel)


async def read_body(request: Request, kind: type[Body], types: tuple[str, ...]) -> Body:
    """The JSON body of a request.

    Args:
        request: The request.
        kind: Expected kind.
        types: Allowed content types; the first is suggested.

    Raises:
        UnsupportedBodyError: If its content type is not JSON.
        UnreadableBodyError: If it is not JSON.
        InvalidRequestError: If it is of another kind.
    """
    value = await read_values(request, types, MAX_VALUES)
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        known = [field.alias or name for name, field in kind.model_fields.items()]
        raise InvalidRequestError(invalid_fields(error.errors(), known)) from error


async def read_values(request: Request, types: tuple[str, ...], max_values: int) -> Any:
    """The JSON body of a request as plain values.

    Args:
        request: The request.
        types: Allowed content types; the first is suggested.
        max_values: Largest number of values.

    Raises:
        UnsupportedBodyError: If its content type is not JSON.
        UnreadableBodyError: If it is not JSON.
        InvalidRequestError: If it contains something that no request may contain.
    """
    content_type = request.headers.get("content-type", "")
    if content_type.partition(";")[0].strip().lower() not in types:
        raise UnsupportedBodyError(content_type, types[0])
    try:
        body = await request.body()
    except ClientDisconnect as error:
        raise UnreadableBodyError("its sender has disconnected") from error
    return await run_in_threadpool(read_json, body, max_values)


def read_json(body: bytes, max_values: int = MAX_VALUES) -> Any:
    """Parses a request body.

    Args:
        body: The received bytes.
        max_values: Largest number of values.

    Returns:
        Plain values: dict, list, str, int, float, bool or None.

    Raises:
        UnreadableBodyError: If it is not JSON.
        InvalidRequestError: If it contains something that no request may contain.
    """
    try:
        text = body.decode("utf-8")
    except UnicodeDecodeError as error:
        raise UnreadableBodyError(f"byte {error.start} is not UTF-8") from error
    if not text.strip():
        raise UnreadableBodyError("it is empty")
    try:
        value = json.loads(text, object_pairs_hook=_read_object, parse_int=_read_integer)
    except json.JSONDecodeError as error:
        found = f"{error.msg.lower()} at line {error.lineno} column {error.colno}"
        raise UnreadableBodyError(found) from error
    except RecursionError as error:
        raise UnreadableBodyError(f"it is nested deeper than {MAX_DEPTH} levels") from error
    if findings := list(islice(_find_faults(value, max_values), MAX_FINDINGS)):
        raise InvalidRequestError(findings)
    return value


def _read_object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) < len(pairs):
        (name, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        twice = printable(name)
        raise InvalidRequestError(
            [_fault(twice, None, "each name once", f"'{twice}' is given twice")]
        )
    return members


def _read_integer(digits: str) -> int | float:
    return int(digits) if len(digits) <= _MAX_DIGITS else math.copysign(math.inf, float(digits[:2]))


def _find_faults(root: Any, max_values: int) -> Iterator[FieldError]:
    """Walks the values without recursion."""
    branches: list[tuple[str, int, Any]] = [("", 0, root)]
    num_values = 0
    while branches:
        field, depth, value = branches.pop()
        num_values += 1
        if num_values > max_values:
            limit = f"{max_values} values"
            yield _fault("", None, limit, f"the body contains more than {limit}")
            return
        if depth > MAX_DEPTH:
            limit = f"{MAX_DEPTH} levels"
            yield _fault(field, None, limit, f"{field}: nested deeper than {limit}")
        elif isinstance(value, str):
            yield from _find_text_fault(field, value)
        elif isinstance(value, dict):
            yield from _find_name_faults(field, value)
            branches += [(_join(field, name), depth + 1, item) for name, item in value.items()]
        elif isinstance(value, list):
            branches += [(_join(field, str(i)), depth + 1, item) for i, item in enumerate(value)]


def _find_text_fault(field: str, text: str) -> Iterator[FieldError]:
    if any(c == "\0" or "\ud800" <= c <= "\udfff" for c in text):
        limit = "text without null characters or lone surrogates"
        yield _fault(field, printable(text), limit, f"{field}: allowed: {limit}")


def _find_name_faults(field: str, members: dict[str, Any]) -> Iterator[FieldError]:
    if len(members) > MAX_NAMES:
        limit = f"{MAX_NAMES} names"
        yield _fault(field, len(members), limit, f"{field or 'the body'}: more than {limit}")
    for name in members:
        if not name.isascii() or len(name) > MAX_NAME_LENGTH:
            shown = _join(field, name)
            limit = f"plain ASCII, at most {MAX_NAME_LENGTH} characters"
            yield _fault(shown, None, limit, f"unknown field '{shown}'; names are {limit}")


def _join(field: str, name: str) -> str:
    return f"{field}.{printable(name)}" if field else printable(name)


def _fault(
    field: str, value: float | int | str | None, limit: str | None, message: str
) -> FieldError:
    return FieldError(field=field, value=value, limit=limit, message=message)
