"""How the picture looks: light or dark, and what is drawn in it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

LEAST_FORCE_SCALE, LARGEST_FORCE_SCALE = 0.5, 4.0


@dataclass(frozen=True, slots=True)
class Appearance:
    """What one user wants to see.

    Attributes:
        dark: Whether page and scene are dark.
        force_scale: How much longer than usual the arrows of forces are, 0.5 to 4.
        cones: Whether friction cones are drawn.
        lenses: Whether the contacts are shown magnified.
        whole_hand: Whether the fingers are seen as far as their mounts, and the object small.
        lecture: Whether the page has the picture, the strip and one chart alone, in large type.
    """

    dark: bool = False
    force_scale: float = 1.0
    cones: bool = True
    lenses: bool = True
    whole_hand: bool = False
    lecture: bool = False

    def within_bounds(self) -> Appearance:
        """This appearance with a force scale that can be drawn; it comes from a browser."""
        if not math.isfinite(self.force_scale):
            return replace(self, force_scale=1.0)
        scale = min(max(self.force_scale, LEAST_FORCE_SCALE), LARGEST_FORCE_SCALE)
        return replace(self, force_scale=scale)
