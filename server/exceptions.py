"""Errors of the server, with messages of one sentence."""

from __future__ import annotations

from collections.abc import Sequence

from slipgrasp.core.exceptions import FieldError, SlipgraspError
from slipgrasp.server.addresses import run_path

RECOVERY_RETRY_AFTER = 2
NOT_READY_RETRY_AFTER = 5
MEMORY_RETRY_AFTER = 5


class SettingsError(SlipgraspError):
    """Invalid settings of a server."""


class InvalidRequestError(SlipgraspError):
    """A malformed request, with one item per wrong field."""

    def __init__(self, errors: Sequence[FieldError]) -> None:
        self.errors = tuple(errors)
        super().__init__("; ".join(error.message for error in self.errors))


class UnreadableBodyError(SlipgraspError):
    """A request body that is not valid JSON, or not of another expected kind."""

    def __init__(self, finding: str, kind: str = "JSON") -> None:
        super().__init__(f"the body is not {kind}: {finding}")


class UnsupportedBodyError(SlipgraspError):
    """A request body with an unsupported type."""

    def __init__(self, content_type: str, allowed: str = "application/json") -> None:
        super().__init__(
            f"the body is declared as '{printable(content_type)}'; send it with "
            f"Content-Type: {allowed}"
        )


class BodyTooLargeError(SlipgraspError):
    """A request body that exceeds the size limit."""

    def __init__(self, limit: int) -> None:
        super().__init__(f"the body is larger than {limit} bytes, the limit")


class BodyTooSlowError(SlipgraspError):
    """A request body that arrives too slowly."""

    def __init__(self) -> None:
        super().__init__("the body arrives too slowly; send it again")


class ServiceBusyError(SlipgraspError):
    """No capacity for another run, or another upload, at the moment.

    Attributes:
        retry_after: Time after which to try again [s].
    """

    def __init__(
        self, waiting: int, retry_after: int, busy_with: str = "runs are waiting already"
    ) -> None:
        self.retry_after = retry_after
        super().__init__(f"{waiting} {busy_with}; try again in {retry_after} s")


class MemoryLimitError(SlipgraspError):
    """A job that needs more memory than the limit of the server."""

    def __init__(self, job: str, num_bytes: int, limit: int, cure: str) -> None:
        more = f"start the server with --memory of at least {_megabytes(num_bytes)}MB"
        super().__init__(
            f"{job} needs {_megabytes(num_bytes)} MB of memory, and there are "
            f"{limit // 10**6} MB for it; {cure}{', or ' if cure else ''}{more}"
        )


class MemoryBusyError(ServiceBusyError):
    """A job that has waited too long for memory."""

    def __init__(self, waiting: int) -> None:
        super().__init__(waiting, MEMORY_RETRY_AFTER, "others wait for memory")


class MemoryHeldError(ServiceBusyError):
    """A recording for which there is no memory next to those on pages."""

    def __init__(self, num_bytes: int, held: int, most: int) -> None:
        SlipgraspError.__init__(
            self,
            f"no memory available: it needs {_megabytes(num_bytes)} MB, and open pages use "
            f"{held // 10**6} of {most // 10**6} MB; close another page, end a comparison or "
            "choose a short run, and open it again",
        )
        self.retry_after = MEMORY_RETRY_AFTER


def _megabytes(num_bytes: int) -> int:
    return -(-num_bytes // 10**6)


class ServiceNotReadyError(ServiceBusyError):
    """No run can be accepted at the moment."""

    def __init__(self, obstacles: Sequence[str]) -> None:
        SlipgraspError.__init__(self, f"the service is not ready: {'; '.join(obstacles)}")
        self.retry_after = NOT_READY_RETRY_AFTER


class RunRecoveringError(ServiceBusyError):
    """A run of a killed service that is still being recovered."""

    def __init__(self, run_id: str) -> None:
        SlipgraspError.__init__(
            self, f"run '{run_id}' is being recovered from a service that was killed"
        )
        self.retry_after = RECOVERY_RETRY_AFTER


class RunUnfinishedError(SlipgraspError):
    """An operation that needs a run to have ended."""

    def __init__(self, run_id: str) -> None:
        super().__init__(
            f"run '{run_id}' has not ended yet; wait until GET {run_path(run_id)} answers 200, "
            f"or end it with POST {run_path(run_id)}/stop"
        )


class RunUnrecordableError(SlipgraspError):
    """A run that did not start because it cannot be recorded."""

    def __init__(self, cause: Exception) -> None:
        super().__init__(
            f"the run was not started, because it cannot be recorded: {cause}; free space on the "
            "disk, or let the server write to its data folder, and send the request again"
        )


class JobUnfinishedError(SlipgraspError):
    """An operation that needs a study or a fit to have ended."""

    def __init__(self, noun: str, job_id: str, path: str) -> None:
        super().__init__(
            f"{noun} '{job_id}' is not finished; wait for its end, or end it where it is with "
            f"POST {path}/cancel"
        )


class JobEndedError(SlipgraspError):
    """A request to continue a study or a fit that has nothing left to do."""

    def __init__(self, noun: str, job_id: str, state: str) -> None:
        super().__init__(
            f"{noun} '{job_id}' is {state} and cannot be resumed, only a failed {noun} can; "
            f"send it again as a new {noun}"
        )


class ResultNotFoundError(SlipgraspError):
    """A study has no result of a run."""

    def __init__(self, study_id: str, index: int, num_rows: int, num_runs: int) -> None:
        there = f"but those of runs 0 … {num_rows - 1}" if num_rows else "and none yet of any"
        super().__init__(
            f"study '{study_id}' has no result of run {index}, {there}, of {num_runs} runs"
        )


class ServiceEndingError(SlipgraspError):
    """A long operation was requested while the service is ending."""

    def __init__(self) -> None:
        super().__init__("the service is about to end; send the request again in a moment")


class RunForgottenError(SlipgraspError):
    """A run that was still queued when the service ended."""

    def __init__(self) -> None:
        super().__init__("the service ended before the run started; send the request again")


class IdempotencyKeyReusedError(SlipgraspError):
    """An idempotency key that was used with another request."""

    def __init__(self, link: str) -> None:
        super().__init__(
            f"Idempotency-Key: this key was used for {link} with another body; use a new key for a "
            "new request"
        )


def printable(text: str, length: int = 80) -> str:
    """The beginning of an untrusted text, with unprintable characters as ``?``."""
    return "".join(c if c.isprintable() else "?" for c in text[:length])
