"""Uploads of recordings."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import aclosing
from typing import Annotated, Any

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect

from slipgrasp.recordings.store.annotations import Annotations, RunName
from slipgrasp.recordings.store.store import RecordingStore, StoredRun
from slipgrasp.server.budget import MemoryBudget, Need
from slipgrasp.server.dependencies import MemoryDep, RunServiceDep, UploadSlotsDep
from slipgrasp.server.exceptions import (
    ServiceBusyError,
    UnreadableBodyError,
    UnsupportedBodyError,
)
from slipgrasp.server.http.conditions import entity_tag
from slipgrasp.server.http.downloads import BINARY, BINARY_SCHEMA
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.runs.schemas import RunPublic

MAX_UPLOADS = 4
WRITE_BYTES = 1 << 20

_RAW_TYPES = (
    BINARY,
    "application/x-mcap",
    "application/mcap",
    # The default content type of curl with --data-binary.
    "application/x-www-form-urlencoded",
    "",
)

router = APIRouter(tags=["recordings"])

_UPLOAD_BODY: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "description": "A recording from `slipgrasp run`: `curl --data-binary @run.mcap URL`.",
        "content": {kind: {"schema": BINARY_SCHEMA} for kind in _RAW_TYPES[:2]},
    }
}


@router.post(
    "/recordings",
    status_code=201,
    responses=ProblemPublic.responses((400, 408, 413, 415, 422, 503, 507)),
    openapi_extra=_UPLOAD_BODY,
)
async def upload_recording(
    request: Request,
    service: RunServiceDep,
    slots: UploadSlotsDep,
    memory: MemoryDep,
    response: Response,
    name: Annotated[RunName, Query(description="name of the run", examples=["from the lab"])] = "",
) -> RunPublic:
    """Upload a recording; the server reads it completely before storing it."""
    if slots.locked():
        raise ServiceBusyError(f"{MAX_UPLOADS} recordings are already being uploaded")
    async with slots:
        stored = await _receive(request, service.store, memory, name)
    run = await run_in_threadpool(RunPublic.from_stored, stored)
    response.headers["Location"] = run.links["self"]
    response.headers["ETag"] = entity_tag(stored)
    return run


async def _receive(
    request: Request, store: RecordingStore, memory: MemoryBudget, name: str
) -> StoredRun:
    content_type = request.headers.get("content-type", "")
    if content_type.partition(";")[0].strip().lower() not in _RAW_TYPES:
        raise UnsupportedBodyError(content_type, BINARY)
    declared = int(request.headers.get("content-length", "0"))
    reservation = await run_in_threadpool(store.reserve, declared)
    with store.upload(reservation) as upload:
        async with aclosing(_pieces(request)) as pieces:
            async for piece in pieces:
                await run_in_threadpool(upload.write, piece)
        size = await run_in_threadpool(upload.read_size)
        async with memory.reserve_async(Need.to_open(size)):
            result = await run_in_threadpool(upload.finish)
    annotations = Annotations(name=name)
    return await run_in_threadpool(store.register, reservation, result, annotations)


async def _pieces(request: Request) -> AsyncGenerator[bytes]:
    """The body in pieces that are large enough for a thread.

    Raises:
        UnreadableBodyError: If its sender disconnects.
    """
    waiting = bytearray()
    try:
        async for piece in request.stream():
            waiting += piece
            if len(waiting) >= WRITE_BYTES:
                yield bytes(waiting)
                waiting.clear()
    except ClientDisconnect as error:
        raise UnreadableBodyError("its sender has disconnected", "complete") from error
    yield bytes(waiting)
