"""Runs that the server's retention rules, or other rules, delete."""

from __future__ import annotations

from datetime import timedelta
from typing import Annotated, Self

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from slipgrasp.recordings.study.retention import Expired, Retention, Rule
from slipgrasp.server.dependencies import RetentionServiceDep
from slipgrasp.server.http.errors import ProblemPublic

router = APIRouter(tags=["runs"])

_Days = Annotated[
    float | None, Query(ge=0, le=36_500, description="retention time of unmarked runs, in days")
]
_Count = Annotated[int | None, Query(ge=0, le=10**9, description="number of retained ones")]
_Bytes = Annotated[
    int | None, Query(ge=0, le=10**18, description="total size of retained ones, in bytes")
]


class RetentionRulesPublic(BaseModel):
    """Retention rules for runs without a name, a tag or notes."""

    keep_days: float | None
    keep_runs: int | None
    keep_bytes: int | None

    @classmethod
    def from_rules(cls, rules: Retention) -> Self:
        """The active rules."""
        days = None if rules.max_age is None else rules.max_age / timedelta(days=1)
        return cls(keep_days=days, keep_runs=rules.max_runs, keep_bytes=rules.max_bytes)


class ExpiredRunPublic(BaseModel):
    """A run to be deleted."""

    id: str
    display_name: str
    created: str
    size: int = Field(description="size of its recording, in bytes")
    rule: Rule = Field(description="rule by which it is deleted")

    @classmethod
    def from_expired(cls, expired: Expired) -> Self:
        """Description of the run."""
        run = expired.run
        return cls(
            id=run.id,
            display_name=run.display_name,
            created=run.created,
            size=run.size,
            rule=expired.rule,
        )


class RetentionPublic(BaseModel):
    """The rules, and the runs that they delete next, newest first."""

    rules: RetentionRulesPublic
    data: list[ExpiredRunPublic]
    count: int
    size: int = Field(description="total size of their recordings, in bytes")


@router.get("/retention", responses=ProblemPublic.responses((422,)))
def read_retention(
    service: RetentionServiceDep,
    keep_days: _Days = None,
    keep_runs: _Count = None,
    keep_bytes: _Bytes = None,
) -> RetentionPublic:
    """The runs that the server deletes next, within an hour; this request deletes nothing.

    With parameters, all runs that other rules would delete. The server's rules are set at its
    start; at the start, and later by age, they delete at most a tenth of the folder at a time.
    """
    asked = Retention(
        max_age=None if keep_days is None else timedelta(days=keep_days),
        max_runs=keep_runs,
        max_bytes=keep_bytes,
    )
    rules = service.retention if asked.keeps_all else asked
    expired = service.next_to_go() if asked.keeps_all else service.expired(asked)
    data = [ExpiredRunPublic.from_expired(each) for each in expired]
    return RetentionPublic(
        rules=RetentionRulesPublic.from_rules(rules),
        data=data,
        count=len(data),
        size=sum(each.size for each in data),
    )
