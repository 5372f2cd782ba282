"""Rights of senders: by connection, token, or the cookie that a link with a token sets."""

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
    """Determines the rights of senders of requests.

    Attributes:
        tokens: The accepted tokens.
        trusts_connections: Whether the user who runs this server needs no token, if the system
            identifies the connections of that user.
        is_encrypted: Whether pages are only reached by HTTPS.
    """

    tokens: Tokens
    trusts_connections: bool
    is_encrypted: bool = False

    def right_of(self, headers: Headers, connection: Connection | None, port: int) -> Right:
        """The right of the sender of a request.

        A bearer token alone determines it. A cookie only adds to the right of the connection:
        browsers always send it, and it may belong to a server that has ended.

        Args:
            headers: Headers of the request.
            connection: Its connection, if known.
            port: Port of the request.
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
        """Sets the cookie for a link with a token, and redirects to the address without it.

        Args:
            path: Path of the requested page.
            query: Query string of the request.
            right: Right of the token.
            port: Port of the request.
            linked: Whether the link may be on another site's page. Browsers then send the cookie
                only if a page of ours continues, not along redirects.
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
    """The tokens in ``Authorization`` headers."""
    split = [header.strip().partition(" ") for header in authorizations]
    return [token.strip() for scheme, _, token in split if scheme.lower() == _BEARER]


def link_token(query: str) -> str | None:
    """The token in a link; None if there is none, an invalid one if there are several."""
    shown = [value for name, value in _pairs(query) if name == TOKEN_PARAMETER]
    return None if not shown else shown[0] if len(shown) == 1 else ""


def _pairs(query: str) -> list[tuple[str, str]]:
    return parse_qsl(query, keep_blank_values=True, max_num_fields=None, errors="replace")


def _cookie_name(port: int) -> str:
    """Name of the cookie of a port, because browsers send cookies to all ports of a machine."""
    return f"slipgrasp_{port}"
