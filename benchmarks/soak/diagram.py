"""The diagram of a service under load: resources and response rate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.soak.observing import Sample
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.style import add_axes, new_figure, paint, paper_style
from slipgrasp.recordings.palette import MUTED, PHASES

_SERVICE, _WORKERS = paint(PHASES[ContactPhase.STICK]), paint(PHASES[ContactPhase.SLIP_FORWARD])
_MINUTE = 60.0
_RATE_WINDOW = 6


def draw_soak(samples: Sequence[Sample]) -> Figure:
    """Memory, descriptors and responses per second over time."""
    minutes = [sample.time / _MINUTE for sample in samples]
    with paper_style():
        figure = new_figure(120.0)
        memory, descriptors, rate = (
            add_axes(figure, 14.0, top, 160.0, 26.0) for top in (7.0, 44.0, 81.0)
        )
        memory.set_title("(a) memory [MB]", loc="left", fontsize=8.5)
        _draw(memory, minutes, [s.service_memory / 1e6 for s in samples], "service")
        _draw(memory, minutes, [s.worker_memory / 1e6 for s in samples], "workers", _WORKERS)
        descriptors.set_title("(b) open files and sockets", loc="left", fontsize=8.5)
        _draw(descriptors, minutes, [s.service_descriptors for s in samples], "service")
        _draw(descriptors, minutes, [s.worker_descriptors for s in samples], "workers", _WORKERS)
        rate.set_title("(c) answers [1/s]", loc="left", fontsize=8.5)
        _draw(rate, *_rate(samples), "", paint(MUTED))
        rate.set_xlabel("time [min]")
        return figure


def _draw(
    axes: Axes,
    minutes: Sequence[float],
    values: Sequence[float],
    name: str,
    colour: tuple[float, float, float] = _SERVICE,
) -> None:
    axes.plot(minutes, values, color=colour, linewidth=0.9)
    axes.set(xlim=(0.0, None), ylim=(0.0, None))
    if name:
        place = (minutes[-1], values[-1])
        axes.annotate(
            name, place, (3, 0), textcoords="offset points", color=colour, fontsize=7.0, va="center"
        )


def _rate(samples: Sequence[Sample]) -> tuple[list[float], list[float]]:
    """Responses per second, each over half a minute, and their times [min]."""
    times = np.array([sample.time for sample in samples])
    counts = np.array([sample.answers for sample in samples])
    first, last = slice(None, -_RATE_WINDOW), slice(_RATE_WINDOW, None)
    rates = (counts[last] - counts[first]) / (times[last] - times[first])
    return ((times[last] + times[first]) / 2 / _MINUTE).tolist(), rates.tolist()
