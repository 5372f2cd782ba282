"""Somebody else on this machine: another account, which asks by programs of its own."""

from __future__ import annotations

import json
import os
import pwd
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest

from tests.server.raw_http import Answer
from tests.waiting import PATIENCE

NOBODY = (65534, 65534)

Account = tuple[int, int]
"""Numbers of a user and of its group."""

_CLIENT = """
import json, os, socket, sys
socket.create_server(("127.0.0.1", 0)).close()
"loaded, while it can be read".encode("latin-1").decode("latin-1").encode("idna")
os.setgroups([])
os.setgid({gid})
os.setuid({uid})
for line in sys.stdin:
    port, request = json.loads(line)
    received = b""
    with socket.create_connection(("127.0.0.1", port), timeout={patience}) as connection:
        connection.sendall(request.encode("latin-1"))
        while not received.startswith(b"HTTP/1.1 101"):
            piece = connection.recv(65536)
            if not piece:
                break
            received += piece
    print(json.dumps(received.decode("latin-1")), flush=True)
"""


def needs_another_account() -> pytest.MarkDecorator:
    """Skips a test where it cannot become somebody else."""
    can = sys.platform == "linux" and os.geteuid() == 0
    return pytest.mark.skipif(not can, reason="only root can become another user")


@contextmanager
def another_account() -> Iterator[Account]:
    """An account of this machine, made for the time being; that of nobody where none can be."""
    name = f"slipgrasp-{os.getpid()}"
    try:
        options = ("--system", "--user-group", "--no-create-home", "--shell", "/bin/false")
        subprocess.run(["useradd", *options, name], check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        yield NOBODY
        return
    try:
        made = pwd.getpwnam(name)
        yield made.pw_uid, made.pw_gid
    finally:
        subprocess.run(["userdel", name], check=True, capture_output=True)


def ask_as(account: Account, port: int, requests: Sequence[bytes]) -> list[Answer]:
    """The answers to requests, each by a connection of its own, from another account."""
    uid, gid = account
    program = _CLIENT.format(uid=uid, gid=gid, patience=PATIENCE)
    lines = "".join(json.dumps([port, r.decode("latin-1")]) + "\n" for r in requests)
    # Isolated, as the account may not read where the tests are.
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", program],
        input=lines,
        capture_output=True,
        text=True,
        check=True,
        timeout=PATIENCE,
        cwd="/",
    )
    return [_parsed(json.loads(line)) for line in done.stdout.splitlines()]


def _parsed(text: str) -> Answer:
    head, _, body = text.partition("\r\n\r\n")
    status_line, *lines = head.split("\r\n")
    headers = {name.lower(): value.strip() for name, _, value in (x.partition(":") for x in lines)}
    return Answer(int(status_line.split()[1]), headers, body.encode("latin-1"))
