"""Intents about the controls that are shown."""

from __future__ import annotations

from typing import Annotated

from annotated_types import MaxLen

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent, LatestIntent


class Select(Intent, right=Right.READ):
    """Selects a part of the scenario by its key, which is not validated yet."""

    part: Annotated[str, MaxLen(40)]


class FindParameters(LatestIntent, right=Right.READ):
    """Requests a search for parameters by their names, keys or units."""

    search: Annotated[str, MaxLen(80)]


class ToggleAllParameters(Intent, right=Right.READ):
    """Requests to show the controls of all parts, or only those of the selected part."""
