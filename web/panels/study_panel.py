"""The study panel: plan a study, follow its progress, and open its runs."""

from __future__ import annotations

from collections.abc import Callable
from html import escape

import viser

from slipgrasp.core.study.knowledge import describe_knowledge_in
from slipgrasp.recordings.study.categories import HELD, category_words
from slipgrasp.server.addresses import API_PATH, from_page
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.study import (
    CancelStudy,
    ListStudies,
    OpenStudy,
    ResumeStudy,
    SeeStudyDraft,
    ShowStudyDraft,
    SizeMap,
    StartStudy,
)
from slipgrasp.web.model.study import Followed, StudyView
from slipgrasp.web.model.study_map import MapPicture
from slipgrasp.web.model.study_words import (
    list_label,
    number_words,
    progress_words,
    share_words,
    time_words,
)
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.page.markup import visible_attribute
from slipgrasp.web.panels.map_html import map_html
from slipgrasp.web.panels.outcome_panel import box_html
from slipgrasp.web.panels.study_inputs import DraftInputs, StudyRunInputs

_NEW, _WIDER, _NARROWER = "new study", "wider", "narrower"
_NO_STUDY = "choose …"
_NONE: tuple[str, ...] = (_NO_STUDY,)
_INTRO = (
    f"<div {visible_attribute(SeeStudyDraft)} style='padding:0.5em 0.75em 0;font-size:0.85em'>"
    "Vary two parameters of the scenario, and map the outcomes: one run for every pair of values."
    "</div>"
)

_MOST_REASONS = 3
_SMALL = "font-size:0.8em;opacity:0.8"


class StudyPanel:
    """Shows either the draft of the next study or the map of one.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
        widen: Changes the width of the panel.

    Attributes:
        draft: The draft of the next study.
        map: The study on the map.
        known: The stored studies.
    """

    def __init__(self, gui: viser.GuiApi, send: Send, widen: Callable[[bool], None]) -> None:
        self._send, self._widen = send, widen
        self.draft = _DraftPart(gui, send)
        self.map = _MapPart(gui, send)
        self.known = _KnownStudies(gui, send)
        self._shown: StudyView | None = None
        self._ringed: int | None = None

    def update(self, view: ViewState) -> None:
        """Shows the draft, or the progress of the study; ``view`` is the state of the screen."""
        study, ringed = view.study, _ringed(view)
        if study is self._shown and ringed == self._ringed:
            return
        is_wide = study.is_wide and not study.is_draft_shown
        before = self._shown
        if before is None or is_wide != (before.is_wide and not before.is_draft_shown):
            self._widen(is_wide)
        self.draft.show(study)
        self.map.show(study, ringed)
        self.known.show(study)
        self._shown, self._ringed = study, ringed

    def remove(self) -> None:
        """Removes all widgets."""
        for part in (self.draft, self.map, self.known):
            part.remove()


def _ringed(view: ViewState) -> int | None:
    """The run of the study that is on the screen, if any."""
    study_run, replay = view.study.study_run, view.shown.replay if view.shown else None
    if study_run is None or replay is None or not study_run.run_id:
        return None
    return study_run.index if replay.run_id == study_run.run_id else None


