"""Lists page by page: which page is asked for, and links to those beside it."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import parse_qsl, urlencode, urlsplit

from pydantic import Field

from slipgrasp.server.addresses import from_outside

MAX_PAGE = 1000

Limit = Annotated[int, Field(ge=1, le=MAX_PAGE, description="how many at most")]
Offset = Annotated[int, Field(ge=0, le=10**9, description="how many to skip")]


def page_links(url: str, offset: int, limit: int, count: int) -> dict[str, str]:
    """Links to the next and the previous page, as far as there are any.

    Args:
        url: What asked for this page.
        offset: How many it leaves out.
        limit: How many it has at most.
        count: How many there are on all pages.
    """
    links = {}
    if offset + limit < count:
        links["next"] = _page(url, offset + limit)
    if offset > 0:
        links["prev"] = _page(url, max(offset - limit, 0))
    return links


def _page(url: str, offset: int) -> str:
    parts = urlsplit(url)
    asked = parse_qsl(parts.query, keep_blank_values=True)
    kept = [(name, value) for name, value in asked if name != "offset"]
    return f"{from_outside(parts.path)}?{urlencode([*kept, ('offset', offset)])}"
