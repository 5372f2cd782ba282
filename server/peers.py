"""User at the other end of a local connection, from the Linux kernel.

After a program has closed its end, while the kernel handles the last packets, the kernel reports no
open file (inode 0) and root as the user; the user is then unknown.
"""

from __future__ import annotations

import os
import socket
import struct
import sys
from contextlib import closing
from dataclasses import dataclass
from functools import cache, cached_property
from ipaddress import IPv4Address, IPv6Address, ip_address

Address = tuple[str, int]

ROOT_UID = 0
UNKNOWN_UID = 65534
"""User id for users that are unknown in this container."""

# linux/netlink.h, linux/sock_diag.h and linux/inet_diag.h
_NETLINK, _SOCK_DIAG = 16, 4
_DIAG_BY_FAMILY, _REQUEST = 20, 1
_ALL_STATES, _NO_COOKIE = 0xFFFFFFFF, b"\xff" * 8
_MESSAGE_HEADER = struct.Struct("=IHHII")
_DIAG_REQUEST = struct.Struct("=BBBxI36s12s")
_DIAG_ANSWER = struct.Struct("=4x36s12x12xII")
_DIAG_SECONDS = 1.0
_ENDS = struct.Struct("!HH16s16s")
_MAPPED = bytes(10) + b"\xff" * 2
"""Beginning of IPv4 addresses in IPv6 notation."""


@dataclass(frozen=True)
class Connection:
    """The two ends of a connection, as seen from this process.

    Attributes:
        local: Address and port of this end.
        peer: Address and port of the other end.
    """

    local: Address
    peer: Address

    @cached_property
    def is_own(self) -> bool:
        """Whether the user of this process, or root, owns the other end; cached.

        False if the system does not report it.
        """
        return system_tells() and find_peer_uid(self.local, self.peer) in (os.geteuid(), ROOT_UID)


def find_peer_uid(local: Address, peer: Address) -> int | None:
    """The user who owns the other end of a connection; None if unknown.

    Takes microseconds, regardless of the number of connections.
    """
    own, other = _plain(peer[0]), _plain(local[0])
    if own.version != other.version:
        return None
    family, prefixes = socket.AF_INET6, [b""]
    if own.version == 4:
        # IPv6 sockets may have IPv4 connections.
        family, prefixes = socket.AF_INET, [b"", _MAPPED]
    known = [
        _ENDS.pack(peer[1], local[1], prefix + own.packed, prefix + other.packed)
        for prefix in prefixes
    ]
    tail = bytes(4) + _NO_COOKIE
    answer = _ask_kernel(
        _DIAG_REQUEST.pack(family, socket.IPPROTO_TCP, 0, _ALL_STATES, known[0], tail)
    )
    if not answer or _MESSAGE_HEADER.unpack_from(answer)[1] != _DIAG_BY_FAMILY:
        return None
    found, uid, inode = _DIAG_ANSWER.unpack_from(answer, _MESSAGE_HEADER.size)
    # Without such a connection, a listening socket at its address may be found.
    return uid if found in known and inode else None


@cache
def system_tells() -> bool:
    """Whether this system reports the user of a connection; tested once."""
    if sys.platform != "linux" or os.geteuid() == UNKNOWN_UID:
        return False
    try:
        with (
            socket.create_server(("127.0.0.1", 0)) as listener,
            socket.create_connection(listener.getsockname()) as client,
            closing(listener.accept()[0]) as accepted,
        ):
            found = find_peer_uid(accepted.getsockname(), client.getsockname())
    except OSError:
        return False
    return found == os.geteuid()


def _plain(address: str) -> IPv4Address | IPv6Address:
    """An address; IPv4 addresses in IPv6 notation are converted."""
    found = ip_address(address.partition("%")[0])
    return getattr(found, "ipv4_mapped", None) or found


def _ask_kernel(request: bytes) -> bytes:
    """The answer to a query of one socket; empty if there is none."""
    length = _MESSAGE_HEADER.size + len(request)
    head = _MESSAGE_HEADER.pack(length, _DIAG_BY_FAMILY, _REQUEST, 0, 0)
    try:
        with socket.socket(_NETLINK, socket.SOCK_RAW, _SOCK_DIAG) as kernel:
            kernel.settimeout(_DIAG_SECONDS)
            kernel.sendto(head + request, (0, 0))
            return kernel.recv(4096)
    except OSError:
        return b""
