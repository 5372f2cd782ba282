"""Directory of the sessions by secret keys."""

from __future__ import annotations

import secrets
import threading

from slipgrasp.web.model.intents.intent import Send

_KEY_BYTES = 18


class SessionDirectory:
    """Finds the session of a page.

    Attributes:
        server_id: Distinguishes this server from later ones.
    """

    def __init__(self) -> None:
        self.server_id = secrets.token_urlsafe(_KEY_BYTES)
        self._lock = threading.Lock()
        self._mailboxes: dict[str, Send] = {}

    def enter(self, send: Send) -> str:
        """Adds a session.

        Args:
            send: Accepts intents from its page.

        Returns:
            Its random key.
        """
        key = secrets.token_urlsafe(_KEY_BYTES)
        with self._lock:
            self._mailboxes[key] = send
        return key

    def remove(self, key: str) -> None:
        """Removes a session, if it exists."""
        with self._lock:
            self._mailboxes.pop(key, None)

    def find(self, key: str) -> Send | None:
        """Returns the receiver of the intents of a session; None if it does not exist."""
        with self._lock:
            return self._mailboxes.get(key)
