"""The success map of a page: the dashboard's map of a study without runs, for each two sliders."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np

from slipgrasp.core.run.metrics import HOLD_WINDOW
from slipgrasp.core.words.endings import end_words
from slipgrasp.recordings.study.categories import (
    CATEGORIES,
    HELD,
    NOT_HELD,
    TOO_SHORT,
    category_of,
)
from slipgrasp.web.model.study_map import SIZE, MapAxisPicture, MapPanelPicture, MapPicture, Swatch
from slipgrasp.web.model.ticks import ticks_of
from slipgrasp.web.panels.map_html import map_html
from slipgrasp.web.standalone.controls import Control

_CELLS = "<g data-sg-cells></g>"
_SIDES = (10, 25, 50)


def map_data(controls: Sequence[Control]) -> dict[str, Any]:
    """What the page shows before runs are there, and what it calls their ends.

    Args:
        controls: The sliders, of which two are the axes.
    """
    by_status = {status: category_of(end.outcome, end.code) for status, end in end_words().items()}
    places = sorted({HELD, NOT_HELD, TOO_SHORT, *by_status.values()})
    return {
        "templates": {
            f"{across.key} {up.key}": _template(across, up, places)
            for across, up in permutations(controls, 2)
        },
        "size": SIZE,
        "sides": _SIDES,
        "categories": {
            "byStatus": by_status,
            "held": HELD,
            "notHeld": NOT_HELD,
            "tooShort": TOO_SHORT,
            "window": HOLD_WINDOW,
        },
        "words": [category.words for category in CATEGORIES],
        "places": places,
    }


def _template(across: Control, up: Control, places: Sequence[int]) -> str:
    """The map as HTML, with all ways in which runs can end in its key."""
    picture = MapPicture(
        study=None,
        finished=0,
        held=0,
        across=_axis(across),
        up=_axis(up),
        panels=(MapPanelPicture({}, "", _CELLS, 0, 0),),
        swatches=tuple(Swatch(place, CATEGORIES[place].words, 0) for place in places),
        base=(_axis(across).share(across.value), _axis(up).share(up.value)),
        diagonal=None,
        lumped=1,
        note="",
    )
    return map_html(picture, None)


def _axis(control: Control) -> MapAxisPicture:
    low, high = control.low, control.high
    ticks = [(value, f"{value:.6g}") for value in ticks_of(low, high, is_log=False)]
    return MapAxisPicture(
        key=control.key,
        label=control.label,
        low=low,
        high=high,
        is_log=False,
        borders=tuple(np.linspace(0.0, 1.0, _SIDES[-1] + 1).tolist()),
        ticks=tuple(((value - low) / (high - low), text) for value, text in ticks),
    )
