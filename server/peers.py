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
from pathlib import Path

Address = tuple[str, int]

ROOT_UID = 0
UNKNOWN_UID = 65534
"""User id for users that are unknown in this container."""

_TABLES = (Path("/proc/net/tcp"), Path("/proc/net/tcp6"))
_TABLE_UID, _TABLE_INODE = 7, 9

# linux/netlink.h, linux/sock_diag.h and linux/inet_diag.h
_NETLINK, _SOCK_DIAG = 16, 4
_DIAG_BY_FAMILY, _REQUEST = 20, 1
_ALL_STATES, _NO_COOKIE = 0xFFFFFFFF, b"\xff" * 8
_MESSAGE_HEADER = struct.Struct("=IHHII")
_DIAG_REQUEST = struct.Struct("=BBBxI36s12s")
_DIAG_ANSWER = struct.Struct("=4x36s12x12xII")
_DIAG_SECONDS = 1.0


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
    """The user who owns the other end of a connection; None if unknown."""
    own, other = (_plain(peer[0]), peer[1]), (_plain(local[0]), local[1])
    if type(own[0]) is not type(other[0]):
        return None
    uid = _ask_kernel(own, other)
    return _look_up(own, other) if uid is None else uid


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


_PlainAddress = tuple[IPv4Address | IPv6Address, int]


def _plain(address: str) -> IPv4Address | IPv6Address:
    """An address; IPv4 addresses in IPv6 notation are converted."""
    found = ip_address(address.partition("%")[0])
    return getattr(found, "ipv4_mapped", None) or found


def _ask_kernel(own: _PlainAddress, other: _PlainAddress) -> int | None:
    """Queries one socket; takes microseconds, regardless of their number."""
    family = socket.AF_INET if own[0].version == 4 else socket.AF_INET6
    ends = struct.pack(
        "!HH16s16s",
        own[1],
        other[1],
        own[0].packed.ljust(16, b"\0"),
        other[0].packed.ljust(16, b"\0"),
    )
    request = _DIAG_REQUEST.pack(
        family, socket.IPPROTO_TCP, 0, _ALL_STATES, ends, bytes(4) + _NO_COOKIE
    )
    length = _MESSAGE_HEADER.size + len(request)
    try:
        with socket.socket(_NETLINK, socket.SOCK_RAW, _SOCK_DIAG) as kernel:
            kernel.settimeout(_DIAG_SECONDS)
            kernel.sendto(
                _MESSAGE_HEADER.pack(length, _DIAG_BY_FAMILY, _REQUEST, 0, 0) + request, (0, 0)
            )
            answer = kernel.recv(4096)
    except OSError:
        return None
    if _MESSAGE_HEADER.unpack_from(answer)[1] != _DIAG_BY_FAMILY:
        return None
    found, uid, inode = _DIAG_ANSWER.unpack_from(answer, _MESSAGE_HEADER.size)
    # Without such a connection, a listening socket at its address may be found.
    return uid if found == ends and inode else None


def _look_up(own: _PlainAddress, other: _PlainAddress) -> int | None:
    """Reads the tables of all sockets, for kernels without queries of one socket."""
    # A row may be missed if a preceding one is removed during reading.
    for table in _TABLES * 2:
        try:
            rows = table.read_bytes()
        except OSError:
            continue
        for ends in _written(own, other):
            if (start := rows.find(ends)) >= 0:
                # The index of the row precedes its addresses.
                row = [b"", *rows[start:].split(b"\n", 1)[0].split()]
                return int(row[_TABLE_UID]) if int(row[_TABLE_INODE]) else None
    return None


def _written(own: _PlainAddress, other: _PlainAddress) -> list[bytes]:
    """The two ends in the notation of the tables; IPv6 sockets may have IPv4 connections."""
    pairs = [(own[0].packed, other[0].packed)]
    if own[0].version == 4:
        mapped = b"\0" * 10 + b"\xff" * 2
        pairs.append((mapped + own[0].packed, mapped + other[0].packed))
    return [
        f" {_words(a)}:{own[1]:04X} {_words(b)}:{other[1]:04X} ".encode("ascii") for a, b in pairs
    ]


def _words(packed: bytes) -> str:
    """The tables show each word of four bytes as a number in native byte order."""
    return "".join(f"{word:08X}" for word in struct.unpack(f"={len(packed) // 4}I", packed))
