"""What a user takes away: files of the view, made one at a time."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from queue import SimpleQueue
from xml.etree import ElementTree

import pytest
from PIL import Image

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings import export
from slipgrasp.recordings.clip import Clip
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.budget import PAGE_BYTES
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.drawn import ChartedRun, DrawnChart, drawn_charts
from slipgrasp.web.charts.figure import ChartsHeading, charts_svg, draw_charts_figure
from slipgrasp.web.model.charts_view import ChartsView
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
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.playback import TimeWindow, slip_window
from slipgrasp.web.model.view import Ghost, RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.panels.export_panel import ExportPanel
from slipgrasp.web.reducers.export import ExportReducer, clip_of
from slipgrasp.web.standalone.page_file import write_usual_page
from slipgrasp.web.workers.export_worker import ExportWorker
from slipgrasp.web.workers.open_recordings import OpenRecordings
from tests.waiting import PATIENCE
from tests.web.listening_gui import ListeningClient
from tests.web.opening import recordings_in
from tests.web.test_charts_panel import view_of

pytestmark = pytest.mark.slow

SVG = "{http://www.w3.org/2000/svg}"


STEM = "slipgrasp-paper-case-1-duration-0.1-s"


@pytest.fixture(scope="module")
def short() -> RunResult:
    return simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.1}))


class Office:
    """A reducer, the view that it has made, and the files that it has delivered."""

    def __init__(self, view: ViewState, recordings: OpenRecordings) -> None:
        self.answers: SimpleQueue[Intent] = SimpleQueue()
        self.delivered: list[ExportFile] = []
        self.reducer = ExportReducer(
            recordings, self.answers.put, self.delivered.append, write_usual_page
        )
        self.view = view

    def take(self, intent: Intent) -> Exporting:
        self.view = self.reducer.reduce(intent, self.view)
        return self.view.exporting

    def close(self) -> None:
        for worker in self.reducer.workers:
            worker.close()
            worker.join(PATIENCE)

    def finish(self) -> list[float]:
        """Takes answers until nothing is made any more; gives the shares that were told."""
        shares: list[float] = []
        while self.view.exporting.busy_with:
            answer = self.answers.get(timeout=PATIENCE)
            shares += [answer.share] if isinstance(answer, ExportMoved) else []
            self.take(answer)
        return shares


@pytest.fixture
def office(short: RunResult, store: RecordingStore) -> Iterator[Office]:
    office = Office(view_of(short), recordings_in(store))
    yield office
    office.close()
    assert "export" not in {thread.name for thread in threading.enumerate()}


def charts_of_view(view: ViewState, hidden: ChartsView) -> list[DrawnChart]:
    assert view.shown is not None
    assert view.playback is not None
    ghost = ChartedRun.of(view.ghost.shown.result) if view.ghost else None
    run = ChartedRun.of(view.shown.result)
    window = view.playback.window
    return [chart for tab in run.tabs for chart in drawn_charts(run, ghost, window, hidden, tab)]


def test_the_drawing_shows_the_same_lines_as_the_page(case_2: RunResult) -> None:
    view = replace(view_of(case_2), ghost=Ghost(Shown(2, case_2, 0.0), "the run before"))
    hidden = ChartsView(frozenset({("forces", "limit-0")}))
    charts = charts_of_view(view, hidden)
    heading = ChartsHeading("title", "the run before", 0.05, (0.02,))
    figure = draw_charts_figure(charts, heading)
    axes = {a.get_label(): a for a in figure.axes}
    marks = 2
    for chart in charts:
        drawn = axes[chart.chart.key]
        assert len(drawn.lines) == 2 * len(chart.own.chart.lines) + marks
        window = slip_window(case_2)
        assert drawn.get_xlim() == (window.start, window.end)
        columns = chart.columns()
        assert drawn.lines[0].get_ydata() == pytest.approx(columns[2], nan_ok=True)
    words = [text.get_text() for text in figure.texts]
    assert "Ghost: the run before." in words
    assert any("left μ$F_n$ hidden" in text for text in words)


def test_a_title_is_text_and_never_mathematics_or_markup(short: RunResult) -> None:
    title = "$\\frac{1}{0}$ </svg><script>"
    svg = charts_svg(
        charts_of_view(view_of(short), ChartsView()), ChartsHeading(title, "", 0.05, ())
    )
    root = ElementTree.fromstring(svg)
    assert root.tag == f"{SVG}svg"
    assert root.find(f".//{SVG}script") is None


def test_every_sign_of_a_hand_in_space_is_in_the_fonts_of_the_drawing() -> None:
    """Of a sign that they lack matplotlib warns, which is an error here."""
    held = simulate(with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.1}))
    charts = charts_of_view(view_of(held), ChartsView())
    svg = charts_svg(charts, ChartsHeading("title", "", 0.05, ()))
    assert ElementTree.fromstring(svg).tag == f"{SVG}svg"


def test_the_charts_arrive_as_one_drawing(office: Office) -> None:
    assert office.take(ExportCharts()).busy_with == "Drawing the charts"
    office.finish()
    (file,) = office.delivered
    assert file.name == f"{STEM}-charts.svg"
    assert ElementTree.fromstring(file.content).tag == f"{SVG}svg"
    exporting = office.view.exporting
    assert file.name in exporting.message
    assert not exporting.is_failure


def test_a_clip_tells_how_far_it_is_and_arrives(office: Office) -> None:
    office.take(ExportClip("html", 480))
    shares = office.finish()
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    (file,) = office.delivered
    assert file.name == f"{STEM}-clip.html"
    assert file.content.lstrip().lower().startswith(b"<!doctype html")


def test_the_page_that_simulates_arrives(office: Office) -> None:
    assert office.take(ExportPage()).busy_with == "Writing the page"
    office.finish()
    (file,) = office.delivered
    assert file.name == f"{STEM}-page.html"
    assert b'id="sg-kernel"' in file.content


def test_a_page_that_needs_more_than_the_budget_is_refused_in_words(
    short: RunResult, store: RecordingStore
) -> None:
    office = Office(view_of(short), recordings_in(store, limit=PAGE_BYTES))
    office.take(ExportPage())
    office.finish()
    assert office.delivered == []
    assert "this page needs" in office.view.exporting.message
    office.close()


def test_a_still_is_the_play_head_in_the_size_that_was_asked_for(office: Office) -> None:
    office.take(ExportStill("png", 640, 360))
    office.finish()
    office.take(ExportStill("png", 640, 10))
    office.finish()
    (file,) = office.delivered
    assert file.name == f"{STEM}-50ms.png"
    assert Image.open(io.BytesIO(file.content)).size == (640, 360)
    assert "the height is 10 px; allowed: 240" in office.view.exporting.message


def test_only_one_file_is_made_at_a_time(office: Office) -> None:
    office.take(ExportClip("html", 480))
    assert office.take(ExportCharts()).number == 1
    assert office.take(ExportPicture()).pictures == 0
    office.finish()
    assert [file.name for file in office.delivered] == [f"{STEM}-clip.html"]


def test_a_cancelled_export_ends_and_the_next_one_works(office: Office) -> None:
    office.take(ExportClip("html", 480))
    office.take(CancelExport())
    office.finish()
    assert office.delivered == []
    assert office.view.exporting.message == "Cancelled; no file was made."
    office.take(ExportCharts())
    office.finish()
    assert len(office.delivered) == 1


def test_an_answer_to_an_older_export_is_void(office: Office) -> None:
    office.take(ExportPicture())
    late = ExportFinished(0, ExportFile("late", b""))
    assert office.take(late) == office.take(ExportMoved(0, 0.5))
    assert office.delivered == []


def test_the_page_is_asked_for_each_picture(office: Office) -> None:
    assert office.take(ExportPicture()).picture_name == f"{STEM}-view-50ms.png"
    assert office.take(ExportPicture()).pictures == 2


def fail(error: Exception) -> Callable[[object], ExportFile]:
    def make(_: object) -> ExportFile:
        raise error

    return make


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(24, "Too many open files"), "The file could not be made: Too many open files."),
        (ZeroDivisionError("ours"), "internal error"),
    ],
)
def test_what_goes_wrong_is_told_in_words(error: Exception, words: str) -> None:
    answers: SimpleQueue[Intent] = SimpleQueue()
    worker = ExportWorker(answers.put)
    worker.start(7, fail(error))
    answer = answers.get(timeout=PATIENCE)
    assert isinstance(answer, ExportFailed) and answer.number == 7
    assert words in answer.message
    worker.close()
    worker.join(PATIENCE)


@pytest.mark.parametrize(
    ("origin", "name"),
    [
        ("paper-case-2", "slipgrasp-paper-case-2-charts.svg"),
        ("recording ../../etc/passwd", "slipgrasp-recording-..-..-etc-passwd-charts.svg"),
        ("x" * 500, f"slipgrasp-{'x' * 60}-charts.svg"),
        ("é\n</b>", "slipgrasp-b-charts.svg"),
        ("", "slipgrasp-charts.svg"),
    ],
)
def test_a_file_has_a_name_that_every_disk_takes(origin: str, name: str) -> None:
    assert file_name(origin, "charts", "svg") == name


def test_files_of_the_server_are_offered_once_the_run_is_kept(
    viewer_server: ViewerServer, short: RunResult
) -> None:
    client = ListeningClient(viewer_server)
    panel = ExportPanel(client.gui, [].append)
    view = view_of(short)
    panel.update(view)
    assert not any("href" in text for text in client.texts)
    panel.update(replace(view, status=RunStatus(RunStage.SAVED, run_id="abc")))
    assert any("href='api/v1/runs/abc/recording'" in text for text in client.texts)
    failed = Exporting(message="<b>broken</b>", is_failure=True)
    panel.update(replace(view, exporting=failed))
    assert any("&lt;b&gt;broken" in text for text in client.texts)


@pytest.mark.parametrize("has_av", [True, False])
def test_films_are_offered_where_what_writes_them_is_installed(
    viewer_server: ViewerServer, monkeypatch: pytest.MonkeyPatch, has_av: bool
) -> None:
    monkeypatch.setattr(export, "find_spec", lambda _name: object() if has_av else None)
    panel = ExportPanel(ListeningClient(viewer_server).gui, [].append)
    clips = {b.label for b in panel._buttons if b.label.startswith("Clip")}
    assert clips == {"Clip (HTML)", "Clip (GIF)"} | (
        {"Clip (MP4)", "Clip (WebM)"} if has_av else set()
    )


def test_a_clip_is_what_is_played_as_it_is_played(short: RunResult) -> None:
    view = view_of(short)
    assert view.playback is not None
    window = TimeWindow(0.01, 0.03)
    played = replace(view.playback, window=window, speed=1 / 64)
    clip = clip_of(replace(view, playback=played), 1080)
    assert clip == Clip(start=0.01, end=0.03, speed=1 / 64, height=1080)
