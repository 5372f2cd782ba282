"""Who holds the other end of a connection, against the kernel itself."""

from __future__ import annotations

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from slipgrasp.server import peers
from slipgrasp.server.peers import Connection, find_peer_uid, system_tells

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems do not tell")


def listener(family: socket.AddressFamily) -> socket.socket:
    host = "127.0.0.1" if family == socket.AF_INET else "::"
    return socket.create_server((host, 0), family=family, dualstack_ipv6=host == "::")


@contextmanager
def connected(
    family: socket.AddressFamily, address: str
) -> Iterator[tuple[socket.socket, socket.socket]]:
    own_family = socket.AF_INET6 if ":" in address else socket.AF_INET
    with listener(family) as server, socket.socket(own_family) as client:
        client.connect((address, server.getsockname()[1]))
        accepted, _ = server.accept()
        with accepted:
            yield client, accepted


def ends(accepted: socket.socket) -> tuple[tuple[str, int], tuple[str, int]]:
    return accepted.getsockname()[:2], accepted.getpeername()[:2]


KINDS = [
    (socket.AF_INET, "127.0.0.1"),
    (socket.AF_INET, "::ffff:127.0.0.1"),
    (socket.AF_INET6, "127.0.0.1"),
    (socket.AF_INET6, "::1"),
]


@pytest.mark.parametrize(("family", "address"), KINDS)
def test_the_user_of_the_other_end_is_found(family, address) -> None:
    with connected(family, address) as (_, accepted):
        assert find_peer_uid(*ends(accepted)) == os.geteuid()
        assert Connection(*ends(accepted)).is_own


def test_an_end_that_is_closed_is_nobodys_although_the_kernel_names_root() -> None:
    with connected(socket.AF_INET, "127.0.0.1") as (client, accepted):
        found = ends(accepted)
        client.close()
        assert accepted.recv(1) == b""
        assert find_peer_uid(*found) is None


def test_a_socket_that_listens_at_the_address_of_the_other_end_is_not_that_end() -> None:
    with listener(socket.AF_INET) as server, listener(socket.AF_INET) as other:
        assert find_peer_uid(server.getsockname(), other.getsockname()) is None


def test_who_was_let_in_stays_so_until_the_connection_ends() -> None:
    with connected(socket.AF_INET, "127.0.0.1") as (client, accepted):
        connection = Connection(*ends(accepted))
        assert connection.is_own
        client.close()
        assert connection.is_own


def test_where_the_kernel_does_not_answer_nobody_is_known(monkeypatch) -> None:
    monkeypatch.setattr(peers, "find_peer_uid", lambda local, peer: None)
    system_tells.cache_clear()
    try:
        assert not system_tells()
        with connected(socket.AF_INET, "127.0.0.1") as (_, accepted):
            assert not Connection(*ends(accepted)).is_own
    finally:
        system_tells.cache_clear()
