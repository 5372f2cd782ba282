"""The path at which a proxy shows the server, and which it may take away or leave."""

from __future__ import annotations

from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from slipgrasp.server.addresses import root_path


class RootPath:
    """ASGI middleware: routes see paths without the root path, answers tell them with it.

    Requests come with it from proxies that pass paths as they are, and from those who ask the
    server itself for what an answer told; other proxies take it away.

    Args:
        app: What answers.
        root: Such as ``/slipgrasp``; empty if there is none.
    """

    def __init__(self, app: ASGIApp, root: str) -> None:
        self._app = app
        self._root = root

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; what is neither HTTP nor websocket passes."""
        if not self._root or scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        path: str = scope["path"]
        if path == self._root and scope["type"] == "http":
            # What is relative on a page hangs on the slash.
            query = scope["query_string"].decode("latin-1")
            target = f"{self._root}/{'?' if query else ''}{query}"
            await RedirectResponse(target, 308)(scope, receive, send)
            return
        if path == self._root or path.startswith(f"{self._root}/"):
            path = path.removeprefix(self._root)
        root_path.set(self._root)
        await self._app({**scope, "path": path or "/"}, receive, send)
