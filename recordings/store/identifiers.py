"""Ids of runs and studies: twelve letters and digits."""

from __future__ import annotations

import hashlib
import re
import secrets
import string
from datetime import datetime
from threading import Lock

ID = re.compile(r"[a-z0-9]{12}")

_DIGITS = string.digits + string.ascii_lowercase
_TIME_DIGITS = 8
_RANDOM_DIGITS = 4


class IdSource:
    """Creates ids that sort by creation time; thread-safe."""

    def __init__(self) -> None:
        self._last_stamp = 0
        self._lock = Lock()

    def new(self, now: datetime) -> str:
        """Returns a unique id that sorts after all previous ones."""
        with self._lock:
            self._last_stamp = max(self._last_stamp + 1, int(now.timestamp() * 1000))
            stamp = self._last_stamp
        random = [secrets.choice(_DIGITS) for _ in range(_RANDOM_DIGITS)]
        return _digits(stamp, _TIME_DIGITS) + "".join(random)


def derived_id(parent: str, index: int) -> str:
    """Returns the constant id of a part, so that repeated creation gives the same id."""
    digest = hashlib.blake2b(f"{parent} {index}".encode(), digest_size=16).digest()
    return _digits(int.from_bytes(digest), _TIME_DIGITS + _RANDOM_DIGITS)


def _digits(number: int, length: int) -> str:
    """The last base-36 digits of a number."""
    digits = []
    for _ in range(length):
        number, digit = divmod(number, len(_DIGITS))
        digits.append(_DIGITS[digit])
    return "".join(reversed(digits))
