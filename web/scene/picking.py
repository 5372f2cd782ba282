"""Clicks on objects of the scene, which select parts of the scenario."""

from __future__ import annotations

from typing import Any

import viser

from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.selection import Select


class Picking:
    """Selects parts by clicks on their nodes.

    Args:
        send: Takes the intents.
    """

    def __init__(self, send: Send) -> None:
        self._send = send

    def make_clickable(self, node: viser.MeshHandle, part: str) -> None:
        """Makes clicks on a node select a part."""

        # In the event loop, which keeps the order of events.
        async def select(_: viser.SceneNodePointerEvent[Any]) -> None:
            self._send(Select(part))

        node.on_click(select)
