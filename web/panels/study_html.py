"""What stands around the map of a study, as HTML: what it costs, how far it is, what came of it."""

from __future__ import annotations

from html import escape

from slipgrasp.recordings.study.ways import HELD
from slipgrasp.server.runs.schemas import API_PATH
from slipgrasp.server.studies.live_study import StudyState
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.study import Followed, StudyView
from slipgrasp.web.model.study_map import MapPicture
from slipgrasp.web.model.study_words import number_words, progress_words, share_words, time_words
from slipgrasp.web.panels.outcome_panel import box_html

_MOST_REASONS = 3
_SMALL = "font-size:0.8em;opacity:0.8"


def draft_html(study: StudyView) -> str:
    """What the planned study costs, or why it cannot run."""
    if study.draft is None:
        return ""
    runs = number_words(study.draft.num_runs, "run")
    if study.is_starting:
        text = f"<b>{runs}</b>: being checked …"
    elif study.price is not None:
        text = f"<b>{runs}</b>, {time_words(study.price.seconds)} of computing."
    else:
        text = f"<b>{runs}</b>"
    warnings = study.price.warnings if study.price is not None else ()
    boxes = [box_html("Not run", [escape(f"{m}.") for m in study.problems])] * bool(study.problems)
    boxes += [box_html("Mind", [escape(f"{w}.") for w in warnings])] * bool(warnings)
    boxes += [box_html("Not opened", [escape(study.message)])] * bool(study.message)
    return f"<div style='padding:0.4em 0.75em;font-size:0.85em'>{''.join(boxes)}{text}</div>"


def summary_html(followed: Followed, opening: int | None = None, wrong: str = "") -> str:
    """What a study is about, how far it is, and what came of it so far.

    Args:
        followed: The study.
        opening: The run of it that is being opened, if any.
        wrong: Why a run of it, or another study, could not be opened; empty if nothing was.
    """
    status = followed.status
    title = escape(status.stored.title or "Study without a title")
    lines = [f"<b>{title}</b>", f"<div style='{_SMALL}'>{_state_words(followed)}</div>"]
    if followed.picture is not None and followed.picture.finished:
        lines.append(_held_html(followed.picture))
    elif not followed.has_map:
        lines.append("<div>It varies no two parameters in numbers, so there is no map of it.</div>")
    if opening is not None:
        lines.append(f"<div>Simulating run {opening} again …</div>")
    if wrong:
        lines.append(box_html("Not opened", [escape(wrong)]))
    return f"<div style='padding:0.4em 0.75em 0;font-size:0.85em'>{''.join(lines)}</div>"


def _state_words(followed: Followed) -> str:
    words = escape(progress_words(followed.status, followed.behind))
    message = followed.status.message
    return f"{words} {escape(message)}" if message else words


def _held_html(picture: MapPicture) -> str:
    """How many held, and what ended most of the others."""
    so_far = "" if picture.finished == picture.study.num_runs else " so far"
    held = (
        f"<div style='font-size:1.15em;font-weight:700;color:{tone('good')};margin-top:0.25em'>"
        f"Held {picture.held} of {picture.finished}{so_far} "
        f"({share_words(picture.held, picture.finished)})</div>"
    )
    others = sorted((s for s in picture.swatches if s.way != HELD), key=lambda s: -s.count)
    if not others:
        return held
    reasons = "; ".join(f"{escape(s.words)}: {s.count}" for s in others[:_MOST_REASONS])
    more = "; …" if len(others) > _MOST_REASONS else ""
    return f"{held}<div>The others: {reasons}{more}.</div>"


def links_html(followed: Followed) -> str:
    """The results as files."""
    study = f"{API_PATH}/studies/{escape(followed.study_id)}"
    links = [("results.csv", "CSV"), ("results.json", "JSON")]
    if followed.picture is not None:
        links = [("map.svg", "map as SVG"), ("map.png", "as PNG"), *links]
    if followed.status.state in (StudyState.COMPLETED, StudyState.CANCELLED):
        links.append(("recording", "MCAP"))
    anchors = ", ".join(f"<a href='{study}/{end}' download>{name}</a>" for end, name in links)
    return f"<div style='padding:0.4em 0.75em;{_SMALL}'>Download: {anchors}</div>"
