"""How long a client is willing to wait for an answer (RFC 7240, the header ``Prefer``)."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Header, Request

from slipgrasp.server.settings import Settings

_WAIT = re.compile(r'wait *= *"?([0-9]{1,6})"?', re.IGNORECASE)
_ASYNC = "respond-async"


@dataclass(frozen=True, slots=True)
class Patience:
    """How long to wait.

    Attributes:
        seconds: How long an answer may take [s].
        applied: What of the client's preferences this takes up, for ``Preference-Applied``.
    """

    seconds: float
    applied: tuple[str, ...] = ()

    @classmethod
    def from_header(cls, prefer: str, usual: float, longest: float) -> Patience:
        """What a client prefers; what is not understood does not count, as the standard says.

        Args:
            prefer: Value of the header, empty if there is none.
            usual: How long to wait where it does not say [s].
            longest: How long to wait at most [s].
        """
        words = [word.partition(";")[0].strip() for word in prefer.split(",")]
        is_async = any(word.lower() == _ASYNC for word in words)
        waits = [found[1] for word in words if (found := _WAIT.fullmatch(word))]
        applied = (_ASYNC,) if is_async else ()
        if not waits:
            return cls(0.0 if is_async else usual, applied)
        seconds = min(float(waits[0]), longest)
        return cls(seconds, (*applied, f"wait={seconds:.0f}"))

    @property
    def headers(self) -> dict[str, str]:
        """What an answer says of it."""
        return {"Preference-Applied": ", ".join(self.applied)} if self.applied else {}


def _read_patience(
    request: Request,
    prefer: Annotated[
        str | None,
        Header(
            description="`respond-async` answers at once, `wait=10` after 10 s at most; the run "
            "goes on meanwhile",
            examples=["wait=10"],
        ),
    ] = None,
) -> Patience:
    settings: Settings = request.app.state.settings
    # There may be several lines, of which the parameter above is only one.
    text = ",".join(request.headers.getlist("prefer"))
    return Patience.from_header(text, settings.answer_within, settings.max_wait)


PatienceDep = Annotated[Patience, Depends(_read_patience)]
