"""Attributes of HTML that the page's own script understands."""

from __future__ import annotations

import json
from html import escape
from typing import Any

CHOSEN = "$value"
"""Stands for the value that a user chose or typed."""


def click_attribute(kind: str, **fields: Any) -> str:
    """The attribute of an element that asks for something when it is clicked.

    Args:
        kind: What it asks for, a kind of `slipgrasp.web.page.intents_schema`.
        fields: The rest of it.
    """
    return _attribute("data-sg-intent", kind, fields)


def clickable(hint: str, kind: str, **fields: Any) -> str:
    """The attributes that make any element a button, for the mouse and for the keyboard.

    Args:
        hint: One sentence on what a click does; shown while the mouse rests on it.
        kind: What it asks for, a kind of `slipgrasp.web.page.intents_schema`.
        fields: The rest of it.
    """
    return f'role="button" tabindex="0" title="{escape(hint)}" {click_attribute(kind, **fields)}'


def change_attribute(kind: str, **fields: Any) -> str:
    """The attribute of an input or a select that asks for something when its value changes.

    Args:
        kind: What it asks for, a kind of `slipgrasp.web.page.intents_schema`.
        fields: The rest of it; `CHOSEN` stands for the value.
    """
    return _attribute("data-sg-change", kind, fields)


def visible_attribute(kind: str) -> str:
    """The attribute of an element that tells when it comes into sight, and when it no longer is.

    Args:
        kind: What it tells that with, a kind of `slipgrasp.web.page.intents_schema` with
        ``is_visible``.
    """
    return _attribute("data-sg-visible", kind, {})


def _attribute(name: str, kind: str, fields: dict[str, Any]) -> str:
    return f'{name}="{escape(json.dumps({"kind": kind, **fields}, ensure_ascii=False))}"'
