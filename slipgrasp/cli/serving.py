"""Serves the dashboard until interrupted."""

from __future__ import annotations

import argparse
import errno
import gc
import os
import re
import signal
import socket
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipgrasp.cli.arguments import number_in, store_in
from slipgrasp.cli.progress import Progress, compiling_words
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.cli.announcing_server import AnnouncingServer
    from slipgrasp.server.settings import Settings
    from slipgrasp.web.model.given_hand import GivenHand
    from slipgrasp.web.model.replay import Source

HOST = "127.0.0.1"
DEFAULT_PORT = 8020
DEFAULT_EXECUTOR = "processes"

SWITCH_SECONDS = 1e-3
"""Switch interval of the interpreter [s]; requests would wait longer with its default of 5 ms."""

_SIZE = re.compile(r"([0-9]{1,15}(?:\.[0-9]{1,6})?) ?([kmgt]?b)?")
_UNITS = {"": 1, "b": 1, "kb": 10**3, "mb": 10**6, "gb": 10**9, "tb": 10**12}


def add_port(parser: argparse.ArgumentParser, default: int = DEFAULT_PORT) -> None:
    """Adds ``--port``."""
    parser.add_argument(
        "--port",
        metavar="N",
        type=number_in(0, 65535, "a port", of=int),
        default=default,
        help=f"port to listen on, 0 for any free port (default: {default})",
    )


def add_network(parser: argparse.ArgumentParser) -> None:
    """Adds ``--host``, ``--public-url``, ``--root-path`` and ``--require-token``."""
    parser.add_argument(
        "--host",
        metavar="ADDRESS",
        default=HOST,
        help="address to listen on; for all but 127.0.0.1, ::1 and localhost, all users need the "
        "token in the printed link, or in SLIPGRASP_TOKEN; 0.0.0.0 and :: also need --public-url "
        f"(default: {HOST})",
    )
    parser.add_argument(
        "--public-url",
        metavar="URL",
        dest="public_urls",
        action="append",
        default=[],
        type=lambda text: text.rstrip("/"),
        help="another URL of the dashboard, such as https://grasp.example behind a proxy; requires "
        "the token from all users; may be repeated",
    )
    parser.add_argument(
        "--root-path",
        metavar="PATH",
        default="",
        type=lambda text: text.rstrip("/"),
        help="path of the server behind a proxy, such as /slipgrasp; the proxy may remove it from "
        "requests; requires the token from all users",
    )
    parser.add_argument(
        "--require-token",
        action="store_true",
        help="require the token from all users, including those on this machine; needed if the "
        "port is forwarded, because forwarded requests seem to come from this machine",
    )


def add_limits(parser: argparse.ArgumentParser) -> None:
    """Adds ``--quota``, ``--min-free`` and ``--memory``."""
    for name, what in (
        ("--quota", "total size of the recordings, such as 5GB, above which no run starts"),
        (
            "--min-free",
            "free space on the recordings' disk, such as 500MB, below which no run starts",
        ),
        (
            "--memory",
            "memory for runs, recordings, figures and pages together, such as 2GB, in addition to "
            "about 200MB for the server (default: 600MB, or half of the memory of the machine or "
            "container if that is less)",
        ),
    ):
        parser.add_argument(name, metavar="SIZE", type=parse_size, help=what)


def add_log_format(parser: argparse.ArgumentParser) -> None:
    """Adds ``--log-format``."""
    parser.add_argument(
        "--log-format",
        choices=("text", "json"),
        default="text",
        help="format of the log on standard error: lines of text, or one JSON object per event "
        "(default: text)",
    )


def add_metrics(parser: argparse.ArgumentParser) -> None:
    """Adds ``--metrics``."""
    parser.add_argument(
        "--metrics",
        action="store_true",
        help="serve metrics for Prometheus at /metrics; needs pip install 'slipgrasp[metrics]'",
    )


def add_executor(parser: argparse.ArgumentParser) -> None:
    """Adds ``--executor``."""
    parser.add_argument(
        "--executor",
        metavar="WHERE",
        default=DEFAULT_EXECUTOR,
        help="where to simulate the runs of studies: processes (default), inline, dask (a cluster "
        "on this machine) or dask://HOST:PORT (an existing scheduler)",
    )


def parse_size(text: str) -> int:
    """Parses a number of bytes, with or without a common unit."""
    found = _SIZE.fullmatch(text.strip().lower())
    if found is None:
        raise argparse.ArgumentTypeError(f"'{text[:20]}' is not a size; write it as 500MB or 5GB")
    return round(float(found[1]) * _UNITS[found[2] or ""])


