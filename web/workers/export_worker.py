"""Thread that creates export files of a session."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.web.model.export import ExportFile
from slipgrasp.web.model.intents.export import ExportFailed, ExportFinished, ExportMoved
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.workers.worker import QueueWorker

Progress = Callable[[float], None]
Make = Callable[[Progress], ExportFile]

_CANCELLED = "Cancelled; no file was made."
_UNEXPECTED = "The file could not be made: an internal error; see the server's log."


class ExportCancelledError(Exception):
    """Raised if the export was cancelled, or its session has ended."""


class ExportWorker(QueueWorker):
    """Creates files, one at a time.

    Args:
        send: Receives progress and results.
    """

    def __init__(self, send: Send) -> None:
        super().__init__("export")
        self._send = send
        self._cancelled = 0

    def start(self, number: int, make: Make) -> None:
        """Starts to create a file; the result of the previous one must have been sent.

        Args:
            number: Number of the export, repeated in all results.
            make: Creates the file, and reports the completed fraction.
        """
        self.ask(partial(self._make, number, make))

    def cancel(self, number: int) -> None:
        """Cancels an export; this also sends a result."""
        self._cancelled = number

    def _make(self, number: int, make: Make) -> None:
        def tell(share: float) -> None:
            if self.is_closed() or self._cancelled == number:
                raise ExportCancelledError
            self._send(ExportMoved(number, share))

        # A result is sent in any case; otherwise no further export could be requested.
        answer: Intent = ExportFailed(number, _UNEXPECTED)
        try:
            answer = ExportFinished(number, make(tell))
        except ExportCancelledError:
            answer = ExportFailed(number, _CANCELLED)
        except SlipgraspError as error:
            answer = ExportFailed(number, f"The file could not be made: {error}.")
        except OSError as error:
            answer = ExportFailed(number, f"The file could not be made: {error.strerror or error}.")
        finally:
            self._send(answer)
