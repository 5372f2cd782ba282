"""The description of the REST interface that other programs read (OpenAPI 3.1)."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from fastapi.routing import APIRoute
from pydantic import BaseModel

from slipgrasp.server.http.errors import ProblemPublic

_REFERENCE = "#/components/schemas/{model}"
_VALIDATION_ERRORS = ("HTTPValidationError", "ValidationError")

_TAGS = {
    "runs": "Simulate a scenario; search, change and download what was recorded.",
    "studies": "Many runs from one request, and what came out of them.",
    "fits": "Parameters of a scenario from a recording, with intervals.",
    "recordings": "Recordings that come from elsewhere.",
    "diff": "Differences between two runs.",
    "scenarios": "What can be simulated, and what can be set.",
    "health": "Whether the service is up, and how busy.",
}


def operation_id(route: APIRoute) -> str:
    """The name of an operation: that of the function that answers it, which is used once."""
    return route.name


def json_body(model: type[BaseModel], *media_types: str) -> dict[str, Any]:
    """How a route declares the JSON body that its dependency reads.

    Args:
        model: What the body should be.
        media_types: As what it may be sent besides ``application/json``.
    """
    schema = model.model_json_schema(ref_template=_REFERENCE)
    content = {kind: {"schema": schema} for kind in ("application/json", *media_types)}
    return {"requestBody": {"required": True, "content": content}}


class DescribedApi(FastAPI):
    """An application that serves a description of its own routes."""

    def openapi(self) -> dict[str, Any]:
        """The description, made once."""
        if self.openapi_schema is None:
            self.openapi_schema = _describe(self)
        return self.openapi_schema


def _describe(app: FastAPI) -> dict[str, Any]:
    """What FastAPI finds out, with bodies and problems as schemas of their own."""
    document = get_openapi(
        title=app.title,
        version=app.version,
        description=app.description,
        routes=app.routes,
        servers=app.servers,
        tags=[{"name": name, "description": text} for name, text in _TAGS.items()],
    )
    schemas = document["components"]["schemas"]
    for name in _VALIDATION_ERRORS:
        schemas.pop(name, None)
    _define(ProblemPublic.model_json_schema(ref_template=_REFERENCE), schemas)
    for operations in document["paths"].values():
        for operation in operations.values():
            _correct_validation_problem(operation)
            for media in operation.get("requestBody", {}).get("content", {}).values():
                if "title" in media["schema"]:
                    media["schema"] = _define(media["schema"], schemas)
    return document


def _define(schema: dict[str, Any], schemas: dict[str, Any]) -> dict[str, Any]:
    """Moves a schema, and those that came with it, to where all are; returns how it is called."""
    own = {key: value for key, value in schema.items() if key != "$defs"}
    for name, each in [*schema.get("$defs", {}).items(), (schema["title"], own)]:
        schemas.setdefault(name, each)
    return {"$ref": _REFERENCE.format(model=schema["title"])}


def _correct_validation_problem(operation: dict[str, Any]) -> None:
    """FastAPI takes it that errors have the form of its own."""
    invalid = operation["responses"].get("422", {})
    if "application/json" in invalid.get("content", {}):
        operation["responses"]["422"] = ProblemPublic.responses((422,))[422]
