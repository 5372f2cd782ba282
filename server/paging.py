"""Pages of lists, and links to neighbouring pages."""

from __future__ import annotations

from typing import Annotated
from urllib.parse import parse_qsl, urlencode, urlsplit

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.server.addresses import from_outside

MAX_PAGE = 1000

Limit = Annotated[int, Field(ge=1, le=MAX_PAGE, description="largest number of items")]
Offset = Annotated[int, Field(ge=0, le=10**9, description="number of items to skip")]


class PageQuery(BaseModel):
    """A page of a list."""

    model_config = ConfigDict(extra="forbid")

    limit: Limit = 100
    offset: Offset = 0


def page_links(url: str, offset: int, limit: int, count: int) -> dict[str, str]:
    """Links to the next and the previous page, if they exist.

    Args:
        url: URL of this page.
        offset: Number of skipped items.
        limit: Largest number of items on the page.
        count: Number of items on all pages.
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
