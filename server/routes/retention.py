"""Which runs go by the server's rules, or would go by others."""

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
    float | None, Query(ge=0, le=36_500, description="how long unmarked runs stay, in days")
]
_Count = Annotated[int | None, Query(ge=0, le=10**9, description="how many of them stay")]
_Bytes = Annotated[int | None, Query(ge=0, le=10**18, description="how many bytes of them stay")]


class RetentionRulesPublic(BaseModel):
    """Retention rules for runs without a name, a tag or notes."""

    keep_days: float | None
    keep_runs: int | None
    keep_bytes: int | None

    @classmethod
    def from_rules(cls, rules: Retention) -> Self:
        """The rules in force."""
        days = None if rules.max_age is None else rules.max_age / timedelta(days=1)
        return cls(keep_days=days, keep_runs=rules.max_runs, keep_bytes=rules.max_bytes)


class ExpiredRunPublic(BaseModel):
    """A run to be deleted."""

    id: str
    display_name: str
    created: str
    size: int = Field(description="bytes of its recording")
    rule: Rule = Field(description="by what it goes")

    @classmethod
    def from_expired(cls, expired: Expired) -> Self:
        """Its description."""
        run = expired.run
        return cls(
            id=run.id,
            display_name=run.display_name,
            created=run.created,
            size=run.size,
            rule=expired.rule,
        )


class RetentionPublic(BaseModel):
    """The rules, and the runs that they delete now, newest first."""

    rules: RetentionRulesPublic
    data: list[ExpiredRunPublic]
    count: int
    size: int = Field(description="bytes of their recordings together")


@router.get("/retention", responses=ProblemPublic.responses((422,)))
def read_retention(
    service: RetentionServiceDep,
    keep_days: _Days = None,
    keep_runs: _Count = None,
    keep_bytes: _Bytes = None,
) -> RetentionPublic:
    """The runs that the server deletes next, within an hour; this request deletes nothing.

    With parameters all that would go by other rules. The server's own are set when it is started;
    by them no more than a tenth of the folder goes at once.
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
