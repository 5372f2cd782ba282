"""The map of a study as HTML, styled by ``web/page/study.css``."""

from __future__ import annotations

from html import escape

import numpy as np

from slipgrasp.core.trace.types import Outcome
from slipgrasp.figures.map_data import MapAxis
from slipgrasp.figures.map_labels import same_quantity
from slipgrasp.recordings.palette import HELD as HELD_COLOUR
from slipgrasp.recordings.palette import MARK, OUTCOMES
from slipgrasp.recordings.study.categories import CATEGORIES, HELD, category_words
from slipgrasp.web.model.colours import css
from slipgrasp.web.model.study_map import SIZE, Box, MapPanelPicture, MapPicture, locate
from slipgrasp.web.model.study_words import share_words
from slipgrasp.web.model.ticks import ticks_of

_HATCH = 26

# Strokes distinguish kinds of failure without colours, as in the figures.
_STROKES: dict[Outcome, str] = {
    Outcome.LEFT_FACE: "M-2 28L28 -2",
    Outcome.SEPARATED: "M11 13H15",
    Outcome.CHATTERING: "M-2 28L28 -2M-2 -2L28 28",
    Outcome.INCONSISTENT: "M13 0V26M0 13H26",
    Outcome.DIVERGED: "M-2 -2L28 28",
    Outcome.SINGULAR: "M8 13a5 5 0 1 0 10 0a5 5 0 1 0 -10 0",
    Outcome.LIMIT: "M13 0V26",
    Outcome.STOPPED: "M0 13H26",
    Outcome.RECOVERED: "M0 13H26",
    Outcome.FAILED: "M8 8L18 18M18 8L8 18",
}
_STROKES_BY_REASON = {
    "painleve": "M0 13H26",
    "step_underflow": "M13 0V26",
    "short_run": "M0 13H26",
    "past_limit": "M13 0V26",
    "joint_limit": "M8 8H18V18H8Z",
}


def map_html(picture: MapPicture, ringed: int | None) -> str:
    """The map with its key.

    Args:
        picture: The map.
        ringed: The run on the screen, marked on the map; None if it belongs to another study.
    """
    place = None if ringed is None else locate(picture, ringed)
    panels = "".join(
        _panel_html(picture, panel, _ring(place[1]) if place and place[0] == number else "")
        for number, panel in enumerate(picture.panels)
    )
    notes = f"<div class='sg-map-note'>{' '.join(_notes(picture))}</div>"
    key = _key_html(picture)
    return (
        f"<div class='sg-map'><svg style='position:absolute;width:0;height:0'>"
        f"<defs>{_patterns(picture)}</defs></svg>"
        f"<div class='sg-map-panels'>{panels}</div>{key}{notes}</div>"
    )


def _notes(picture: MapPicture) -> list[str]:
    notes = ["Click a cell to open its run, or hover over it to read its values."]
    if picture.across.edges is None or picture.up.edges is None:
        notes = ["Click a point to open its run, or hover over it to read its values."]
    if picture.lumped > 1:
        notes.append(
            f"A cell represents {picture.lumped} × {picture.lumped} runs and shows their most "
            "frequent outcome."
        )
    if _base(picture):
        notes.append("The white dot marks the base scenario.")
    return [*notes, escape(picture.note)] if picture.note else notes


def _panel_html(picture: MapPicture, panel: MapPanelPicture, ring: str) -> str:
    title = ""
    if panel.title:
        held = category_words(HELD, picture.study.base.space)
        shown = (
            f"{held} {panel.held} of {panel.finished} ({share_words(panel.held, panel.finished)})"
        )
        title = f"<div style='margin-bottom:0.3em'><b>{escape(panel.title)}</b><br>{shown}</div>"
    frame = f"<rect class='sg-map-frame' width='{SIZE}' height='{SIZE}'/>"
    marks = f"{frame}{_grid(picture)}{panel.marks}{_diagonal(picture)}{_base(picture)}{ring}"
    across, up = map(escape, picture.labels)
    label = f"{escape(panel.title)} {across} and {up}".strip()
    return (
        f"<div class='sg-map-panel'>{title}<div class='sg-map-body'>"
        f"<div class='sg-map-up'>{up}</div>"
        f"<div class='sg-map-ticks sg-map-ticks-up'>{_ticks(picture.up, 'bottom')}</div>"
        f"<svg viewBox='0 0 {SIZE} {SIZE}' role='img' aria-label='{label}'>{marks}</svg>"
        "<div></div><div></div>"
        f"<div class='sg-map-ticks sg-map-ticks-across'>{_ticks(picture.across, 'left')}</div>"
        f"<div></div><div></div><div class='sg-map-across'>{across}</div>"
        "</div></div>"
    )


