"""Thread that creates export files of a session, one at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.web.model.export import ExportFile
from slipgrasp.web.model.intents.export import ExportFailed, ExportFinished, ExportMoved
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.workers.worker import Worker

Progress = Callable[[float], None]
Make = Callable[[Progress], ExportFile]

_CANCELLED = "Cancelled; no file was made."
_UNEXPECTED = "The file could not be made: an internal error; see the server's log."


class ExportCancelledError(Exception):
    """Raised if the export was cancelled, or its session has ended."""


class ExportWorker(Worker):
    """Creates a file in a thread that ends with the file.

    Args:
        send: Receives progress and results.
    """

    def __init__(self, send: Send) -> None:
        self._send = send
        self._cancelled = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, number: int, make: Make) -> None:
        """Starts to create a file; the result of the previous one must have been sent.

        Args:
            number: Number of the export, repeated in all results.
            make: Creates the file, and reports the completed fraction.
        """
        self._cancelled = threading.Event()
        self._thread = threading.Thread(
            target=self._work, args=(number, make, self._cancelled), name="export", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Cancels the current export; this also sends a result."""
        self._cancelled.set()

    def join(self, timeout: float) -> None:
        """Waits until the thread has ended [s]."""
        if self._thread is not None:
            self._thread.join(timeout)

    def _work(self, number: int, make: Make, cancelled: threading.Event) -> None:
        def tell(share: float) -> None:
            if cancelled.is_set():
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
