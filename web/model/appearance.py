"""Appearance of the view: light or dark, and optional elements."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

LEAST_FORCE_SCALE, LARGEST_FORCE_SCALE = 0.5, 4.0


@dataclass(frozen=True, slots=True)
class Appearance:
    """Display options of a user.

    Attributes:
        dark: Whether page and scene are dark.
        force_scale: Scale of the arrows of forces, 0.5 to 4.
        cones: Whether friction cones are drawn.
        lenses: Whether close-ups of the contacts are shown.
        whole_hand: Whether the view includes the mounts of the fingers.
        lecture: Whether the page shows only the view, the timeline and one chart, in large type.
    """

    dark: bool = False
    force_scale: float = 1.0
    cones: bool = True
    lenses: bool = True
    whole_hand: bool = False
    lecture: bool = False

    def within_bounds(self) -> Appearance:
        """Returns the appearance with a valid force scale; the value comes from a browser."""
        if not math.isfinite(self.force_scale):
            return replace(self, force_scale=1.0)
        scale = min(max(self.force_scale, LEAST_FORCE_SCALE), LARGEST_FORCE_SCALE)
        return replace(self, force_scale=scale)
