"""State and load of the service."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field

from slipgrasp.core.run.provenance import program_version
from slipgrasp.server.dependencies import RunServiceDep
from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.http.errors import ProblemPublic

router = APIRouter(tags=["health"])


class HealthPublic(BaseModel):
    """The status and the load of the service."""

    status: Literal["ok"]
    version: str
    kernel: Literal["ready", "compiling"]
    kernel_progress: float
    kernel_seconds_left: float | None = Field(
        description="estimated remaining time of compilation [s]; null if unknown"
    )
    running: int
    waiting: int
    recovering: int = Field(
        description="interrupted runs of a killed service, or after a full disk, that are not "
        "recovered yet"
    )


class ReadyPublic(BaseModel):
    """The service accepts runs."""

    status: Literal["ready"]
    recovering: int = Field(
        description="runs of a killed service that are still being recovered; new ones are "
        "accepted meanwhile, and studies start afterwards"
    )


@router.get("/health")
async def read_health(service: RunServiceDep) -> HealthPublic:
    """Responds while the service runs, with its load."""
    load, (share, seconds_left) = service.load, service.preparation.look()
    return HealthPublic(
        status="ok",
        version=program_version(),
        kernel="ready" if service.kernel_is_ready else "compiling",
        kernel_progress=share,
        kernel_seconds_left=seconds_left,
        running=load.running,
        waiting=load.waiting,
        recovering=len(service.recovering),
    )


@router.get("/ready", responses=ProblemPublic.responses((503,)))
def read_ready(service: RunServiceDep) -> ReadyPublic:
    """Responds with 200 if the service can accept and store a run, else 503 with the reasons.

    It writes some bytes into the data folder as a test.
    """
    if obstacles := service.obstacles():
        raise ServiceBusyError(f"the service is not ready: {'; '.join(obstacles)}")
    return ReadyPublic(status="ready", recovering=len(service.recovering))
