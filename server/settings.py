"""Settings of a server process."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

from slipgrasp.recordings.store.storage_limits import StorageLimits
from slipgrasp.recordings.study.retention import KEEP_ALL, Retention
from slipgrasp.server.addresses import API_PATH, DASHBOARD_PATH
from slipgrasp.server.exceptions import SettingsError
from slipgrasp.server.log_format import LogFormat
from slipgrasp.server.peers import system_tells

_ANY_HOSTS = ("0.0.0.0", "::", "")
_PUBLIC_URL = re.compile(r"https?://([a-z0-9.-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?")
_ROOT_PATH = re.compile(r"(?!/(api|dashboard)(/|$))(/[A-Za-z0-9_~-][A-Za-z0-9._~-]*){1,8}")
"""Paths below these prefixes are our own routes, and would be ambiguous."""

LEAST_MEMORY = 100_000_000
"""Enough for a run that is recorded [bytes]."""

LOOPBACK_HOSTS = ("127.0.0.1", "::1", "localhost")


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Addresses, folders and limits of a server.

    Attributes:
        data_directory: Folder of the recordings.
        host: Address to listen on; other addresses than loopback need a token.
        port: Port to listen on; 0 for any free port.
        wall_limit: Time after which a run ends as ``limit`` [s].
        max_running: Runs simulated at the same time.
        max_waiting: Runs that may wait for their turn; further requests are refused.
        answer_within: Default time that a request for a run waits for its end [s].
        max_wait: Longest time that it may wait [s].
        max_body_bytes: Largest request body, except for recordings.
        max_upload_bytes: Largest upload of a recording.
        max_study_body_bytes: Largest request for a study.
        max_study_runs: Runs of a study.
        max_studies_waiting: Studies that may wait for their turn.
        max_event_streams: Streams of events that may be open at the same time.
        event_heartbeat: Time without events after which a stream sends a heartbeat [s].
        study_executor: Executor of studies (`slipgrasp.core.executors.make_executor`).
        study_workers: Number of its processes; None for one per processor.
        quota_bytes: Size of the data directory above which no run starts.
        min_free_bytes: Free space on its disk below which no run starts.
        memory_bytes: Memory for runs, recordings, figures and pages together, in addition to
            that of the service itself. None for 600 MB, or half of the machine's memory if less.
        token: The full token; if None, only users who need no token are admitted.
        require_token: Whether everyone needs the token, including the user who runs this server.
        root_path: Path of the server behind a proxy, such as ``/slipgrasp``; usually empty.
        public_urls: Other URLs of its pages, such as ``https://grasp.example``.
        retention: Rules for runs without name, tag or notes; by default all are retained.
        metrics: Whether it serves metrics for Prometheus.
        log_format: Format of its log.
        exclusive: Whether it locks the data directory against other services.
    """

    data_directory: Path
    host: str = "127.0.0.1"
    port: int = 0
    wall_limit: float = 30.0
    max_running: int = 2
    max_waiting: int = 100
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
    memory_bytes: int | None = None
    token: str | None = field(default=None, repr=False)
    require_token: bool = False
    root_path: str = ""
    public_urls: tuple[str, ...] = ()
    retention: Retention = KEEP_ALL
    metrics: bool = False
    log_format: LogFormat = LogFormat.TEXT
    exclusive: bool = True

    def __post_init__(self) -> None:
        if self.host not in LOOPBACK_HOSTS and self.token is None:
            raise SettingsError(
                f"host is '{self.host}', but nothing protects this server from a network without "
                f"a token: give one, or use one of {', '.join(LOOPBACK_HOSTS)}"
            )
        if self.require_token and self.token is None:
            raise SettingsError("everyone needs a token, but there is none: give one")
        if self.host in _ANY_HOSTS and not self.public_urls:
            raise SettingsError(
                f"host is '{self.host}', which is not an address for clients: give the URL of "
                "its pages with --public-url"
            )
        for url in self.public_urls:
            if not _PUBLIC_URL.fullmatch(url):
                raise SettingsError(
                    f"'{url}' is not the URL of a server; write it in lower case as "
                    "https://grasp.example or http://lab7:8020"
                )
        if self.root_path and not _ROOT_PATH.fullmatch(self.root_path):
            raise SettingsError(
                f"'{self.root_path}' is not a path of a server; write it as /slipgrasp, "
                f"without a slash at its end, and not below {API_PATH} or {DASHBOARD_PATH}"
            )
        if self.metrics and find_spec("prometheus_client") is None:
            raise SettingsError(
                "metrics need the package prometheus_client: pip install 'slipgrasp[metrics]'"
            )
        if self.memory_bytes is not None and self.memory_bytes < LEAST_MEMORY:
            raise SettingsError(
                f"memory is {self.memory_bytes} bytes, too little for a single run; allowed: at "
                f"least {LEAST_MEMORY // 10**6}MB"
            )
        if not 0 <= self.port <= 65535:
            raise SettingsError(f"port is {self.port}; allowed: 0 … 65535, 0 for any free one")

    @property
    def needs_token(self) -> bool:
        """Whether the user of the server needs the token too."""
        is_proxied = bool(self.public_urls or self.root_path)
        is_local = self.host in LOOPBACK_HOSTS and not is_proxied
        return self.require_token or not (is_local and system_tells())

    @property
    def is_encrypted(self) -> bool:
        """Whether all URLs of its pages use HTTPS."""
        return bool(self.public_urls) and all(u.startswith("https:") for u in self.public_urls)

    @property
    def names(self) -> tuple[str, ...]:
        """Host name of the server in addition to loopback and its public URLs."""
        if self.host in (*LOOPBACK_HOSTS, *_ANY_HOSTS):
            return ()
        return (f"[{self.host}]" if ":" in self.host else self.host,)

    @property
    def storage_limits(self) -> StorageLimits:
        """Limits of the size of the data directory."""
        return StorageLimits(quota=self.quota_bytes, min_free=self.min_free_bytes)
