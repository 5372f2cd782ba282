"""Links from one page of a list to those beside it."""

from __future__ import annotations

from urllib.parse import urlencode

from fastapi import Request


def page_links(request: Request, offset: int, limit: int, count: int) -> dict[str, str]:
    """Links to the next and the previous page, as far as there are any.

    Args:
        request: What asked for this page.
        offset: How many it leaves out.
        limit: How many it has at most.
        count: How many there are on all pages.
    """
    links = {}
    if offset + limit < count:
        links["next"] = _page(request, offset + limit)
    if offset > 0:
        links["prev"] = _page(request, max(offset - limit, 0))
    return links


def _page(request: Request, offset: int) -> str:
    asked = [pair for pair in request.query_params.multi_items() if pair[0] != "offset"]
    return f"{request.url.path}?{urlencode([*asked, ('offset', offset)])}"
