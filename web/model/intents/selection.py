"""Intents about the controls that are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import MaxLen

from slipgrasp.web.model.intents.intent import Intent, LatestIntent


@dataclass(frozen=True, slots=True)
class Select(Intent):
    """Selects a part of the scenario by its key, which is not validated yet."""

    part: Annotated[str, MaxLen(40)]


@dataclass(frozen=True, slots=True)
class FindParameters(LatestIntent):
    """Requests a search for parameters by their names, keys or units."""

    search: Annotated[str, MaxLen(80)]


@dataclass(frozen=True, slots=True)
class ToggleAllParameters(Intent):
    """Requests to show the controls of all parts, or only those of the selected part."""
