"""The application: routes, middleware and lifespan."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Callable
from contextlib import (
    AbstractAsyncContextManager,
    asynccontextmanager,
    closing,
    nullcontext,
)
from functools import partial

import uvicorn
from anyio import CapacityLimiter
from fastapi import APIRouter, FastAPI
from starlette.concurrency import run_in_threadpool
from starlette.middleware import Middleware

from slipgrasp.core.run.provenance import program_version
from slipgrasp.recordings.fit.fit_store import FitStore
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.study.study_store import StudyStore
from slipgrasp.server.addresses import API_PATH, ESTIMATE_PATH, STUDIES_PATH, UPLOAD_PATH
from slipgrasp.server.fits.service import FitService
from slipgrasp.server.http.access import AccessGuard
from slipgrasp.server.http.body_limit import BodyLimit
from slipgrasp.server.http.connections import (
    BACKLOG,
    KEEP_ALIVE_SECONDS,
    GuardedProtocol,
    note_failed_accepts,
)
from slipgrasp.server.http.ending import EndingLimit
from slipgrasp.server.http.errors import add_error_handlers
from slipgrasp.server.http.file_cache import FileCache
from slipgrasp.server.http.identity import Gate
from slipgrasp.server.http.log_limit import log_config
from slipgrasp.server.http.openapi import DescribedApi, operation_id
from slipgrasp.server.http.root_path import RootPath
from slipgrasp.server.jobs.queue import JobQueue
from slipgrasp.server.reading import RecordingReads
from slipgrasp.server.routes import (
    diff,
    docs,
    fits,
    health,
    recordings,
    run_files,
    runs,
    scenarios,
    studies,
    study_results,
)
from slipgrasp.server.runs.retention import RetentionService
from slipgrasp.server.runs.service import RunService
from slipgrasp.server.service_lock import make_private, service_lock
from slipgrasp.server.settings import Settings
from slipgrasp.server.studies.service import StudyService
from slipgrasp.server.tokens import Tokens

Lifespan = Callable[[FastAPI], AbstractAsyncContextManager[None]]

GRACEFUL_SHUTDOWN_SECONDS = 3
MAX_VIEWER_MESSAGE_BYTES = 16 * 1024 * 1024


def create_app(settings: Settings, lifespan: Lifespan | None = None) -> FastAPI:
    """Creates the application.

    Args:
        settings: Settings of the server.
        lifespan: Additional context, entered after the services have started.

    Returns:
        The application with the REST interface below ``/api/v1``.
    """
    tokens = Tokens.random() if settings.token is None else Tokens(settings.token)
    gate = Gate(
        tokens,
        trusts_connections=not settings.needs_token,
        is_encrypted=settings.is_encrypted,
    )
    stopping = asyncio.Event()
    app = DescribedApi(
        title="slipgrasp",
        version=program_version(),
        description="Simulate grasping with slip. Quantities are SI; errors are problem details.",
        docs_url=None,
        redoc_url=None,
        openapi_url=f"{API_PATH}/openapi.json",
        servers=[{"url": settings.root_path}] if settings.root_path else None,
        redirect_slashes=False,
        generate_unique_id_function=operation_id,
        lifespan=partial(_live, settings, lifespan),
        middleware=[
            Middleware(EndingLimit, stopping=stopping),
            Middleware(RootPath, root=settings.root_path),
            Middleware(AccessGuard, gate=gate, names=settings.names, public=settings.public_urls),
            Middleware(
                BodyLimit,
                max_bytes=settings.max_body_bytes,
                larger={
                    UPLOAD_PATH: settings.max_upload_bytes,
                    STUDIES_PATH: settings.max_study_body_bytes,
                    ESTIMATE_PATH: settings.max_study_body_bytes,
                },
            ),
        ],
    )
    app.state.settings = settings
    app.state.stopping = stopping
    app.include_router(_api())
    if settings.metrics:
        # It needs an optional package.
        from slipgrasp.server.http.metrics import add_metrics

        add_metrics(app)
    add_error_handlers(app)
    return app


@asynccontextmanager
async def _live(settings: Settings, lifespan: Lifespan | None, app: FastAPI) -> AsyncIterator[None]:
    """The services in order, and the additional context."""
    store = RecordingStore(settings.data_directory, settings.storage_limits)
    store.prepare()
    make_private(settings.data_directory)
    lock = service_lock(settings.data_directory) if settings.exclusive else nullcontext()
    with lock, closing(store):
        if settings.exclusive and settings.token is not None:
            Tokens(settings.token).save(settings.data_directory)
        service = RunService(store, settings, app.state.stopping.is_set)
        app.state.run_service = service
        app.state.upload_slots = asyncio.Semaphore(recordings.MAX_UPLOADS)
        app.state.file_cache = FileCache()
        app.state.recording_reads = RecordingReads(service.memory)
        service.start()
        studies_kept = StudyStore(settings.data_directory, store)
        # A study may write a recording again that a killed service left.
        queue = JobQueue(settings, service.is_recovered.wait)
        study_service = StudyService(studies_kept, settings, queue, app.state.stopping.is_set)
        app.state.study_service = study_service
        app.state.event_slots = asyncio.Semaphore(settings.max_event_streams)
        app.state.event_makers = CapacityLimiter(1)
        study_service.start()
        fits_kept = FitStore(settings.data_directory, store)
        fit_service = FitService(
            fits_kept, settings, queue, service.memory, app.state.stopping.is_set
        )
        app.state.fit_service = fit_service
        fit_service.start()
        retention_service = RetentionService(
            store,
            studies_kept,
            settings.retention,
            service.is_recovered.wait,
            fits_kept.used_recordings,
        )
        retention_service.start()
        store.begin_listing()
        try:
            async with lifespan(app) if lifespan else nullcontext():
                yield
        finally:
            await run_in_threadpool(retention_service.close)
            await run_in_threadpool(study_service.close)
            await run_in_threadpool(service.close)
            app.state.file_cache.close()


class StoppableServer(uvicorn.Server):
    """Sets ``app.state.stopping`` before it waits for unfinished responses."""

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts the application and its listeners."""
        note_failed_accepts(asyncio.get_running_loop())
        await super().startup(sockets)

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Ends responses, then the application."""
        if isinstance(self.config.app, FastAPI):
            self.config.app.state.stopping.set()
        await super().shutdown(sockets)


def server_config(app: FastAPI, settings: Settings) -> uvicorn.Config:
    """The configuration of uvicorn, with limits on slow clients."""
    return uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        http=GuardedProtocol,
        backlog=BACKLOG,
        timeout_keep_alive=KEEP_ALIVE_SECONDS,
        log_config=log_config(settings.log_format),
        # The peer is the proxy, not the client in its headers.
        proxy_headers=False,
        log_level="warning",
        # Links contain tokens.
        access_log=False,
        timeout_graceful_shutdown=GRACEFUL_SHUTDOWN_SECONDS,
        ws_max_size=MAX_VIEWER_MESSAGE_BYTES,
        # Messages of viser are already compressed.
        ws_per_message_deflate=False,
        server_header=False,
    )


def _api() -> APIRouter:
    api = APIRouter(prefix=API_PATH)
    for part in (
        health,
        scenarios,
        runs,
        recordings,
        run_files,
        studies,
        study_results,
        fits,
        diff,
        docs,
    ):
        api.include_router(part.router)
    return api
