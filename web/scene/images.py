"""Pictures that the scene is papered with: the background of a lens, and words.

Pictures are not lit, so their colours are the very ones of the palette, and words that are
pictures may have any colour; viser's own labels are always black in a white box.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from slipgrasp.recordings.palette import Rgb
from slipgrasp.web.scene.shapes import position

Pixels = NDArray[np.uint8]

_SIZE = 320
_HATCH_PERIOD = 16.0
_HATCH_DEPTH = 0.035
LETTERS = 44
"""Usual size of letters [px]."""
# Turns a picture, whose rows run down and which faces along z, upright in the model's plane.
_UPRIGHT = (2.0**-0.5, -(2.0**-0.5), 0.0, 0.0)


class SceneImage(NamedTuple):
    """A picture that stands in the model's plane: its pixels and its height [m]."""

    pixels: Pixels
    height: float

    @property
    def width(self) -> float:
        """Its width [m]."""
        rows, columns = self.pixels.shape[:2]
        return self.height * columns / rows


def add_image_in_plane(
    scene: viser.SceneApi, name: str, pane: SceneImage, centre: NDArray[np.float64], depth: float
) -> viser.ImageHandle:
    """Puts a picture into the model's plane, ``depth`` nearer to the eye [m]."""
    return scene.add_image(
        name,
        pane.pixels,
        pane.width,
        pane.height,
        format="png",
        cast_shadow=False,
        receive_shadow=False,
        wxyz=_UPRIGHT,
        position=position(centre, depth),
    )


@functools.lru_cache(maxsize=32)
def lens_background(normal: tuple[float, float], ground: Rgb, solid: Rgb) -> Pixels:
    """A disc, one half of which is hatched as a solid, shape ``(size, size, 4)``.

    Args:
        normal: Which half: unit vector into the solid.
        ground: Colour of the other half.
        solid: Colour of the solid.
    """
    steps = (np.arange(_SIZE) + 0.5) / _SIZE * 2.0 - 1.0
    x, y = steps[None, :], -steps[:, None]
    rim = (1.0 - np.hypot(x, y)) * 0.5 * _SIZE
    into = (normal[0] * x + normal[1] * y) * 0.5 * _SIZE
    stripes = (x + y) * 0.5 * _SIZE % _HATCH_PERIOD < 0.12 * _HATCH_PERIOD
    share = np.clip(into + 0.5, 0.0, 1.0)[..., None]
    hatched = np.array(solid) * (1.0 - _HATCH_DEPTH * stripes[..., None])
    colour = np.array(ground) * (1.0 - share) + hatched * share
    alpha = 255.0 * np.clip(rim, 0.0, 1.0)[..., None]
    return np.concatenate([colour, alpha], axis=-1).round().astype(np.uint8)


@functools.lru_cache(maxsize=8)
def round_patch(colour: Rgb) -> Pixels:
    """A disc of one colour, shape ``(size, size, 4)``."""
    steps = (np.arange(_SIZE) + 0.5) / _SIZE * 2.0 - 1.0
    rim = (1.0 - np.hypot(steps[None, :], steps[:, None])) * 0.5 * _SIZE
    alpha = 255.0 * np.clip(rim, 0.0, 1.0)[..., None]
    ink = np.broadcast_to(np.array(colour, dtype=float), (_SIZE, _SIZE, 3))
    return np.concatenate([ink, alpha], axis=-1).round().astype(np.uint8)


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    """Letters of a size; to load them takes longer than to draw a line."""
    font = ImageFont.load_default(size=size)
    assert isinstance(font, ImageFont.FreeTypeFont), "Pillow comes without FreeType"
    return font


@functools.lru_cache(maxsize=64)
def lettering(
    text: str, ink: Rgb, page: Rgb, *, size: int = LETTERS, width: int | None = None
) -> Pixels:
    """One line of words on nothing, shape ``(height, width, 4)``.

    Args:
        text: The words.
        ink: Colour of the letters.
        page: Colour around them, so that they are legible on whatever is behind them.
        size: Size of the letters [px].
        width: Width of the picture with the words in its middle, None for that of the words [px].
    """
    font = _font(size)
    around = max(size // 10, 1)
    if width is None:
        width = int(font.getlength(text)) + 2 * around + 4
    picture = Image.new("RGBA", (width, int(1.5 * size)), (*page, 0))
    pen, x, y = ImageDraw.Draw(picture), 0.5 * width, 0.15 * size
    pen.text((x, y), text, font=font, fill=(*page, 255), anchor="ma", stroke_width=around)
    # Twice, a pixel apart: seen from afar thin strokes fade into what is around them.
    for shift in (-0.5, 0.5):
        pen.text((x + shift, y), text, font=font, fill=(*ink, 255), anchor="ma")
    return np.asarray(picture)
