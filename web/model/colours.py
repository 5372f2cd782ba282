"""Colours of the dashboard: those common with figures, and those for the screen only."""

from __future__ import annotations

from slipgrasp.recordings.palette import Rgb

BELIEVED_CONE: Rgb = (150, 156, 168)
PUSH: Rgb = (176, 24, 40)
"""The arrow of a push."""
WAVES: Rgb = (236, 250, 255)
CONE_INSIDE: Rgb = (198, 207, 220)
_WHITE_ON_DARK = 0.35
_TONES: dict[str, Rgb] = {"good": (0, 120, 85), "warning": (178, 116, 0), "bad": (190, 40, 40)}


def glow(colour: Rgb) -> Rgb:
    """The colour for viser's lines and arrows, corrected to look like the given colour.

    Their vertex colours are linear, those of meshes and CSS are sRGB.
    """
    red, green, blue = (round(255.0 * _to_linear(channel / 255.0)) for channel in colour)
    return (red, green, blue)


def _to_linear(channel: float) -> float:
    return channel / 12.92 if channel <= 0.04045 else ((channel + 0.055) / 1.055) ** 2.4


def css(colour: Rgb, opacity: float = 1.0) -> str:
    """The colour as CSS, with an opacity from 0 to 1."""
    red, green, blue = colour
    return f"rgba({red},{green},{blue},{opacity:g})"


def legible(colour: Rgb, *, dark: bool) -> Rgb:
    """The colour for thin lines on a page: lighter on a dark page."""
    share = _WHITE_ON_DARK if dark else 0.0
    red, green, blue = (round(channel + share * (255 - channel)) for channel in colour)
    return (red, green, blue)


def sign(colour: Rgb) -> str:
    """The CSS colour of a small symbol or word on a light or dark page."""
    own = css(colour)
    return f"light-dark({own}, color-mix(in srgb, {own} 80%, white))"


def word(colour: Rgb) -> str:
    """The CSS colour of legible text on a light or dark page."""
    own = css(colour)
    return f"light-dark(color-mix(in srgb, {own} 65%, black), color-mix(in srgb, {own} 45%, white))"


def tone(name: str) -> str:
    """The CSS colour of text about ``good``, ``warning`` or ``bad`` outcomes."""
    return word(_TONES[name])
