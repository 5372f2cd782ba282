"""Conversion of errors to HTTP responses: problem details (RFC 9457)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, ConfigDict
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse
from starlette.routing import Match

from slipgrasp.core.exceptions import FieldError, ScenarioError, SlipgraspError
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.recordings.exceptions import (
    AnnotationError,
    RecordingChangedError,
    RecordingError,
    RecordingNotFoundError,
    RecordingWriteError,
    StorageFullError,
    told_within,
)
from slipgrasp.recordings.study.rebuild import RebuildError
from slipgrasp.server.addresses import DOCS_PATH, from_outside
from slipgrasp.server.exceptions import (
    RETRY_AFTER,
    BodyTooLargeError,
    BodyTooSlowError,
    IdempotencyKeyReusedError,
    InvalidRequestError,
    JobEndedError,
    JobUnfinishedError,
    MemoryLimitError,
    ResultNotFoundError,
    RunForgottenError,
    RunUnfinishedError,
    RunUnrecordableError,
    ServiceBusyError,
    ServiceEndingError,
    UnreadableBodyError,
    UnsupportedBodyError,
    printable,
)
from slipgrasp.server.http.safe_headers import RESOURCE_CONTENT_POLICY, SAFE_HEADERS

_BOUNDS = {"ge": "at least", "le": "at most", "max_length": "length at most"}
_PLACES = ("body", "query", "header", "path", "str", "dict")
_METHODS = ("DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT")


STATUSES: Mapping[type[SlipgraspError], int] = {
    UnreadableBodyError: 400,
    RecordingNotFoundError: 404,
    BodyTooSlowError: 408,
    ResultNotFoundError: 404,
    RunUnfinishedError: 409,
    JobUnfinishedError: 409,
    JobEndedError: 409,
    RebuildError: 409,
    RecordingChangedError: 412,
    BodyTooLargeError: 413,
    UnsupportedBodyError: 415,
    IdempotencyKeyReusedError: 422,
    ScenarioError: 422,
    MemoryLimitError: 422,
    RecordingWriteError: 507,
    RunUnrecordableError: 507,
    StorageFullError: 507,
    RecordingError: 422,
    RunForgottenError: 503,
    ServiceEndingError: 503,
    ServiceBusyError: 503,
}
"""The status of each error; the first match applies."""


class ProblemPublic(BaseModel):
    """An error (RFC 9457, application/problem+json)."""

    model_config = ConfigDict(
        json_schema_extra={
            "example": {
                "type": "about:blank",
                "title": "Unprocessable Content",
                "status": 422,
                "detail": "unknown parameter 'object.masss'; did you mean 'object.mass'?",
                "errors": [
                    {
                        "field": "object.masss",
                        "value": None,
                        "limit": None,
                        "message": "unknown parameter 'object.masss'; did you mean 'object.mass'?",
                    }
                ],
            }
        }
    )

    type: str
    title: str
    status: int
    detail: str
    errors: list[FieldError] = []

    @classmethod
    def responses(cls, statuses: Iterable[int]) -> dict[int | str, dict[str, Any]]:
        """Declares possible problem responses of a route."""
        schema = {"$ref": f"#/components/schemas/{cls.__name__}"}
        content = {"application/problem+json": {"schema": schema}}
        return {
            status: {"description": HTTPStatus(status).phrase, "content": content}
            for status in sorted(statuses)
        }


def problem_response(
    status: int,
    detail: str,
    *,
    errors: Iterable[FieldError] = (),
    headers: Mapping[str, str] | None = None,
) -> JSONResponse:
    """A response in the form of RFC 9457, with the wrong fields if any."""
    content: dict[str, Any] = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
    }
    if listed := [asdict(error) for error in errors]:
        content["errors"] = listed
    # Not every problem passes the middleware that adds these headers to other responses.
    policy = {"Content-Security-Policy": RESOURCE_CONTENT_POLICY}
    return JSONResponse(
        content,
        status,
        {**SAFE_HEADERS, **policy, **(headers or {})},
        media_type="application/problem+json",
    )


def add_error_handlers(app: FastAPI) -> None:
    """Converts all errors of an application to problem documents."""
    app.add_exception_handler(SlipgraspError, _answer_own_error)
    app.add_exception_handler(RequestValidationError, _answer_invalid_request)
    app.add_exception_handler(HTTPException, _answer_http_error)
    app.add_exception_handler(Exception, _answer_unexpected_error)


async def _answer_own_error(request: Request, error: Exception) -> JSONResponse:
    status = next((s for kind, s in STATUSES.items() if isinstance(error, kind)), 500)
    errors: Sequence[FieldError] = ()
    headers: dict[str, str] = {}
    told = told_within(error, request.app.state.settings.data_directory)
    if isinstance(error, ScenarioError):
        errors = error.errors
    elif isinstance(error, AnnotationError):
        errors = (FieldError(field=error.field, value=None, limit=None, message=told),)
    elif status in (400, 422):
        errors = (FieldError(field="", value=None, limit=None, message=told),)
    if isinstance(error, ServiceBusyError):
        headers["Retry-After"] = str(RETRY_AFTER)
    if isinstance(error, BodyTooSlowError):
        # Other clients still send the rest of the body, which is discarded for some seconds,
        # because a client that sends to a closed connection cannot read the response.
        headers["Connection"] = "close"
    return problem_response(status, told, errors=errors, headers=headers)


async def _answer_invalid_request(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    return await _answer_own_error(request, InvalidRequestError(invalid_fields(error.errors())))


async def _answer_http_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    headers = dict(error.headers or {})
    detail = str(error.detail)
    if error.status_code == HTTPStatus.NOT_FOUND:
        path = printable(from_outside(request.url.path))
        detail = f"there is nothing at '{path}'; see {from_outside(DOCS_PATH)}"
    if error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        headers["Allow"] = ", ".join(_allowed_methods(request))
        detail = f"{request.method} is not possible here, only {headers['Allow']}"
    return problem_response(error.status_code, detail, headers=headers)


async def _answer_unexpected_error(request: Request, error: Exception) -> JSONResponse:
    # The server logs the error; its text may be confidential.
    return problem_response(500, "an unexpected error; see the traceback in the server's log")


def _allowed_methods(request: Request) -> list[str]:
    """All methods of a path, because each route lists only its own."""
    return [
        method
        for method in _METHODS
        if any(
            route.matches({**request.scope, "method": method})[0] is Match.FULL
            for route in request.app.router.routes
        )
    ]


def invalid_fields(findings: Iterable[Any], known: Iterable[str] = ()) -> list[FieldError]:
    """Converts pydantic's errors about a request to field errors.

    Args:
        findings: Result of ``errors()`` of a validation error.
        known: Names of the existing fields, as suggestions for an unknown one.
    """
    return [_field_error(finding, tuple(known)) for finding in findings]


def _field_error(finding: Any, known: Sequence[str]) -> FieldError:
    path = [str(part) for part in finding["loc"] if part not in _PLACES]
    field = printable(".".join(path))
    if finding["type"] == "extra_forbidden":
        message = f"unknown field '{field}'{nearest(field, known)}"
        return FieldError(field=field, value=None, limit=None, message=message)
    value = _echo(finding["input"])
    bounds = finding.get("ctx", {})
    limit = ", ".join(f"{word} {bounds[name]}" for name, word in _BOUNDS.items() if name in bounds)
    told = "" if value is None else f" is '{value}'"
    found = finding["msg"].removeprefix("Value error, ")
    sentence = f"{field or 'the body'}{told}: {found[:1].lower()}{found[1:]}"
    return FieldError(field=field, value=value, limit=limit or None, message=sentence)


def _echo(value: Any) -> float | int | bool | str | None:
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, int) and abs(value) >= 10**15:
        return "a huge integer"
    if isinstance(value, str):
        return printable(value)
    return value if isinstance(value, (bool, int, float)) else None
