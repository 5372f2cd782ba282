"""Fits of stored recordings: requested, followed, cancelled, and their reports."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from slipgrasp.recordings.fit.fit_store import FitNotFoundError
from slipgrasp.server.addresses import fit_path
from slipgrasp.server.dependencies import (
    DownloadRequestDep,
    EventRequestDep,
    FitCreateDep,
    FitServiceDep,
    IdempotencyKey,
)
from slipgrasp.server.exceptions import JobUnfinishedError
from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.server.fits.schemas import (
    FitCreate,
    FitProgressPublic,
    FitPublic,
    FitsPublic,
)
from slipgrasp.server.fits.service import FitService
from slipgrasp.server.http.conditions import file_tag
from slipgrasp.server.http.downloads import BINARY, JSON, Download, download_responses
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.http.job_events import event_responses
from slipgrasp.server.http.openapi import json_body
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.paging import PageQuery, page_links
from slipgrasp.server.request_keys import KeyedRequest

HTML = "text/html"
_PAGE_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'self'"
_LOCATION = {"Location": {"description": "Path of the fit", "schema": {"type": "string"}}}

router = APIRouter(prefix="/fits", tags=["fits"])


@router.post(
    "",
    status_code=202,
    responses={
        202: {"description": "It is accepted, or was accepted before", "headers": _LOCATION},
        **ProblemPublic.responses((400, 413, 415, 422, 503, 507)),
    },
    openapi_extra=json_body(FitCreate),
)
async def create_fit(
    body: FitCreateDep,
    service: FitServiceDep,
    response: Response,
    idempotency_key: IdempotencyKey = "",
) -> FitPublic:
    """Fit a stored recording: the server checks the request, and queues the fit."""

    def create() -> FitPublic:
        keyed = KeyedRequest.of(idempotency_key, body.model_dump(by_alias=True))
        return FitPublic.from_status(service.create(body.to_request, keyed))

    fit = await run_in_threadpool(create)
    response.headers["Location"] = fit.links["self"]
    return fit


@router.get("", responses=ProblemPublic.responses((422,)))
def list_fits(
    query: Annotated[PageQuery, Query()], service: FitServiceDep, request: Request
) -> FitsPublic:
    """The fits, newest first."""
    found, count = service.list(query.offset, query.limit)
    data = [FitPublic.from_status(status) for status in found]
    links = page_links(str(request.url), query.offset, query.limit, count)
    return FitsPublic(data=data, count=count, links=links)


@router.get("/{fit_id}", responses=ProblemPublic.responses((404, 422)))
def read_fit(fit_id: str, service: FitServiceDep) -> FitProgressPublic:
    """A fit: its progress, and the profiles of its parameters so far."""
    return _public(service, service.status(fit_id))


@router.get(
    "/{fit_id}/events",
    response_class=Response,
    responses=event_responses(
        "Events `progress` and `end`, whose data is the fit as `GET /fits/{fit_id}` gives it"
    ),
)
async def stream_fit_events(
    fit_id: str,
    service: FitServiceDep,
    events: EventRequestDep,
) -> Response:
    """Server-sent events: progress with the profiles so far, and the end.

    The id of an event is the number of runs so far.
    """

    def describe(status: FitStatus) -> dict[str, Any]:
        return _public(service, status).model_dump(mode="json", by_alias=True)

    return await events.answer(partial(service.status, fit_id), describe)


@router.post("/{fit_id}/cancel", status_code=202, responses=ProblemPublic.responses((404,)))
def cancel_fit(fit_id: str, service: FitServiceDep) -> FitPublic:
    """Stop a fit, which then has no report. An ended fit is not changed."""
    return FitPublic.from_status(service.cancel(fit_id))


@router.post(
    "/{fit_id}/resume", status_code=202, responses=ProblemPublic.responses((404, 409, 422, 503))
)
def resume_fit(fit_id: str, service: FitServiceDep) -> FitPublic:
    """Continue a fit that was interrupted, for example because the disk was full."""
    return FitPublic.from_status(service.resume(fit_id))


@router.delete("/{fit_id}", status_code=204, responses=ProblemPublic.responses((404, 409)))
def delete_fit(fit_id: str, service: FitServiceDep) -> None:
    """Delete an ended fit and its report permanently; its recordings are kept."""
    service.delete(fit_id)


@router.get(
    "/{fit_id}/report.html",
    response_class=Response,
    responses={
        200: {"description": "The page", "content": {HTML: {"schema": {"type": "string"}}}},
        **ProblemPublic.responses((404, 409)),
    },
)
def read_fit_page(fit_id: str, service: FitServiceDep) -> Response:
    """The report of a complete fit as a page."""
    try:
        page = _file(fit_id, service, service.store.page_path(fit_id)).read_bytes()
    except FileNotFoundError:
        raise FitNotFoundError(fit_id) from None
    headers = {"Content-Security-Policy": _PAGE_POLICY}
    return Response(page, media_type=HTML, headers=headers)


@router.get(
    "/{fit_id}/report.json",
    response_class=Response,
    responses=download_responses(JSON, problems=(404, 409)),
)
def read_fit_report(fit_id: str, service: FitServiceDep, asked: DownloadRequestDep) -> Response:
    """The report of a complete fit, as `slipgrasp fit --json` prints it."""
    return _download(fit_id, service, service.store.report_path(fit_id), JSON, asked)


@router.get(
    "/{fit_id}/recording",
    response_class=Response,
    responses=download_responses(BINARY, problems=(404, 409)),
)
def read_fit_study(fit_id: str, service: FitServiceDep, asked: DownloadRequestDep) -> Response:
    """The runs of a complete fit as a study, an MCAP file."""
    return _download(fit_id, service, service.store.study_path(fit_id), BINARY, asked)


def _public(service: FitService, status: FitStatus) -> FitProgressPublic:
    is_complete = status.state is StudyState.COMPLETED
    report = service.store.read_report(status.stored.id) if is_complete else None
    return FitProgressPublic.from_fit(status, report)


def _file(fit_id: str, service: FitService, path: Path) -> Path:
    """A file of a complete fit.

    Raises:
        FitNotFoundError: If there is no such fit.
        JobUnfinishedError: If it is not complete.
    """
    if service.status(fit_id).state is not StudyState.COMPLETED:
        raise JobUnfinishedError("fit", fit_id, fit_path(fit_id))
    return path


def _download(
    fit_id: str, service: FitService, path: Path, media_type: str, asked: DownloadRequestDep
) -> Response:
    file = _file(fit_id, service, path)
    try:
        name = f"{fit_id}{file.suffix}"
        download = Download(
            tag=file_tag(file), name=name, media_type=media_type, open=partial(file.open, "rb")
        )
        return download.answer(asked)
    except FileNotFoundError:
        raise FitNotFoundError(fit_id) from None
