"""What Prometheus asks for: how busy the service is, its answers, and its process."""

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
        "1 if a run that is sent now is taken and can be kept",
        lambda state: not state.run_service.obstacles(),
    ),
    "runs_running": ("Runs that are simulated", lambda state: state.run_service.load.running),
    "runs_waiting": ("Runs that wait for their turn", lambda state: state.run_service.load.waiting),
    "runs_recovering": (
        "Runs that were cut off and are still to be recovered",
        lambda state: len(state.run_service.recovering),
    ),
    "runs_stored": (
        "Runs that are kept",
        lambda state: state.run_service.store.find(RunQuery(limit=0)).count,
    ),
    "studies_unfinished": (
        "Studies that wait or run",
        lambda state: state.study_service.num_unfinished,
    ),
    "fits_unfinished": ("Fits that wait or run", lambda state: state.fit_service.num_unfinished),
    "disk_free_bytes": (
        "What is free on the disk of the data folder",
        lambda state: shutil.disk_usage(state.settings.data_directory).free,
    ),
}


class Metrics:
    """The metrics of one application.

    Attributes:
        registry: All of them.
    """

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self._answers = Counter(
            "slipgrasp_http_answers",
            "Answers by method and status, refusals too",
            ("method", "status"),
            registry=self.registry,
        )
        self._seconds = Histogram(
            "slipgrasp_http_answer_seconds",
            "How long the head of an answer took",
            registry=self.registry,
            buckets=_SECONDS,
        )
        ProcessCollector(registry=self.registry)

    def add_to(self, app: FastAPI) -> None:
        """Lets an application, whose services live in its state, serve its metrics."""
        for name, (text, measure) in _GAUGES.items():
            gauge = Gauge(f"slipgrasp_{name}", text, registry=self.registry)
            gauge.set_function(lambda measure=measure: measure(app.state))
        # Outside of all others, so that what they refuse is counted, too.
        app.add_middleware(AnswerMeter, metrics=self)
        app.add_api_route(METRICS_PATH, self._show, include_in_schema=False)

    def note(self, method: str, status: int, seconds: float) -> None:
        """Counts an answer."""
        # Unknown methods share one label, so that their number is bounded.
        self._answers.labels(method if method in _METHODS else "other", str(status)).inc()
        self._seconds.observe(seconds)

    def _show(self, request: Request) -> Response:
        encode, content_type = choose_encoder(request.headers.get("accept", ""))
        return Response(encode(self.registry), headers={"Content-Type": content_type})


class AnswerMeter:
    """ASGI middleware: counts answers, and how long their heads take.

    Args:
        app: What answers.
        metrics: Where they are counted.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Handles one connection; what is not HTTP passes."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began, is_answered = time.perf_counter(), False

        def note(status: int) -> None:
            nonlocal is_answered
            if not is_answered:
                is_answered = True
                self._metrics.note(scope["method"], status, time.perf_counter() - began)

        async def send_and_note(message: Message) -> None:
            if message["type"] == "http.response.start":
                note(message["status"])
            await send(message)

        try:
            await self._app(scope, receive, send_and_note)
        except Exception:
            # It is answered further out.
            note(500)
            raise
