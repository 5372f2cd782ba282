"""The root path of a proxy, which the proxy may remove from requests or not."""

from __future__ import annotations

from starlette.responses import RedirectResponse
from starlette.types import ASGIApp, Receive, Scope, Send

from slipgrasp.server.addresses import root_path


class RootPath:
    """ASGI middleware: removes the root path from requests; responses include it.

    Some proxies pass paths unchanged, and clients without the proxy use addresses from responses;
    other proxies remove the root path.

    Args:
        app: The application.
        root: Root path, such as ``/slipgrasp``; empty if there is none.
    """

    def __init__(self, app: ASGIApp, root: str) -> None:
        self._app = app
        self._root = root

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; protocols other than HTTP and websocket pass unchanged."""
        if not self._root or scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        path: str = scope["path"]
        if path == self._root and scope["type"] == "http":
            # Relative links on a page depend on the slash.
            query = scope["query_string"].decode("latin-1")
            target = f"{self._root}/{'?' if query else ''}{query}"
            await RedirectResponse(target, 308)(scope, receive, send)
            return
        if path == self._root or path.startswith(f"{self._root}/"):
            path = path.removeprefix(self._root)
        root_path.set(self._root)
        await self._app({**scope, "path": path or "/"}, receive, send)
