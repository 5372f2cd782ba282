"""The reducer of exports."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from typing import BinaryIO

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.words.phrases import milliseconds
from slipgrasp.recordings.clip import Clip
from slipgrasp.recordings.export import MOVING_FORMATS, STILL_FORMATS
from slipgrasp.recordings.still import AT_THE_END, Still
from slipgrasp.server.budget import Need
from slipgrasp.web.charts.drawn import ChartedRun, drawn_charts
from slipgrasp.web.model.export import ExportFile, Exporting, file_name
from slipgrasp.web.model.intents.export import (
    CancelExport,
    ExportCharts,
    ExportClip,
    ExportFailed,
    ExportFinished,
    ExportMoved,
    ExportPage,
    ExportPicture,
    ExportStill,
)
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.view import Shown, ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.export_worker import ExportWorker
from slipgrasp.web.workers.open_recordings import OpenRecordings

WritePage = Callable[[RunResult, BinaryIO], None]

_PICTURES = {each.name: each for each in (*MOVING_FORMATS, *STILL_FORMATS)}


class ExportReducer(Reducer):
    """Creates files for download, one at a time.

    Args:
        recordings: Memory for drawing runs.
        send: Accepts the answers of its thread.
        deliver: Sends a file to the user.
        write_page: Writes a run as a live page.
    """

    def __init__(
        self,
        recordings: OpenRecordings,
        send: Send,
        deliver: Callable[[ExportFile], None],
        write_page: WritePage,
    ) -> None:
        self._recordings = recordings
        self._deliver = deliver
        self._write_page = write_page
        self._worker = ExportWorker(send)
        self.workers = (self._worker,)

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Starts, cancels, or completes an export."""
        match intent:
            case CancelExport():
                self._worker.cancel(view.exporting.number)
            case ExportMoved() | ExportFinished() | ExportFailed():
                return replace(view, exporting=self._take_answer(intent, view.exporting))
            case ExportPicture() | ExportCharts() | ExportPage() | ExportClip() | ExportStill():
                if view.shown is not None and not view.exporting.busy_with:
                    return replace(view, exporting=self._begin(intent, view, view.shown))
        return view

    def _begin(self, intent: Intent, view: ViewState, shown: Shown) -> Exporting:
        number, run = view.exporting.number + 1, shown.name
        begun = replace(view.exporting, number=number, share=0.0, message="", is_failure=False)
        if isinstance(intent, ExportPicture):
            # The page itself takes the image of its view.
            name = file_name(run, f"view-{_instant(view)}", "png")
            return replace(begun, pictures=begun.pictures + 1, picture_name=name)
        if isinstance(intent, ExportCharts):
            name = file_name(run, "charts", "svg")
            self._worker.start(number, lambda _: ExportFile(name, self._charts(view, shown)))
            return replace(begun, busy_with="Drawing the charts")
        if isinstance(intent, ExportPage):
            name = file_name(run, "page", "html")
            self._worker.start(number, lambda _: ExportFile(name, self._page(shown)))
            return replace(begun, busy_with="Writing the page")
        assert isinstance(intent, ExportClip | ExportStill)
        chosen = _PICTURES[intent.name]
        what = "clip" if isinstance(intent, ExportClip) else _instant(view)
        name = file_name(run, what, chosen.name)
        self._worker.start(
            number, lambda tell: ExportFile(name, self._draw(view, shown, intent, tell))
        )
        return replace(begun, busy_with=f"Creating the {chosen.title}")

    def _charts(self, view: ViewState, shown: Shown) -> bytes:
        runs = (shown.result, *((view.ghost.shown.result,) if view.ghost else ()))
        with self._recordings.reserve_for(*runs):
            return _charts_file(view, shown)

    def _page(self, shown: Shown) -> bytes:
        stream = io.BytesIO()
        with self._recordings.memory.reserve(Need.to_write_page(shown.result)):
            self._write_page(shown.result, stream)
        return stream.getvalue()

    def _draw(
        self,
        view: ViewState,
        shown: Shown,
        asked: ExportClip | ExportStill,
        tell: Callable[[float], None],
    ) -> bytes:
        """A requested image or animation; checks whether it is possible."""
        stream = io.BytesIO()
        if isinstance(asked, ExportClip):
            clip, still = clip_of(view, asked.height), AT_THE_END
        else:
            clip, still = clip_of(view), still_of(view, asked)
        with self._recordings.reserve_for(shown.result):
            _PICTURES[asked.name].write(shown.result, stream, tell, clip=clip, still=still)
        return stream.getvalue()

    def _take_answer(
        self, answer: ExportMoved | ExportFinished | ExportFailed, exporting: Exporting
    ) -> Exporting:
        if answer.number != exporting.number:
            return exporting
        if isinstance(answer, ExportMoved):
            return replace(exporting, share=answer.share)
        done = replace(exporting, busy_with="", share=0.0)
        if isinstance(answer, ExportFailed):
            return replace(done, message=answer.message, is_failure=True)
        self._deliver(answer.file)
        size = len(answer.file.content) / 1e6
        return replace(done, message=f"{answer.file.name} ({size:.1f} MB) is in your downloads.")


def _charts_file(view: ViewState, shown: Shown) -> bytes:
    """Draws the current charts."""
    # Deferred, because matplotlib takes a second to load and most sessions do not need it.
    from slipgrasp.web.charts.figure import ChartsHeading, charts_svg

    assert view.playback is not None
    ghost = ChartedRun.of(view.ghost.shown.result, view=view.charts) if view.ghost else None
    run = ChartedRun.of(shown.result, view=view.charts)
    drawn = [
        chart
        for tab in run.tabs
        for chart in drawn_charts(run, ghost, view.playback.window, view.charts, tab)
    ]
    heading = ChartsHeading(
        title=shown.name,
        ghost=view.ghost.label if view.ghost else "",
        time=view.playback.time,
        changes=tuple(change.time for change in shown.result.scenario.changes),
    )
    return charts_svg(drawn, heading)


def clip_of(view: ViewState, height: int | None = None) -> Clip:
    """The visible time range, at the current playback speed."""
    if view.playback is None:
        return Clip(height=height)
    window = view.playback.window
    return Clip(start=window.start, end=window.end, speed=view.playback.speed, height=height)


def still_of(view: ViewState, asked: ExportStill) -> Still:
    """The instant at the play head, in the requested size.

    Raises:
        StillError: If the size is invalid.
    """
    time = view.playback.time if view.playback else None
    return Still(time=time, width=asked.width, height=asked.height)


def _instant(view: ViewState) -> str:
    """The time of the play head for a file name."""
    return milliseconds(view.playback.time).replace(" ", "") if view.playback else ""
