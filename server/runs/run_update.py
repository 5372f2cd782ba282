"""What the REST interface takes to change what is written about a run."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.recordings.store.annotations import MAX_TAGS, RunName, RunNotes, RunTag


class RunUpdate(BaseModel):
    """What is left out stays as it is."""

    model_config = ConfigDict(
        extra="forbid",
        json_schema_extra={
            "example": {"name": "heavier object", "notes": "For the report.", "tags": ["report"]}
        },
    )

    name: Annotated[RunName, Field(description="at most 200 printable characters")] = ""
    notes: Annotated[RunNotes, Field(description="at most 10 000 characters, in lines")] = ""
    tags: Annotated[
        list[RunTag],
        Field(max_length=MAX_TAGS, description="at most 32 of at most 64 printable characters"),
    ] = []

    def changes(self) -> dict[str, Any]:
        """What was given, by name."""
        return {name: getattr(self, name) for name in self.model_fields_set}