def _ticks_of(axis: MapAxis) -> list[tuple[float, float]]:
    """Positions and values of ticks."""
    values = ticks_of(axis.low, axis.high, is_log=axis.is_log)
    return list(zip(axis.share(np.array(values)).tolist(), values, strict=True))


def _ticks(axis: MapAxis, side: str) -> str:
    return "".join(
        f"<span style='{side}:{100 * share:.2f}%'>{value:.6g}</span>"
        for share, value in _ticks_of(axis)
    )


def _grid(picture: MapPicture) -> str:
    """Ticks outside the frame."""
    lines = [f"M{SIZE * share:.1f} {SIZE}v12" for share, _ in _ticks_of(picture.across)]
    lines += [f"M0 {SIZE * (1.0 - share):.1f}h-12" for share, _ in _ticks_of(picture.up)]
    return f"<path class='sg-map-lines' d='{''.join(lines)}'/>"


def _diagonal(picture: MapPicture) -> str:
    """The line of equal values, if both axes are comparable."""
    x, y = picture.across, picture.up
    low, high = max(x.low, y.low), min(x.high, y.high)
    if not same_quantity(x.key, y.key) or x.is_log != y.is_log or low >= high:
        return ""
    (x0, x1), (y0, y1) = (axis.share(np.array([low, high])).tolist() for axis in (x, y))
    ends = f"M{SIZE * x0:.1f} {SIZE * (1 - y0):.1f}L{SIZE * x1:.1f} {SIZE * (1 - y1):.1f}"
    return f"<path class='sg-map-over sg-map-diagonal' d='{ends}'/>"


def _base(picture: MapPicture) -> str:
    """The mark of the base; empty if it is outside the map."""
    if picture.across.base is None or picture.up.base is None:
        return ""
    x = SIZE * picture.across.share(np.array(picture.across.base))
    y = SIZE * (1.0 - picture.up.share(np.array(picture.up.base)))
    # Lines of zero length with round ends have the same size on every map.
    return "".join(
        f"<path class='sg-map-over' d='M{x:.1f} {y:.1f}h0' stroke='{colour}' "
        f"stroke-width='{width}' stroke-linecap='round'/>"
        for colour, width in ((css(MARK), 12), ("white", 7))
    )


def _ring(box: Box) -> str:
    """A frame around the run on the screen, visible on every colour."""
    left, right, low, high = box
    x, y = SIZE * left, SIZE * (1.0 - high)
    width, height = SIZE * (right - left), SIZE * (high - low)
    if not width or not height:
        x, y, width, height = x - 18, y - 18, 36, 36
    place = f"x='{x:.1f}' y='{y:.1f}' width='{width:.1f}' height='{height:.1f}' rx='4'"
    return (
        f"<rect class='sg-map-over' {place} stroke='white' stroke-width='6'/>"
        f"<rect class='sg-map-over sg-map-ring' {place} stroke='{css(MARK)}' stroke-width='3'/>"
    )


def _patterns(picture: MapPicture) -> str:
    return "".join(map(_pattern, picture.counts))


def _pattern(way: int) -> str:
    what = CATEGORIES[way]
    colour = css(HELD_COLOUR if way == HELD else OUTCOMES[what.outcome])
    strokes = _STROKES_BY_REASON.get(what.reason, _STROKES.get(what.outcome, ""))
    style = f"stroke='{css(MARK, 0.28)}' stroke-width='3' fill='none'"
    lines = "" if way == HELD else f"<path d='{strokes}' {style}/>"
    size = f"width='{_HATCH}' height='{_HATCH}'"
    return (
        f"<pattern id='sg-way-{way}' {size} patternUnits='userSpaceOnUse'>"
        f"<rect {size} fill='{colour}'/>{lines}</pattern>"
    )


def _key_html(picture: MapPicture) -> str:
    lines = "".join(_key_line(picture, way) for way in picture.counts)
    return f"<div class='sg-map-key'>{lines}</div>"


def _key_line(picture: MapPicture, way: int) -> str:
    count = picture.counts[way]
    return (
        "<span><svg viewBox='0 0 60 34' preserveAspectRatio='none'>"
        f"<rect width='60' height='34' rx='5' fill='url(#sg-way-{way})'/></svg></span>"
        f"<span>{escape(category_words(way, picture.study.base.space))}</span>"
        f"<span>{count}</span><span>{share_words(count, picture.finished)}</span>"
    )
