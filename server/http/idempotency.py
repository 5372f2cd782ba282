"""Requests that may be sent again without being done again.

As in the draft "The Idempotency-Key HTTP Header Field": the same key and the same request
lead to the same thing; the same key with another request is 422.
"""

from __future__ import annotations

import hashlib
import json
from typing import Annotated, Any

from fastapi import Header

from slipgrasp.core.exceptions import SlipgraspError

MAX_KEY_LENGTH = 200
_DIGEST_BYTES = 16

IdempotencyKey = Annotated[
    str,
    Header(
        max_length=MAX_KEY_LENGTH,
        pattern=r"^[ -~]*$",
        description="Any text of your own, such as a UUID: sent again with the same key and body, "
        "the request gives what it gave before, and nothing is made twice.",
        examples=["5f0c8f6e-6c1b-4d0e-9f57-3f6f0f1c2a4b"],
    ),
]
"""The header of that name; empty where there is none."""


class IdempotencyKeyReusedError(SlipgraspError):
    """A key that came before with another request."""

    def __init__(self, link: str) -> None:
        super().__init__(
            f"Idempotency-Key: this key made {link} from another body; take a new key for a new "
            "request"
        )


def request_digest(body: Any) -> str:
    """Equal for requests that mean the same, however they were written.

    Args:
        body: The request as plain values, as they came in JSON.
    """
    text = json.dumps(body, sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=_DIGEST_BYTES).hexdigest()