def serve_dashboard(
    arguments: argparse.Namespace,
    folder: Path,
    first: Source | None = None,
    hand: GivenHand | None = None,
    **others: Any,
) -> ExitStatus:
    """Serves until interrupted; the first line of standard output is the URL.

    Args:
        arguments: Arguments of `add_port`, `add_network`, `add_limits` and `add_log_format`.
        folder: Folder of the recordings.
        first: Recording that the dashboard opens; its own run if None.
        hand: Hand with which it is started.
        others: Further settings of `slipgrasp.server.settings.Settings`.

    Raises:
        CommandError: If the port is not available.
        ExecutorError: If there is no such executor.
        FolderInUseError: If another service uses the folder, except for a replay.
        RecordingWriteError: If nothing can be saved in the folder.
        SettingsError: If the server would be unprotected or unreachable.
    """
    from slipgrasp.core.executors import make_executor
    from slipgrasp.server.log_format import LogFormat
    from slipgrasp.server.memory import give_back_freed_memory
    from slipgrasp.server.service_lock import check_not_served

    give_back_freed_memory()
    sys.setswitchinterval(SWITCH_SECONDS)
    # A wrong executor is reported before anything starts.
    make_executor(others.get("study_executor", DEFAULT_EXECUTOR)).close()
    store_in(folder).prepare()
    if first is None:
        check_not_served(folder)
    with _listen(arguments.host, arguments.port) as listener:
        address = listener.getsockname()[:2]
        settings = _settings(address, arguments, folder, exclusive=first is None, **others)
        is_silent = settings.log_format is LogFormat.JSON
        with nullcontext() if is_silent else Progress("starting the dashboard"):
            server = _make_server(settings, first, hand)
        # Loaded modules are not garbage: collections that skip them are several times as fast.
        gc.freeze()
        for number in (signal.SIGINT, signal.SIGTERM):
            # uvicorn raises the signal again at its end, when nothing is left to do.
            signal.signal(number, server.handle_exit)
        try:
            server.run(sockets=[listener])
        except SystemExit:
            complain("the server could not start; see the messages above")
            return ExitStatus.ENDED_EARLY
    return ExitStatus.COMPLETED


def _listen(host: str, port: int) -> socket.socket:
    """Binds the port at once, so that no other process takes it while the dashboard loads."""
    # Named, because asyncio sends short responses immediately only on sockets known to be TCP.
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    if os.name == "posix":
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen()
    except OSError as error:
        listener.close()
        is_in_use = error.errno == errno.EADDRINUSE
        if host != HOST and not is_in_use:
            raise CommandError(f"host {host} cannot be used: {error.strerror}") from error
        cause = "is in use" if is_in_use else f"cannot be used: {error.strerror}"
        raise CommandError(
            f"port {port} {cause}; choose another with --port; --port 0 chooses a free one"
        ) from error
    return listener


def _settings(
    address: tuple[str, int],
    arguments: argparse.Namespace,
    folder: Path,
    **others: Any,
) -> Settings:
    from slipgrasp.server.log_format import LogFormat
    from slipgrasp.server.settings import Settings
    from slipgrasp.server.tokens import TOKEN_VARIABLE, Tokens

    host, port = address
    limits = {
        "quota_bytes": arguments.quota,
        "min_free_bytes": arguments.min_free,
        "memory_bytes": arguments.memory,
    }
    chosen = {name: size for name, size in limits.items() if size is not None}
    token = os.environ.get(TOKEN_VARIABLE)
    tokens = Tokens(token) if token else Tokens.random()
    return Settings(
        data_directory=folder,
        host=host,
        port=port,
        log_format=LogFormat(arguments.log_format),
        token=tokens.full,
        require_token=arguments.require_token,
        root_path=arguments.root_path,
        public_urls=tuple(arguments.public_urls),
        **chosen,
        **others,
    )


def _make_server(
    settings: Settings, first: Source | None, hand: GivenHand | None
) -> AnnouncingServer:
    from slipgrasp.cli.announcing_server import AnnouncingServer
    from slipgrasp.core.run.simulator import kernel_is_cached
    from slipgrasp.core.scenario.space import PLANAR
    from slipgrasp.server.app import server_config
    from slipgrasp.server.http.identity import TOKEN_PARAMETER
    from slipgrasp.server.http.log_limit import log_stray_errors
    from slipgrasp.server.log_format import LogFormat
    from slipgrasp.server.tokens import Tokens
    from slipgrasp.web.app import create_dashboard_app
    from slipgrasp.web.model.given_hand import NO_HAND

    log_stray_errors(settings.log_format)
    is_silent = settings.log_format is LogFormat.JSON
    if not (kernel_is_cached() or is_silent):
        complain(compiling_words(PLANAR))
    config = server_config(create_dashboard_app(settings, first, hand or NO_HAND), settings)
    host, port = settings.host, settings.port
    address = f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
    url = f"{(*settings.public_urls, address)[0]}{settings.root_path}/"
    if settings.token is None or not settings.needs_token:
        return AnnouncingServer(config, url)
    tokens = Tokens(settings.token)
    link, looking = (f"{url}?{TOKEN_PARAMETER}={t}" for t in (tokens.full, tokens.read_only))
    remark = "" if is_silent else f"read-only link: {looking}"
    return AnnouncingServer(config, link, remark)
