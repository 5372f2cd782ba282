"""Errors of the server, with messages of one sentence."""

from __future__ import annotations

from slipgrasp.core.exceptions import ScenarioError, SlipgraspError
from slipgrasp.server.addresses import run_path

RETRY_AFTER = 5
"""Time after which refused clients may try again [s]."""


class SettingsError(SlipgraspError):
    """Invalid settings of a server."""


class InvalidRequestError(ScenarioError):
    """A malformed request, with one item per wrong field."""


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
    """No capacity for a request at the moment."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"{reason}; try again in {RETRY_AFTER} s")


class MemoryLimitError(SlipgraspError):
    """A job that needs more memory than the limit of the server."""

    def __init__(self, job: str, num_bytes: int, limit: int, cure: str) -> None:
        megabytes = -(-num_bytes // 10**6)
        more = f"start the server with --memory of at least {megabytes}MB"
        super().__init__(
            f"{job} needs {megabytes} MB of memory, and there are "
            f"{limit // 10**6} MB for it; {cure}{', or ' if cure else ''}{more}"
        )


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
