"""Tokens for access: the full token, the read-only token, and derived cookies."""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import secrets
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path

from slipgrasp.recordings.exceptions import RecordingWriteError
from slipgrasp.server.exceptions import SettingsError

TOKEN_VARIABLE = "SLIPGRASP_TOKEN"
TOKEN_FILE = "service.token"
READ_ONLY_TOKEN_FILE = "service.read-only-token"

_ALLOWED = re.compile(r"[A-Za-z0-9._~-]{16,200}")
_RANDOM_BYTES = 32


class Right(IntEnum):
    """Rights of a sender; higher ones include lower ones."""

    NOTHING = 0
    READ = 1
    EVERYTHING = 2


@dataclass(frozen=True, slots=True)
class Tokens:
    """The token of the owner, and the read-only token of an audience.

    Attributes:
        full: Allows everything; at least 16 letters, digits and ``._~-``.
        read_only: Allows `GET`; derived from the full token, which it does not reveal.

    Raises:
        SettingsError: If the token is too short, or has other characters.
    """

    full: str = field(repr=False)

    def __post_init__(self) -> None:
        if not _ALLOWED.fullmatch(self.full):
            raise SettingsError(
                f"{TOKEN_VARIABLE} has to be 16 to 200 letters, digits and ._~- "
                "(openssl rand -hex 32 makes a good one)"
            )

    @classmethod
    def random(cls) -> Tokens:
        """Returns new random tokens."""
        return cls(secrets.token_urlsafe(_RANDOM_BYTES))

    @property
    def read_only(self) -> str:
        """The read-only token."""
        return _derived(self.full, "read-only token")

    def right_of(self, token: str) -> Right:
        """Returns the right of a token, compared in constant time."""
        return self._right(token, {Right.EVERYTHING: self.full, Right.READ: self.read_only})

    def right_of_cookie(self, cookie: str) -> Right:
        """Returns the right of a cookie."""
        known = {right: self.cookie(right) for right in (Right.EVERYTHING, Right.READ)}
        return self._right(cookie, known)

    def cookie(self, right: Right) -> str:
        """Value of the cookie for a right, which does not reveal the token."""
        token = self.full if right is Right.EVERYTHING else self.read_only
        return _derived(token, "cookie")

    @staticmethod
    def _right(shown: str, known: dict[Right, str]) -> Right:
        found = Right.NOTHING
        for right, text in known.items():
            # Equal lengths for any input.
            if hmac.compare_digest(_digest(shown), _digest(text)):
                found = right
        return found

    def save(self, folder: Path) -> None:
        """Writes both into a folder, for programs of its owner.

        Raises:
            RecordingWriteError: If they cannot be written.
        """
        for name, token in ((TOKEN_FILE, self.full), (READ_ONLY_TOKEN_FILE, self.read_only)):
            _write_private(folder / name, f"{token}\n")


def _derived(token: str, purpose: str) -> str:
    return hmac.new(token.encode(), f"slipgrasp {purpose}".encode(), hashlib.sha256).hexdigest()


def _digest(text: str) -> bytes:
    return hashlib.sha256(text.encode(errors="surrogateescape")).digest()


def _write_private(path: Path, text: str) -> None:
    """Replaces a file with one that only its owner can read."""
    part = path.with_name(f"{path.name}.part")
    try:
        part.unlink(missing_ok=True)
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as stream:
            stream.write(text)
        part.replace(path)
    except OSError as error:
        raise RecordingWriteError(path, error.strerror or "cannot be written") from error
