"""The thread that makes the files of one session, one at a time."""

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
    """The user does not want the file any more, or is gone."""


class ExportWorker(Worker):
    """Makes a file in a thread that ends with it.

    Args:
        send: Takes what became of it.
    """

    def __init__(self, send: Send) -> None:
        self._send = send
        self._cancelled = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self, number: int, make: Make) -> None:
        """Begins to make a file; the one before must have been answered.

        Args:
            number: Names the export in all answers.
            make: Makes it, and reports the share that is done.
        """
        self._cancelled = threading.Event()
        self._thread = threading.Thread(
            target=self._work, args=(number, make, self._cancelled), name="export", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Gives up what is being made; that is answered too."""
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

        # Whatever happens is answered, or the user could never ask again.
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
