"""Prometheus metrics: load of the service, responses, and process."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping

from fastapi import FastAPI, Request
from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_client.exposition import choose_encoder
from starlette.datastructures import State
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from slipgrasp.recordings.store.run_query import RunQuery

METRICS_PATH = "/metrics"

_METHODS = ("DELETE", "GET", "HEAD", "OPTIONS", "PATCH", "POST", "PUT")
_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 60.0)

_GAUGES: Mapping[str, tuple[str, Callable[[State], float]]] = {
    "ready": (
        "1 if a new run is accepted and can be stored",
        lambda state: not state.run_service.obstacles(),
    ),
    "runs_running": ("Runs that are being simulated", lambda state: state.run_service.load.running),
    "runs_waiting": ("Runs that wait for their turn", lambda state: state.run_service.load.waiting),
    "runs_recovering": (
        "Interrupted runs that are not recovered yet",
        lambda state: len(state.run_service.recovering),
    ),
    "runs_stored": (
        "Stored runs",
        lambda state: state.run_service.store.find(RunQuery(limit=0)).count,
    ),
    "studies_unfinished": (
        "Studies that are waiting or running",
        lambda state: state.study_service.num_unfinished,
    ),
    "fits_unfinished": ("Fits that wait or run", lambda state: state.fit_service.num_unfinished),
    "disk_free_bytes": (
        "Free space on the disk of the data folder",
        lambda state: shutil.disk_usage(state.settings.data_directory).free,
    ),
}


def add_metrics(app: FastAPI) -> None:
    """Adds the metrics of an application, whose services are in its state."""
    registry = CollectorRegistry()
    ProcessCollector(registry=registry)
    for name, (text, measure) in _GAUGES.items():
        gauge = Gauge(f"slipgrasp_{name}", text, registry=registry)
        gauge.set_function(lambda measure=measure: measure(app.state))
    # Outermost, so that rejections by other middleware are counted too.
    app.add_middleware(AnswerMeter, registry=registry)

    def show_metrics(request: Request) -> Response:
        encode, content_type = choose_encoder(request.headers.get("accept", ""))
        return Response(encode(registry), headers={"Content-Type": content_type})

    app.add_api_route(METRICS_PATH, show_metrics, include_in_schema=False)


class AnswerMeter:
    """ASGI middleware: counts responses, and measures the time until their heads.

    Args:
        app: The application.
        registry: Registry of its metrics.
    """

    def __init__(self, app: ASGIApp, registry: CollectorRegistry) -> None:
        self._app = app
        self._answers = Counter(
            "slipgrasp_http_answers",
            "Responses by method and status, including rejections",
            ("method", "status"),
            registry=registry,
        )
        self._seconds = Histogram(
            "slipgrasp_http_answer_seconds",
            "Time until the head of a response",
            registry=registry,
            buckets=_SECONDS,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; protocols other than HTTP pass unchanged."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began, is_answered = time.perf_counter(), False

        def note(status: int) -> None:
            nonlocal is_answered
            if not is_answered:
                is_answered = True
                # Unknown methods share a label, so that the number of labels is limited.
                method = scope["method"] if scope["method"] in _METHODS else "other"
                self._answers.labels(method, str(status)).inc()
                self._seconds.observe(time.perf_counter() - began)

        async def send_and_note(message: Message) -> None:
            if message["type"] == "http.response.start":
                note(message["status"])
            await send(message)

        try:
            await self._app(scope, receive, send_and_note)
        except Exception:
            # The response is sent by outer middleware.
            note(500)
            raise
