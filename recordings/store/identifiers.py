"""Names of runs and studies: twelve letters and digits."""

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
    """Makes ids that sort by the time they were made; safe from any thread."""

    def __init__(self) -> None:
        self._last_stamp = 0
        self._lock = Lock()

    def new(self, now: datetime) -> str:
        """An id that nobody else has, and that sorts after all before it."""
        with self._lock:
            self._last_stamp = max(self._last_stamp + 1, int(now.timestamp() * 1000))
            stamp = self._last_stamp
        random = [secrets.choice(_DIGITS) for _ in range(_RANDOM_DIGITS)]
        return _digits(stamp, _TIME_DIGITS) + "".join(random)


def derived_id(parent: str, index: int) -> str:
    """The id of a part of something, always the same: what is made twice is one."""
    digest = hashlib.blake2b(f"{parent} {index}".encode(), digest_size=16).digest()
    return _digits(int.from_bytes(digest), _TIME_DIGITS + _RANDOM_DIGITS)


def _digits(number: int, length: int) -> str:
    """The last digits of a number to the base 36."""
    digits = []
    for _ in range(length):
        number, digit = divmod(number, len(_DIGITS))
        digits.append(_DIGITS[digit])
    return "".join(reversed(digits))
