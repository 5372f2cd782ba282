"""The whole application on one port: REST interface and dashboard."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI
from starlette.concurrency import run_in_threadpool

from slipgrasp.server.app import create_app
from slipgrasp.server.settings import Settings
from slipgrasp.server.viewer.frame_filter import FrameFilter
from slipgrasp.server.viewer.relay import add_viewer_routes
from slipgrasp.web.dashboard import Dashboard
from slipgrasp.web.model.given_hand import NO_HAND, GivenHand
from slipgrasp.web.model.replay import Source
from slipgrasp.web.page.routes import add_page_routes, head_html


def create_dashboard_app(
    settings: Settings, first: Source | None = None, hand: GivenHand = NO_HAND
) -> FastAPI:
    """Creates the application with the dashboard at ``/`` and the API below ``/api/v1``.

    Args:
        settings: Settings of the server.
        first: Recording that the dashboard opens; its own run if None.
        hand: Hand with which it is started.
    """

    @asynccontextmanager
    async def live(app: FastAPI) -> AsyncIterator[None]:
        """A context with the dashboard, for the lifetime of the application."""
        app.state.dashboard = await run_in_threadpool(
            Dashboard,
            app.state.run_service,
            app.state.study_service,
            app.state.fit_service,
            first,
            hand,
        )
        try:
            yield
        finally:
            await run_in_threadpool(app.state.dashboard.close)

    app = create_app(settings, live)
    relay = add_viewer_routes(
        app,
        lambda: app.state.dashboard.port,
        head=head_html(settings.root_path),
        find_faults=lambda: FrameFilter().find_fault,
    )
    add_page_routes(app, relay)
    return app
