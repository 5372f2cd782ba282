"""Success map of a page: the study map of the dashboard without runs, per pair of sliders."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np

from slipgrasp.core.run.metrics import HOLD_WINDOW
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.study.definition import Sampling, Study
from slipgrasp.core.words.endings import end_words
from slipgrasp.figures.map_data import MapAxis
from slipgrasp.recordings.study.categories import (
    CATEGORIES,
    HELD,
    NOT_HELD,
    TOO_SHORT,
    category_of,
)
from slipgrasp.web.model.study_map import SIZE, MapPanelPicture, MapPicture
from slipgrasp.web.panels.map_html import map_html
from slipgrasp.web.standalone.controls import Control

_CELLS = "<g data-sg-cells></g>"
_SIDES = (10, 25, 50)


def map_data(scenario: Scenario, controls: Sequence[Control]) -> dict[str, Any]:
    """Returns the empty maps, and the categories of outcomes.

    Args:
        scenario: Scenario of the page.
        controls: Sliders of the page; each pair gives the axes of a map.
    """
    by_status = {status: category_of(end.outcome, end.code) for status, end in end_words().items()}
    places = sorted({HELD, NOT_HELD, TOO_SHORT, *by_status.values()})
    study = Study(base=scenario, sampling=Sampling(method="list"))
    return {
        "templates": {
            f"{across.key} {up.key}": _template(study, across, up, places)
            for across, up in permutations(controls, 2)
        },
        "size": SIZE,
        "sides": _SIDES,
        "categories": {
            "byStatus": by_status,
            "held": HELD,
            "settling": NOT_HELD,
            "slipping": NOT_HELD,
            "tooShort": TOO_SHORT,
            "window": HOLD_WINDOW,
        },
        "words": [category.words for category in CATEGORIES],
        "places": places,
    }


def _template(study: Study, across: Control, up: Control, places: Sequence[int]) -> str:
    """The map as HTML, with all categories of outcomes in its legend."""
    picture = MapPicture(
        study=study,
        across=_axis(across),
        up=_axis(up),
        labels=(across.label, up.label),
        panels=(MapPanelPicture({}, "", _CELLS, 0, 0),),
        counts=dict.fromkeys(places, 0),
        lumped=1,
        note="",
    )
    return map_html(picture, None)


def _axis(control: Control) -> MapAxis:
    edges = np.linspace(control.low, control.high, _SIDES[-1] + 1)
    return MapAxis(control.key, control.low, control.high, False, edges, control.value)