class _DraftPart:
    """The draft of the next study, its cost, and the button that starts it.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._intro = gui.add_html(_INTRO)
        self.inputs_folder = gui.add_folder("What varies")
        with self.inputs_folder:
            self.inputs = DraftInputs(gui, send)
        self.price = gui.add_html("")
        self.run = gui.add_button(
            "Run the study",
            icon=viser.Icon.PLAYER_PLAY,
            hint="Simulates every pair of values; the results are stored.",
        )
        self.back = gui.add_button(
            "Back to the map",
            icon=viser.Icon.ARROW_BACK_UP,
            color="gray",
            hint="Shows the study that was on the screen before.",
        )
        self.run.on_click(lambda _: send(StartStudy()))
        self.back.on_click(lambda _: send(ShowStudyDraft(False)))

    def show(self, study: StudyView) -> None:
        """Shows the draft, or hides it while a map is shown."""
        is_shown = study.is_draft_shown
        for element in (self._intro, self.inputs_folder, self.price, self.run):
            element.visible = is_shown
        self.back.visible = is_shown and study.followed is not None
        if is_shown:
            self.inputs.show(study)
            self.price.content = draft_html(study)
            self.run.disabled = study.is_starting or study.draft is None

    def remove(self) -> None:
        """Removes all widgets."""
        for element in (self._intro, self.inputs, self.inputs_folder, self.price):
            element.remove()
        self.run.remove()
        self.back.remove()


class _MapPart:
    """A study: its progress, its map, and its actions.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self.tools = gui.add_button_group(
            "map",
            (_NEW, _WIDER, _NARROWER),
            hint="Plans another study, or makes the map wider or narrower.",
        )
        self.summary = gui.add_html("")
        self.bar = gui.add_progress_bar(0.0)
        self.cancel = gui.add_button(
            "Cancel the study",
            icon=viser.Icon.X,
            color="gray",
            hint="Stops the study; finished runs are stored.",
        )
        self.resume = gui.add_button(
            "Continue the study",
            icon=viser.Icon.PLAYER_PLAY,
            hint="Simulates the missing runs; finished runs are not repeated.",
        )
        self.map = gui.add_html("")
        self.study_run = StudyRunInputs(gui, send)
        self.links = gui.add_html("")
        self.tools.on_click(self._use)
        self.cancel.on_click(lambda _: send(CancelStudy()))
        self.resume.on_click(lambda _: send(ResumeStudy()))
        self._drawn: tuple[object, int | None] = (None, None)

    def show(self, study: StudyView, ringed: int | None) -> None:
        """Shows the study on the screen; without one, or while planning, hides the panel.

        Args:
            study: The state of studies.
            ringed: The run on the screen, if it belongs to this study.
        """
        followed = None if study.is_draft_shown else study.followed
        for element in (self.tools, self.summary, self.map, self.links):
            element.visible = followed is not None
        is_going = followed is not None and not followed.status.state.has_ended
        self.bar.visible = self.cancel.visible = is_going
        self.resume.visible = followed is not None and followed.status.state is StudyState.FAILED
        if followed is not None:
            self._show(followed, study, ringed)
        has_runs = followed is not None and followed.picture is not None
        self.study_run.set_visible(has_runs)

    def _show(self, followed: Followed, study: StudyView, ringed: int | None) -> None:
        study_run, picture = study.study_run, followed.picture
        status = followed.status
        opening = study_run.index if study_run and study_run.is_awaited else None
        wrong = study.message or (study_run.message if study_run else "")
        self.summary.content = summary_html(followed, opening, wrong)
        self.links.content = links_html(followed)
        self.bar.value = min(100.0 * status.finished / max(status.stored.num_runs, 1), 100.0)
        self.bar.animated = status.state is StudyState.QUEUED
        if picture is not None and (picture, ringed) != self._drawn:
            self._drawn = picture, ringed
            self.map.content = map_html(picture, ringed)
            self.study_run.show(picture.study, study_run.index if study_run else None)
        elif picture is None:
            self.map.content = ""

    def remove(self) -> None:
        """Removes all widgets."""
        for element in (self.tools, self.summary, self.bar, self.cancel, self.resume, self.map):
            element.remove()
        self.study_run.remove()
        self.links.remove()

    async def _use(self, _: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        tool = self.tools.value
        self._send(ShowStudyDraft(True) if tool == _NEW else SizeMap(tool == _WIDER))


class _KnownStudies:
    """The stored studies, of all users.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._ids: dict[str, str] = {}
        self.choice = gui.add_dropdown(
            "studies",
            _NONE,
            hint="Opens one of the newest studies, of all users.",
        )
        self.refresh = gui.add_button(
            "Update the list",
            icon=viser.Icon.REFRESH,
            color="gray",
            hint="Lists the studies of the store again.",
        )
        self.choice.on_update(self._open)
        self.refresh.on_click(lambda _: send(ListStudies()))

    def show(self, study: StudyView) -> None:
        """Lists the studies, with the one on the screen selected."""
        self._ids = {list_label(status): status.stored.id for status in study.listed}
        options = (_NO_STUDY, *self._ids)
        if tuple(self.choice.options) != options:
            self.choice.options = options
        followed = (
            None if study.is_draft_shown or study.followed is None else study.followed.study_id
        )
        chosen = next((label for label, known in self._ids.items() if known == followed), _NO_STUDY)
        if self.choice.value != chosen:
            self.choice.value = chosen

    def remove(self) -> None:
        """Removes all widgets."""
        self.choice.remove()
        self.refresh.remove()

    async def _open(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        study_id = self._ids.get(event.target.value)
        if event.client_id is not None and study_id is not None:
            self._send(OpenStudy(study_id))


def draft_html(study: StudyView) -> str:
    """The cost of the planned study, or why it cannot run."""
    if study.draft is None:
        return box_html(
            "Not run", ["No parameter can vary: the law of this scenario is not available."]
        )
    runs = number_words(study.draft.num_runs, "run")
    if study.is_starting:
        text = f"<b>{runs}</b>: being checked …"
    elif study.price is not None:
        text = f"<b>{runs}</b>, {time_words(study.price.seconds)} of computing."
    else:
        text = f"<b>{runs}</b>"
    warnings = study.price.warnings if study.price is not None else ()
    boxes = [box_html("Not run", [escape(f"{m}.") for m in study.problems])] * bool(study.problems)
    notes = [escape(f"{text[:1].upper()}{text[1:]}.") for text in warnings]
    boxes += [box_html("Note", notes)] * bool(notes)
    boxes += [box_html("Not opened", [escape(study.message)])] * bool(study.message)
    return f"<div style='padding:0.4em 0.75em;font-size:0.85em'>{''.join(boxes)}{text}</div>"


def summary_html(followed: Followed, opening: int | None = None, wrong: str = "") -> str:
    """The title, the progress and the results so far of a study.

    Args:
        followed: The study.
        opening: The run of it that is being opened, if any.
        wrong: Reason why a run of it, or another study, could not be opened; may be empty.
    """
    status = followed.status
    title = escape(status.stored.title or "Study without a title")
    lines = [f"<b>{title}</b>", f"<div style='{_SMALL}'>{_state_words(followed)}</div>"]
    if followed.picture is not None and followed.picture.finished:
        lines.append(_held_html(followed.picture))
        lines.append(f"<div>{escape(describe_knowledge_in(followed.picture.study))}</div>")
    elif not followed.has_map:
        lines.append(
            "<div>There is no map, because the study does not vary two numeric parameters.</div>"
        )
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
    """The number of held runs, and the most frequent outcomes of the others."""
    so_far = "" if picture.finished == picture.study.num_runs else " so far"
    held_words = category_words(HELD, picture.study.base.space)
    held = (
        f"<div style='font-size:1.15em;font-weight:700;color:{tone('good')};margin-top:0.25em'>"
        f"{held_words.capitalize()} {picture.held} of {picture.finished}{so_far} "
        f"({share_words(picture.held, picture.finished)})</div>"
    )
    others = sorted((count, -way) for way, count in picture.counts.items() if way != HELD)[::-1]
    if not others:
        return held
    reasons = "; ".join(
        f"{escape(category_words(-way, picture.study.base.space))}: {count}"
        for count, way in others[:_MOST_REASONS]
    )
    more = "; …" if len(others) > _MOST_REASONS else ""
    return f"{held}<div>Others: {reasons}{more}.</div>"


def links_html(followed: Followed) -> str:
    """The results as files."""
    study = f"{from_page(API_PATH)}/studies/{escape(followed.study_id)}"
    links = [("results.csv", "CSV"), ("results.json", "JSON")]
    if followed.picture is not None:
        links = [("map.svg", "map as SVG"), ("map.png", "as PNG"), *links]
    if followed.status.state in (StudyState.COMPLETED, StudyState.CANCELLED):
        links.append(("recording", "MCAP"))
    anchors = ", ".join(f"<a href='{study}/{end}' download>{name}</a>" for end, name in links)
    return f"<div style='padding:0.4em 0.75em;{_SMALL}'>Download: {anchors}</div>"
