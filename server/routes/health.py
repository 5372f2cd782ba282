"""Whether the service is up."""

from __future__ import annotations

from fastapi import APIRouter

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.run.simulator import kernel_progress
from slipgrasp.server.dependencies import RunServiceDep
from slipgrasp.server.runs.schemas import HealthPublic

router = APIRouter(tags=["health"])


@router.get("/health")
async def read_health(service: RunServiceDep) -> HealthPublic:
    """Answers as long as the service does, with how busy it is."""
    load = service.load
    return HealthPublic(
        status="ok",
        version=program_version(),
        kernel="ready" if service.kernel_is_ready else "compiling",
        kernel_progress=kernel_progress(),
        running=load.running,
        waiting=load.waiting,
    )
