"""HTML attributes for the page's script."""

from __future__ import annotations

import json
from html import escape
from typing import Any

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.page.intents_schema import KINDS, posted

_CHOSEN = "$value"
"""Placeholder for the value that a user chose or typed."""


def click_attribute(*intents: Intent) -> str:
    """The attribute of an element that sends one or more intents when it is clicked."""
    asked = [posted(intent) for intent in intents]
    return _attribute("data-sg-intent", asked[0] if len(asked) == 1 else asked)


def clickable(hint: str, intent: Intent) -> str:
    """The attributes that make an element a button, for mouse and keyboard.

    Args:
        hint: Tooltip, a sentence.
        intent: Intent to send.
    """
    return f'role="button" tabindex="0" title="{escape(hint)}" {click_attribute(intent)}'


def change_attribute(intent: type[Intent], field: str) -> str:
    """The attribute of an input or select that sends an intent when its value changes.

    Args:
        intent: Class of the intent.
        field: Its field for the value.
    """
    return _attribute("data-sg-change", {"kind": KINDS[intent], field: _CHOSEN})


def visible_attribute(intent: type[Intent], **fields: str) -> str:
    """The attribute of an element that reports when it becomes visible, or invisible.

    Args:
        intent: The intent that reports it, by its field ``is_visible``.
        fields: Its other fields.
    """
    return _attribute("data-sg-visible", {"kind": KINDS[intent], **fields})


def _attribute(name: str, asked: dict[str, Any] | list[dict[str, Any]]) -> str:
    return f'{name}="{escape(json.dumps(asked, ensure_ascii=False))}"'
