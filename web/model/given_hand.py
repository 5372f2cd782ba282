"""The hand with which the dashboard was started."""

from __future__ import annotations

from typing import NamedTuple

from slipgrasp.core.scenario.hand_files.meshes import HandMeshes
from slipgrasp.web.model.draft import Draft


class GivenHand(NamedTuple):
    """A hand from files, whose names are not stored.

    Attributes:
        draft: The scenario of new sessions; None for the first preset.
        meshes: Meshes of its links; None if it has none.
    """

    draft: Draft | None = None
    meshes: HandMeshes | None = None


NO_HAND = GivenHand()
"""The dashboard without a hand."""
