"""The fit panel: find parameters from a stored recording, and watch their profiles fill."""

from __future__ import annotations

from html import escape
from itertools import zip_longest

import numpy as np
import viser
from viser import uplot

from slipgrasp.recordings.palette import FINGERS, MUTED
from slipgrasp.server.addresses import API_PATH, from_page
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.web.model.colours import css, legible
from slipgrasp.web.model.fit import FitDraft, FitView, ShownProfile, fit_label, progress_words
from slipgrasp.web.model.fit_profiles import profiles_of
from slipgrasp.web.model.intents.fit import CancelFit, OpenFit, StartFit
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.panels.outcome_panel import box_html
from slipgrasp.web.panels.recordings_panel import distinct_names

_NONE: str = "choose …"
_INTRO = (
    "<div style='padding:0.5em 0.75em 0;font-size:0.85em'>Find parameters of the scenario on the "
    "screen from a stored recording: measured data, or a run. The profile of each parameter shows "
    "how far it can go while the others follow.</div>"
)
_SMALL = "padding:0.4em 0.75em 0;font-size:0.85em"
_HEIGHT = 150
_HIGHEST_RISE = 3.0
"""Upper limit of profile plots, in thresholds."""


class FitPanel:
    """Inputs of a fit, and the displayed fit.

    Args:
        gui: Container of the panel.
        send: Receives the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._recordings: dict[str, str] = {}
        self._fits: dict[str, str] = {}
        self._opened = ""
        self._drawn: tuple[object, ...] = ()
        gui.add_html(_INTRO)
        self._add_inputs()
        self.summary = gui.add_html("")
        self.cancel = gui.add_button("Cancel the fit", icon=viser.Icon.X, color="gray")
        self.cancel.on_click(lambda _: send(CancelFit()))
        self.profiles = _Profiles(gui)
        self.known = gui.add_dropdown(
            "fits", (_NONE,), hint="Opens one of the newest fits, of all users."
        )
        self.known.on_update(self._open)

    def _add_inputs(self) -> None:
        gui = self._gui
        self.data = gui.add_dropdown("data", (_NONE,), hint="The recording to fit.")
        self.free = gui.add_text(
            "parameters",
            "object.mass",
            hint="Keys of the parameters to find, separated by commas; fingers.*.friction are all "
            "frictions, object.mass=0.5..2 has a range.",
        )
        self.signals = gui.add_text(
            "signals",
            "object_pose:2e-4,slip:2e-4",
            hint="Signals to fit, each with the standard deviation of its noise in SI units.",
        )
        self.starts = gui.add_number(
            "starts", 5, min=1, max=256, step=1, hint="How many points the search starts from."
        )
        self.fit = gui.add_button("Fit", icon=viser.Icon.PLAYER_PLAY, hint="Starts the fit.")
        self.fit.on_click(self._start)

    def update(self, view: ViewState) -> None:
        """Shows the selectable recordings and the displayed fit."""
        drawn = (view.fit, view.run_list.recent, view.appearance.dark, view.ghost)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        names = distinct_names(view.run_list.recent)
        self._recordings = {f"{name} · {run_id}": run_id for run_id, name in names.items()}
        self._fits = {fit_label(status): status.stored.id for status in view.fit.listed}
        for picker, options in ((self.data, self._recordings), (self.known, self._fits)):
            if tuple(picker.options) != (_NONE, *options):
                picker.options = (_NONE, *options)
        self._choose_opened(view)
        self.fit.disabled = view.fit.is_starting
        self.summary.content = summary_html(view.fit)
        status = view.fit.status
        self.cancel.visible = status is not None and not status.state.has_ended
        self.profiles.draw(profiles_of(view.fit), dark=view.appearance.dark)

    def _choose_opened(self, view: ViewState) -> None:
        """Selects the measured data that are overlaid on the run, once."""
        replay = view.ghost.shown.replay if view.ghost is not None else None
        if view.ghost is None or replay is None or replay.run_id == self._opened:
            return
        opened = {run_id: label for label, run_id in self._recordings.items()}.get(replay.run_id)
        if view.ghost.run is None and opened is not None:
            self._opened, self.data.value = replay.run_id, opened

    async def _start(self, _: object) -> None:
        recording = self._recordings.get(self.data.value, "")
        starts = int(self.starts.value)
        self._send(StartFit(FitDraft(recording, self.free.value, self.signals.value, starts)))

    async def _open(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        fit_id = self._fits.get(event.target.value)
        if event.client_id is not None and fit_id is not None:
            self._send(OpenFit(fit_id))


class _Profiles:
    """A chart per parameter; charts are created once, and hidden while unused.

    Args:
        gui: Container of the charts.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui = gui
        self._folder = gui.add_folder("Profiles", visible=False)
        self._heads: list[viser.GuiHtmlHandle] = []
        self._plots: list[viser.GuiUplotHandle] = []

    def draw(self, profiles: list[ShownProfile], *, dark: bool) -> None:
        """Draws the profiles so far."""
        self._folder.visible = bool(profiles)
        with self._folder:
            for profile in profiles[len(self._plots) :]:
                self._heads.append(self._gui.add_html(""))
                self._plots.append(self._add(profile, dark))
        for head, plot, profile in zip_longest(self._heads, self._plots, profiles):
            head.visible = plot.visible = profile is not None
            if profile is not None:
                key, words = escape(profile.key), escape(profile.words)
                head.content = f"<div style='{_SMALL}'><b>{key}</b> {words}</div>"
                plot.data = columns_of(profile)
                plot.series = _series(dark)
                plot.scales = scales_of(profile)

    def _add(self, profile: ShownProfile, dark: bool) -> viser.GuiUplotHandle:
        axes = (uplot.Axis(label=profile.key), uplot.Axis(label="rise of χ²"))
        return self._gui.add_uplot(
            columns_of(profile),
            _series(dark),
            axes=axes,
            scales=scales_of(profile),
            legend=uplot.Legend(show=False),
            height=_HEIGHT,
        )


