"""HTTP/1.1 of uvicorn, which adds its connection to each request."""

from __future__ import annotations

import asyncio

import h11

from slipgrasp.server.http.connections import BoundedConnection
from slipgrasp.server.http.errors import problem_response
from slipgrasp.server.peers import Connection


class GuardedProtocol(BoundedConnection):
    """Adds the connection to the ``state`` of each request, and of the websocket it may become."""

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Accepts a new connection."""
        super().connection_made(transport)
        ends = (transport.get_extra_info("sockname"), transport.get_extra_info("peername"))
        if all(ends):
            local, peer = ends
            self.app_state = {**self.app_state, "connection": Connection(local[:2], peer[:2])}

    def send_400_response(self, msg: str) -> None:
        """Responds to invalid HTTP, unless a response was sent, and closes the connection."""
        if self.conn.our_state not in (h11.IDLE, h11.SEND_RESPONSE):
            self.transport.close()
            return
        answer = problem_response(400, msg, headers={"Connection": "close"})
        for event in (
            h11.Response(status_code=answer.status_code, headers=answer.raw_headers),
            h11.Data(data=bytes(answer.body)),
            h11.EndOfMessage(),
        ):
            self.transport.write(self.conn.send(event) or b"")
        self.transport.close()
