"""Who may do what: by his connection, a token, or the cookie that a link with a token gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from urllib.parse import parse_qsl, urlencode

from starlette.datastructures import Headers
from starlette.requests import cookie_parser
from starlette.responses import HTMLResponse, RedirectResponse, Response

from slipgrasp.server.addresses import from_outside, root_path
from slipgrasp.server.peers import Connection
from slipgrasp.server.tokens import Right, Tokens

TOKEN_PARAMETER = "token"

_BEARER = "bearer"
_FORWARDING = ("forwarded", "via", "x-forwarded-for", "x-real-ip")
_NEVER_KEPT = {"Cache-Control": "no-store"}


@dataclass(frozen=True, slots=True)
class Gate:
    """Finds out what those who send requests may do.

    Attributes:
        tokens: The accepted tokens.
        trusts_connections: Whether the user who runs this server needs no token, where the system
            tells that a connection is his.
        is_encrypted: Whether pages are reached by HTTPS alone.
    """

    tokens: Tokens
    trusts_connections: bool
    is_encrypted: bool = False

    def right_of(self, headers: Headers, connection: Connection | None, port: int) -> Right:
        """What the sender of a request may do.

        A bearer token decides alone. A cookie only adds to what the connection gives: browsers
        send it unasked, and it may be that of a server which has ended.

        Args:
            headers: Those of the request.
            connection: What it came by, if known.
            port: The port that it came to.
        """
        bearers = bearer_tokens(headers.getlist("authorization"))
        if bearers:
            return self.tokens.right_of(bearers[0]) if len(bearers) == 1 else Right.NOTHING
        if connection is not None and self._is_own(headers, connection):
            return Right.EVERYTHING
        cookies = cookie_parser("; ".join(headers.getlist("cookie")))
        return self.tokens.right_of_cookie(cookies.get(_cookie_name(port), ""))

    def _is_own(self, headers: Headers, connection: Connection) -> bool:
        # The user who runs a proxy is not the client of its requests.
        is_forwarded = any(name in headers for name in _FORWARDING)
        return self.trusts_connections and not is_forwarded and connection.is_own

    def lead_on(self, path: str, query: str, right: Right, port: int, linked: bool) -> Response:
        """Gives the cookie for a link with a token, and leads on to the address without it.

        Args:
            path: Path of the page that was asked for.
            query: What follows the path.
            right: What the token lets do.
            port: The port that the request came to.
            linked: Whether the link may be on another site's page. Browsers send no such cookie
                along redirects which began there, but do when a page of ours goes on.
        """
        kept = [pair for pair in _pairs(query) if pair[0] != TOKEN_PARAMETER]
        target = from_outside(path)
        if kept:
            target += f"?{urlencode(kept)}"
        response: Response = RedirectResponse(target, 303, _NEVER_KEPT)
        if linked:
            going_on = f'<meta http-equiv="refresh" content="0;url={escape(target)}" />'
            response = HTMLResponse(f"<!doctype html>{going_on}", headers=_NEVER_KEPT)
        response.set_cookie(
            _cookie_name(port),
            self.tokens.cookie(right),
            path=root_path.get() or "/",
            secure=self.is_encrypted,
            httponly=True,
            samesite="strict",
        )
        return response


def bearer_tokens(authorizations: Sequence[str]) -> list[str]:
    """The tokens of those ``Authorization`` headers that show one."""
    split = [header.strip().partition(" ") for header in authorizations]
    return [token.strip() for scheme, _, token in split if scheme.lower() == _BEARER]


def link_token(query: str) -> str | None:
    """The token of a link; None if it has none, and no possible one if it has several."""
    shown = [value for name, value in _pairs(query) if name == TOKEN_PARAMETER]
    return None if not shown else shown[0] if len(shown) == 1 else ""


def _pairs(query: str) -> list[tuple[str, str]]:
    return parse_qsl(query, keep_blank_values=True, max_num_fields=None, errors="replace")


def _cookie_name(port: int) -> str:
    """Browsers send the cookies of all ports of a machine to each."""
    return f"slipgrasp_{port}"
