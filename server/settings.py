"""What a server process is told when it starts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from slipgrasp.recordings.store.storage_limits import StorageLimits
from slipgrasp.server.exceptions import SettingsError

LOOPBACK_HOSTS = ("127.0.0.1", "::1", "localhost")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Where a server listens, where it keeps its runs, and how much it takes on.

    Attributes:
        data_directory: Folder of the recordings.
        host: Loopback address to listen on.
        port: Port to listen on; 0 takes any free one.
        wall_limit: Time after which a run ends as ``limit`` [s].
        max_running: Runs simulated at the same time.
        max_waiting: Runs that may wait for their turn; more are told to come back.
        retry_after: When to come back [s].
        answer_within: How long a request for a run waits for its end, unless it says [s].
        max_wait: How long it may wait at most [s].
        max_body_bytes: Largest request body, but for recordings.
        max_upload_bytes: Largest recording that may be sent.
        max_study_body_bytes: Largest request for a study.
        max_study_runs: Runs of a study.
        max_studies_waiting: Studies that may wait for their turn.
        max_event_streams: Streams of events that may be open at the same time.
        event_heartbeat: After how much silence such a stream says that it is still there [s].
        study_executor: Who simulates studies (`slipgrasp.core.executors.make_executor`).
        study_workers: In how many processes; None takes as many as there are processors.
        quota_bytes: How much the files in the data directory may take; then no run is begun.
        min_free_bytes: How much must stay free on its disk; likewise.
        exclusive: Whether no other service may use the data directory meanwhile.
    """

    data_directory: Path
    host: str = "127.0.0.1"
    port: int = 0
    wall_limit: float = 30.0
    max_running: int = 2
    max_waiting: int = 100
    retry_after: int = 5
    answer_within: float = 2.0
    max_wait: float = 60.0
    max_body_bytes: int = 1_000_000
    max_upload_bytes: int = 512_000_000
    max_study_body_bytes: int = 8_000_000
    max_study_runs: int = 100_000
    max_studies_waiting: int = 20
    max_event_streams: int = 32
    event_heartbeat: float = 15.0
    study_executor: str = "processes"
    study_workers: int | None = None
    quota_bytes: int = StorageLimits().quota
    min_free_bytes: int = StorageLimits().min_free
    exclusive: bool = True

    def __post_init__(self) -> None:
        if self.host not in LOOPBACK_HOSTS:
            raise SettingsError(
                f"host is '{self.host}', but nothing protects this server from a network yet: "
                f"use one of {', '.join(LOOPBACK_HOSTS)}"
            )
        if not 0 <= self.port <= 65535:
            raise SettingsError(f"port is {self.port}; allowed: 0 … 65535, 0 takes any free one")

    @property
    def storage_limits(self) -> StorageLimits:
        """How much may be kept."""
        return StorageLimits(quota=self.quota_bytes, min_free=self.min_free_bytes)
