"""A stored run."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from slipgrasp.core.words.display_name import file_stem
from slipgrasp.recordings.store.annotations import Annotations
from slipgrasp.recordings.store.description import MEASURED

_REVISION_BYTES = 12


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredRun:
    """A stored run.

    Attributes:
        id: Its id, twelve letters and digits.
        path: Path of its recording.
        created: Time at which it was saved, ISO 8601 in UTC.
        title: Title of its scenario, or why its recording cannot be read.
        summary: The run without its trace (`RunResult.summary`); empty if it cannot be read.
        name: Name from a user.
        notes: Notes from a user.
        tags: Tags for searches.
        preset: The preset with the title of its scenario; empty if there is none.
        controller: Kind of its controller.
        size: Size of its recording [bytes].
    """

    id: str
    path: Path
    created: str
    title: str
    summary: dict[str, Any]
    name: str = ""
    notes: str = ""
    tags: tuple[str, ...] = ()
    preset: str = ""
    controller: str = ""
    size: int = 0

    @property
    def is_measured(self) -> bool:
        """Whether it contains measured data instead of a run."""
        return self.controller == MEASURED

    @property
    def display_name(self) -> str:
        """Display name: the user's name, else the preset with the differences, else the id."""
        return self.name or self.summary.get("name", "") or self.id

    def file_name(self, ending: str) -> str:
        """Name of an exported file, such as ``paper-case-2-mass-1.4-kg-ID.csv``.

        Args:
            ending: Suffix of the file, without the dot.
        """
        stem = "" if not self.summary else file_stem(self.display_name)
        return "-".join(filter(None, (stem, self.id))) + f".{ending}"

    @property
    def annotations(self) -> Annotations:
        """Annotations by users."""
        return Annotations(name=self.name, notes=self.notes, tags=self.tags)

    @property
    def revision(self) -> str:
        """An entity tag that changes with the description of the run."""
        told = json.dumps(self.told(), sort_keys=True).encode()
        return hashlib.blake2b(told, digest_size=_REVISION_BYTES).hexdigest()

    def told(self) -> dict[str, Any]:
        """Description of the run as plain values for JSON: everything except id and path."""
        names = (field.name for field in fields(self) if field.name not in ("id", "path"))
        return {name: getattr(self, name) for name in names}
