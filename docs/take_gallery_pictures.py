"""`python -m docs.take_gallery_pictures [PRESET …]`: the images of docs/gallery.md, during slip."""

from __future__ import annotations

import io
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from slipgrasp import load_scenario, preset_names, simulate
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import SPATIAL
from slipgrasp.figures.still import write_png
from slipgrasp.recordings.still import Still

FOLDER = Path(__file__).parent / "images" / "gallery"
WIDTH, HEIGHT = 800, 450
HAND = (0, 28, WIDTH, 278)  # without the title above it and the chart below
COLOURS = 48


def main(names: Sequence[str]) -> None:
    """Draws some presets, or all of them."""
    for name in names or (*preset_names(), *preset_names(SPATIAL)):
        result, stream = simulate(load_scenario(name)), io.BytesIO()
        still = Still(time=time_of_slip(result), width=WIDTH, height=HEIGHT)
        write_png(result, stream, still)
        picture = Image.open(stream).convert("RGB").crop(HAND)
        picture = picture.quantize(COLOURS, dither=Image.Dither.NONE)
        picture.save(FOLDER / f"{name}.png", optimize=True)


def time_of_slip(result: RunResult) -> float:
    """Time at which a fingertip has first slipped half of the largest slip [s]."""
    slip = np.abs(result.trace.slip).max(axis=1)
    return float(result.trace.times[int(np.argmax(slip >= 0.5 * slip.max()))])


if __name__ == "__main__":
    main(sys.argv[1:])
