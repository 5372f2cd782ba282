"""A recording read chunk by chunk, so that a long run takes no more memory than a short one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from os import PathLike

from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import PhaseChange
from slipgrasp.recordings.file.reader import Reading, open_recording


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """What follows the piece before it.

    Attributes:
        trace: Samples; there may be none.
        phase_changes: Phase changes.
        ticks: What the law answered; None where the format does not record it.
    """

    trace: Trace
    phase_changes: tuple[PhaseChange, ...]
    ticks: Ticks | None


def read_pieces(
    path: str | PathLike[str], should_stop: Callable[[], bool] = lambda: False
) -> Iterator[Piece]:
    """Reads a complete recording in pieces of about one chunk.

    Every checksum is compared, as soon as what it covers has been read. Its hash and its claims
    are not: `slipgrasp.recordings.file.reader.read_recording` does that.

    Args:
        path: The MCAP file.
        should_stop: Asked again and again whether nobody needs it any more.

    Raises:
        RecordingError: As `slipgrasp.recordings.file.reader.read_recording`, if it cannot be read.
    """
    with open_recording(path) as stream:
        for contents in Reading(stream, str(path)).pieces(should_stop):
            yield Piece(contents.trace(), contents.phase_changes(), contents.ticks())