def columns_of(profile: ShownProfile) -> tuple[np.ndarray, ...]:
    """Values, rises, and the threshold."""
    values, rises = (np.array(column) for column in zip(*profile.points, strict=True))
    return values, rises, np.full(len(values), profile.threshold)


def scales_of(profile: ShownProfile) -> dict[str, uplot.Scale]:
    """Scales for the part of a profile around the threshold, without large rises."""
    top = _HIGHEST_RISE * profile.threshold
    near = [value for value, rise in profile.points if rise <= top]
    margin = 0.08 * (near[-1] - near[0]) or 0.01 * abs(near[0]) or 1.0
    across = (near[0] - margin, near[-1] + margin)
    return {
        "x": uplot.Scale(time=False, range=across),
        "y": uplot.Scale(range=(-0.05 * top, top)),
    }


def _series(dark: bool) -> tuple[uplot.Series, ...]:
    line = css(legible(FINGERS[0], dark=dark))
    limit = css(legible(MUTED, dark=dark))
    return (
        uplot.Series(label="value"),
        uplot.Series(label="rise", stroke=line, width=1.75, points=uplot.Series_Points(size=5)),
        uplot.Series(
            label="95 %",
            stroke=limit,
            width=1.25,
            dash=(5, 4),
            points=uplot.Series_Points(show=False),
        ),
    )


def summary_html(fit: FitView) -> str:
    """Progress of the displayed fit, and links to its report."""
    lines = [box_html("Not fitted", [escape(fit.message)])] if fit.message else []
    if fit.is_starting:
        lines.append("<div>The request is being checked …</div>")
    status = fit.status
    if status is not None:
        lines.append(f"<div>{escape(progress_words(status))}</div>")
        if status.state is StudyState.COMPLETED:
            own = f"{from_page(API_PATH)}/fits/{escape(status.stored.id)}"
            lines.append(
                f"<div><a href='{own}/report.html' target='_blank'>Report</a>, "
                f"<a href='{own}/report.json' download>JSON</a>, "
                f"<a href='{own}/recording' download>its runs as MCAP</a></div>"
            )
    if fit.report is not None and not fit.report["explains"]:
        lines.append("<div>The residuals are larger than the noise: see the report.</div>")
    return f"<div style='{_SMALL}'>{''.join(lines)}</div>"
