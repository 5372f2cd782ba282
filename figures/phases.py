"""Phases of the contacts in figures: lanes above the axes, tinted background, and key."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.patches import Patch

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import (
    SLIPS_ALONG_BOTH_TANGENTS,
    SLIPS_ALONG_ONE_TANGENT,
    ContactPhase,
)
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.slip_times import PhaseSpan, Window, phase_spans
from slipgrasp.figures.style import paint
from slipgrasp.recordings.palette import MARK, PHASES, SHADE

_TINT = 0.86
_WORDS = {
    (ContactPhase.STICK,): "stick",
    (ContactPhase.SLIP_FORWARD,): r"slip clockwise ($\dot s > 0$)",
    (ContactPhase.SLIP_BACKWARD,): r"slip counterclockwise ($\dot s < 0$)",
    (ContactPhase.SLIP,): "slip",
    SLIPS_ALONG_ONE_TANGENT: "slip along one tangent",
    SLIPS_ALONG_BOTH_TANGENTS: "slip along both tangents",
}


def draw_lanes(strip: Axes, result: RunResult, contacts: Sequence[int], window: Window) -> None:
    """Fills axes with one lane per contact, in the colours of its phases."""
    strip.set_axis_off()
    strip.set_xlim(*window)
    strip.set_ylim(len(contacts), 0)
    for lane, contact in enumerate(contacts):
        for phase, bars in _bars_by_phase(phase_spans(result, contact)).items():
            colour = paint(PHASES[phase])
            strip.broken_barh(bars, (lane + 0.1, 0.7), facecolor=colour, linewidth=0.0)


def name_lanes(strip: Axes, result: RunResult, contacts: Sequence[int], offset: float) -> None:
    """Writes the contacts' names to the left of their lanes.

    Args:
        strip: The axes of the lanes.
        result: The run.
        contacts: The contacts, from top to bottom.
        offset: Distance of the names as a fraction of the axes' width.
    """
    names = result.scenario.finger_names
    for lane, contact in enumerate(contacts):
        strip.text(
            -offset,
            lane + 0.45,
            names[contact],
            transform=strip.get_yaxis_transform(),
            ha="right",
            va="center_baseline",
            fontsize=6.5,
            color=paint(MARK),
        )


def shade(axes: Axes, result: RunResult, contacts: Sequence[int]) -> None:
    """Tints the background while contacts slip.

    A single slipping contact gives the colour of its phase; several share one tint, because their
    phases may differ.
    """
    for contact in contacts:
        for phase, bars in _bars_by_phase(phase_spans(result, contact)).items():
            if phase is ContactPhase.STICK:
                continue
            colour = PHASES[phase] if len(contacts) == 1 else SHADE
            axes.broken_barh(
                bars,
                (0.0, 1.0),
                transform=axes.get_xaxis_transform(),
                facecolor=paint(lighter(colour, _TINT)),
                linewidth=0.0,
                zorder=0.1,
            )


def phase_patches(result: RunResult) -> list[Patch]:
    """Legend entries of the phases that occur."""
    contacts = range(result.trace.shape.num_contacts)
    shown = {span.phase for contact in contacts for span in phase_spans(result, contact)}
    return [
        Patch(facecolor=paint(PHASES[phases[0]]), label=words)
        for phases, words in _WORDS.items()
        if shown.intersection(phases)
    ]


def _bars_by_phase(spans: Sequence[PhaseSpan]) -> dict[ContactPhase, list[tuple[float, float]]]:
    bars: dict[ContactPhase, list[tuple[float, float]]] = {}
    for phase, start, end in spans:
        bars.setdefault(phase, []).append((start, end - start))
    return bars
