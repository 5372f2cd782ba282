"""Measured data overlaid on a run, as a run with only the measured signals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.signals import TIME_COLUMN
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.measured.recording import MeasuredRecording

MOST_SAMPLES = 20_000
"""Largest number of samples of a page or figure; larger data are thinned evenly."""


def thinned(measured: MeasuredRecording) -> MeasuredRecording:
    """The data with at most `MOST_SAMPLES` samples."""
    step = -(-len(measured.times) // MOST_SAMPLES)
    return MeasuredRecording(
        outline=measured.outline, times=measured.times[::step], values=measured.values[::step]
    )


def laid_over(run: RunResult, measured: MeasuredRecording) -> RunResult:
    """A run with only the measured signals; all others are NaN.

    Args:
        run: The run on which the data are overlaid; its scenario is used.
        measured: Measured data.
    """
    shape = run.trace.shape
    rows = np.full((len(measured.times), shape.num_columns), np.nan)
    # Phases are whole numbers; those of measured data are not drawn.
    with np.errstate(invalid="ignore"):
        trace = Trace.from_rows(shape, rows)
    known = [column.name for column in measured.outline.columns]
    for column in columns_of(trace):
        if column.name == TIME_COLUMN:
            column.values[:] = measured.times
        elif column.holds_phases:
            column.values[:] = 0
        elif column.name in known:
            column.values[:] = measured.column(column.name)
    return replace(run, trace=trace, phase_changes=(), warnings=(), reason=None, ticks=None)
