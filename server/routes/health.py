"""Whether the service is up."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.run.simulator import kernel_progress
from slipgrasp.server.dependencies import RunServiceDep

router = APIRouter(tags=["health"])


class HealthPublic(BaseModel):
    """Whether the service is up, and how busy."""

    status: Literal["ok"]
    version: str
    kernel: Literal["ready", "compiling"]
    kernel_progress: float
    running: int
    waiting: int
    recovering: int = Field(
        description="runs that a killed service, or a full disk, left and that are still to be "
        "recovered"
    )


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
        recovering=len(service.recovering),
    )
