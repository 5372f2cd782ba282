"""Routes of the page: script, style, and gestures of a session."""

from __future__ import annotations

from functools import cache
from importlib import resources

from fastapi import APIRouter, FastAPI, HTTPException, Request, Response
from pydantic import ValidationError

from slipgrasp.server.addresses import DASHBOARD_PATH, SESSIONS_PATH
from slipgrasp.server.exceptions import InvalidRequestError
from slipgrasp.server.http.access import READ_ONLY
from slipgrasp.server.http.errors import invalid_fields
from slipgrasp.server.http.json_body import JSON_TYPE, read_values
from slipgrasp.server.http.page_file import PageFile
from slipgrasp.server.tokens import Right
from slipgrasp.server.viewer.relay import ViewerRelay
from slipgrasp.web.model.intents.hints import TryHints
from slipgrasp.web.page.colours import colours_html
from slipgrasp.web.page.intents_schema import RIGHTS, PageGestures
from slipgrasp.web.page.keys import keys_html
from slipgrasp.web.page.session_directory import SessionDirectory

_MAX_VALUES = 500
_NEVER_KEPT = {"Cache-Control": "no-store"}

_router = APIRouter(include_in_schema=False)
STATIC_PATH = f"{DASHBOARD_PATH}/static"
_MEDIA_TYPES = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}


def add_page_routes(app: FastAPI, relay: ViewerRelay) -> None:
    """Adds the routes of the page.

    Args:
        app: The application; ``app.state.dashboard`` has the sessions after its start.
        relay: Reports whether it can serve another viewer.
    """
    app.state.viewer_relay = relay
    app.include_router(_router)


@_router.get(f"{STATIC_PATH}/{{name}}")
def show_file(name: str, request: Request) -> Response:
    """Returns a file of the page."""
    found = _static_files().get(name)
    if found is None:
        raise HTTPException(404, "there is no such file")
    return found.answer(request)


@_router.get(f"{SESSIONS_PATH}/{{key}}")
async def show_session(key: str, request: Request, response: Response) -> dict[str, object]:
    """Returns whether a session exists; pages poll this to notice a lost session."""
    response.headers.update(_NEVER_KEPT)
    directory, relay = _directory(request), request.app.state.viewer_relay
    return {
        "alive": directory.find(key) is not None,
        "server": directory.server_id,
        "full": relay.is_full,
    }


@_router.post(f"{SESSIONS_PATH}/{{key}}/intents", status_code=202)
async def take_gestures(key: str, request: Request) -> Response:
    """Passes gestures of a page to its session."""
    send = _directory(request).find(key)
    if send is None:
        raise HTTPException(404, "this session has ended; reload the page")
    values = await read_values(request, (JSON_TYPE,), _MAX_VALUES)
    try:
        gestures = PageGestures.model_validate(values)
    except ValidationError as error:
        raise InvalidRequestError(invalid_fields(error.errors())) from error
    intents = gestures.intents()
    if any(request.state.right < RIGHTS[type(intent)] for intent in intents):
        raise HTTPException(403, READ_ONLY.detail)
    for intent in intents:
        send(intent)
    if request.state.right >= Right.EVERYTHING:
        send(TryHints())
    return Response(status_code=202)


def _directory(request: Request) -> SessionDirectory:
    directory: SessionDirectory = request.app.state.dashboard.directory
    return directory


@cache
def _static_files() -> dict[str, PageFile]:
    """All files of the page by name."""
    return {
        file.name: PageFile(file.read_bytes(), media_type)
        for file in resources.files("slipgrasp.web.page").iterdir()
        for suffix, media_type in _MEDIA_TYPES.items()
        if file.name.endswith(suffix)
    }


def head_html(root: str = "") -> str:
    """HTML for the head: title, icon, style, script, and data for the script.

    Args:
        root: Root path of the proxy.
    """
    static = f"{root}{STATIC_PATH}"
    return (
        "<title>slipgrasp</title>"
        f'<link rel="icon" type="image/svg+xml" href="{static}/icon.svg" />'
        f'<link rel="stylesheet" href="{static}/dashboard.css" />'
        f"{keys_html()}{colours_html()}"
        # Asynchronous, as viser's script would otherwise wait until all modules are loaded.
        f'<script type="module" async src="{static}/dashboard.js"></script>'
    )
