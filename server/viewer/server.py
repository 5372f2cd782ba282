"""A viser server that only this machine's own pages can use."""

from __future__ import annotations

import logging

import rich
import viser

from slipgrasp.server.http.access import guarded_websocket_listeners

_logger = logging.getLogger(__name__)


class ViewerServer(viser.ViserServer):
    """viser on a free loopback port: guarded, silent, and without its public share tunnel."""

    def __init__(self, label: str | None = None) -> None:
        # Its banner names the internal port, on the standard output that belongs to our URL.
        rich.get_console().quiet = True
        with guarded_websocket_listeners():
            super().__init__(host="127.0.0.1", port=0, label=label, verbose=False)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuses what any viewer may ask for: a tunnel from the internet to this machine."""
        _logger.warning("refused a viewer's request for a public share tunnel")
        return None
