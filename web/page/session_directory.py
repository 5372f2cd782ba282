"""Which sessions there are, by the key that only their own page knows."""

from __future__ import annotations

import secrets
import threading

from slipgrasp.web.model.intents.intent import Send

_KEY_BYTES = 18


class SessionDirectory:
    """Finds the mailbox of a session for the gestures that its page posts.

    Attributes:
        server_id: Distinguishes this directory from that of a server started later.
    """

    def __init__(self) -> None:
        self.server_id = secrets.token_urlsafe(_KEY_BYTES)
        self._lock = threading.Lock()
        self._mailboxes: dict[str, Send] = {}

    def enter(self, send: Send) -> str:
        """Enters a session.

        Args:
            send: Takes what its page asks for.

        Returns:
            Its key, which nobody can guess.
        """
        key = secrets.token_urlsafe(_KEY_BYTES)
        with self._lock:
            self._mailboxes[key] = send
        return key

    def remove(self, key: str) -> None:
        """Takes a session out; one that is out already stays out."""
        with self._lock:
            self._mailboxes.pop(key, None)

    def find(self, key: str) -> Send | None:
        """What takes the intents of a session; None if there is no such session."""
        with self._lock:
            return self._mailboxes.get(key)
