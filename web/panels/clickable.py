"""What makes a piece of a panel's HTML something to click, with the mouse and by keyboard."""

from __future__ import annotations

from html import escape

from web.page.markup import click_attribute

__all__ = ["clickable"]


def clickable(hint: str, kind: str, **fields: str | float) -> str:
    """The attributes of an HTML element that asks for something when it is clicked.

    Args:
        hint: One sentence on what a click does; shown while the mouse rests on it.
        kind: What it asks for, a kind of `web.page.intents_schema`.
        fields: The rest of it.
    """
    asking = click_attribute(kind, **fields)
    return f'role="button" tabindex="0" title="{escape(hint)}" {asking}'
