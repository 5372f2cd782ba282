"""OpenAPI 3.1 description of the REST interface."""

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
    "runs": "Simulate a scenario; search, change and download recorded runs.",
    "studies": "Many runs from one request, and their results.",
    "fits": "Parameters of a scenario from a recording, with their intervals.",
    "recordings": "Recordings made elsewhere.",
    "diff": "Differences between two runs.",
    "scenarios": "Presets and parameters.",
    "health": "State and load of the service.",
}


def operation_id(route: APIRoute) -> str:
    """Name of an operation: that of the function of the route, which is unique."""
    return route.name


def json_body(model: type[BaseModel], *media_types: str) -> dict[str, Any]:
    """Declares the JSON body that a dependency of a route reads.

    Args:
        model: Model of the body.
        media_types: Allowed media types in addition to ``application/json``.
    """
    schema = model.model_json_schema(ref_template=_REFERENCE)
    content = {kind: {"schema": schema} for kind in ("application/json", *media_types)}
    return {"requestBody": {"required": True, "content": content}}


class DescribedApi(FastAPI):
    """An application that serves the description of its routes."""

    def openapi(self) -> dict[str, Any]:
        """The description, created once."""
        if self.openapi_schema is None:
            self.openapi_schema = _describe(self)
        return self.openapi_schema


def _describe(app: FastAPI) -> dict[str, Any]:
    """The description from FastAPI, with schemas of bodies and problems."""
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
    """Moves a schema and its definitions to the common ones; returns its reference."""
    own = {key: value for key, value in schema.items() if key != "$defs"}
    for name, each in [*schema.get("$defs", {}).items(), (schema["title"], own)]:
        schemas.setdefault(name, each)
    return {"$ref": _REFERENCE.format(model=schema["title"])}


def _correct_validation_problem(operation: dict[str, Any]) -> None:
    """Removes error schemas of FastAPI, which the application does not use."""
    invalid = operation["responses"].get("422", {})
    if "application/json" in invalid.get("content", {}):
        operation["responses"]["422"] = ProblemPublic.responses((422,))[422]
