"""``slipgrasp serve``: the dashboard and the REST interface on one port of this machine."""

from __future__ import annotations

import argparse
import errno
import os
import signal
import socket
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import add_data_directory, data_directory, store_in
from slipgrasp.cli.progress import COMPILING, Progress
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.cli.announcing_server import AnnouncingServer

__all__ = ["add_command"]

HOST = "127.0.0.1"
DEFAULT_PORT = 8020


def add_command(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Adds the command to the parser."""
    parser = commands.add_parser(
        "serve",
        help="serve the dashboard",
        description="Serves the dashboard at / and the REST interface at /api/v1 to this machine "
        "until interrupted. The first line of standard output is the URL.",
    )
    parser.add_argument(
        "--port",
        metavar="N",
        type=_port,
        default=DEFAULT_PORT,
        help=f"port to listen on, 0 takes any free one (default: {DEFAULT_PORT})",
    )
    add_data_directory(parser)
    parser.set_defaults(execute=_execute)


def _port(text: str) -> int:
    port = int(text) if text.isdecimal() and len(text) <= 5 else -1
    if not 0 <= port <= 65535:
        raise argparse.ArgumentTypeError(f"'{text[:20]}' is not a port; allowed: 0 … 65535")
    return port


def _execute(arguments: argparse.Namespace) -> ExitStatus:
    folder = data_directory(arguments.data_directory)
    store_in(folder).prepare()
    with _listen(arguments.port) as listener:
        with Progress("starting the dashboard"):
            server = _make_server(listener, folder)
        for number in (signal.SIGINT, signal.SIGTERM):
            # uvicorn raises the signal again once it has ended; then it is to do nothing more.
            signal.signal(number, server.handle_exit)
        try:
            server.run(sockets=[listener])
        except SystemExit:
            complain("the server could not start; what went wrong stands above")
            return ExitStatus.ENDED_EARLY
    return ExitStatus.COMPLETED


def _listen(port: int) -> socket.socket:
    """Takes the port at once, so that nobody else can while the dashboard is loaded."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    if os.name == "posix":
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
        listener.listen()
    except OSError as error:
        listener.close()
        cause = (
            "is in use" if error.errno == errno.EADDRINUSE else f"cannot be used: {error.strerror}"
        )
        raise CommandError(
            f"port {port} {cause}; choose another with --port, --port 0 takes any free one"
        ) from error
    return listener


def _make_server(listener: socket.socket, folder: Path) -> AnnouncingServer:
    from core.simulator import kernel_is_cached
    from server.app import server_config
    from server.settings import Settings
    from slipgrasp.cli.announcing_server import AnnouncingServer
    from web.app import create_dashboard_app

    host, port = listener.getsockname()
    settings = Settings(data_directory=folder, host=host, port=port)
    if not kernel_is_cached():
        complain(COMPILING)
    config = server_config(create_dashboard_app(settings), settings)
    return AnnouncingServer(config, url=f"http://{host}:{port}/")
