"""The page around the scene: its colours, bright or dark."""

from __future__ import annotations

import viser

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES, Rgb

_BRIGHT_BRAND: Rgb = PHASES[ContactPhase.STICK]
_DARK_BRAND: Rgb = (92, 168, 236)


def apply_theme(gui: viser.GuiApi, *, dark: bool) -> None:
    """Makes a page bright or dark; what one may click has a colour that is legible there."""
    gui.configure_theme(
        show_logo=False,
        show_share_button=False,
        dark_mode=dark,
        brand_color=_DARK_BRAND if dark else _BRIGHT_BRAND,
    )
