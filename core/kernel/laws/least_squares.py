"""Recursive least squares with forgetting: adaptation of the composite laws.

Measurements Y phi = y are processed one by one. Reference: Slotine & Li, Applied Nonlinear Control,
8.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Floats, Layout, Record
from slipgrasp.core.scenario import MAX_UNKNOWNS

SURPRISE = 36.0  # squared error over its variance above which previous knowledge is discarded
LEAST_TRUST = 1e-3
ACTIVE_BAND = 1e-6  # fraction of its cone within which a force counts as on it


def memory_layout(more: Sequence[tuple[Any, ...]]) -> Layout:
    """Memory of a composite law between ticks, and its intermediate values.

    Args:
        more: Additional fields for this kind of hand.
    """
    fields = [
        ("begun", np.int64),
        ("covariance", np.float64, (MAX_UNKNOWNS, MAX_UNKNOWNS)),
        ("initial", np.float64, (MAX_UNKNOWNS,)),  # estimates at the tick, before its rows
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("row", np.float64, (MAX_UNKNOWNS,)),  # of Y
        ("gain", np.float64, (MAX_UNKNOWNS,)),
        ("trust", np.float64),  # in the measured accelerations, 0 to 1
        ("contact_trust", np.float64, (MAX_FINGERS,)),  # in the force of a contact in slip
        ("known", np.int64, (MAX_FINGERS,)),  # 1 after slip has determined its friction
        *more,
    ]
    return np.dtype(fields, align=True)


def make_take_row(prefix: str, law: Layout, memory: Layout) -> Any:
    """Creates the function that processes one measurement, for one kind of hand."""

    @compiled_apart(
        types.void, law, types.int64, memory, types.float64, types.float64, prefix=prefix
    )
    def take_row(law: Record, count: int, memory: Record, error: float, variance: float) -> None:
        """Processes a row of Y phi = y; ``error`` is y - Y phi at the estimates of the tick."""
        row, covariance = memory.row, memory.covariance
        for k in range(count):
            error -= row[k] * (memory.estimates[k] - memory.initial[k])
        spread = _multiply_covariance(count, memory)
        if spread == 0.0:
            return
        if error * error > SURPRISE * (variance + spread):
            for k in range(count):
                if row[k] != 0.0:
                    covariance[k, k] = max(covariance[k, k], law.prior_variances[k])
            spread = _multiply_covariance(count, memory)
        scale = 1.0 / (variance + spread)
        for j in range(count):
            memory.estimates[j] += scale * memory.gain[j] * error
            for k in range(j + 1):
                # Keeps the matrix exactly symmetric: forgetting would amplify any difference.
                covariance[j, k] -= scale * memory.gain[j] * memory.gain[k]
                covariance[k, j] = covariance[j, k]

    return take_row


@compiled
def _multiply_covariance(count: int, memory: Record) -> float:
    """Writes P Y^T of the current row to ``gain``; returns Y P Y^T."""
    spread = 0.0
    for j in range(count):
        total = 0.0
        for k in range(count):
            total += memory.covariance[j, k] * memory.row[k]
        memory.gain[j] = total
        spread += memory.row[j] * total
    return spread


@compiled
def begin_rows(law: Record, count: int, memory: Record) -> None:
    """Starts a tick with the estimates in ``initial``; initializes the memory at the first tick."""
    if memory.begun == 0:
        memory.begun = 1
        for j in range(count):
            for k in range(count):
                memory.covariance[j, k] = 0.0
            memory.covariance[j, j] = law.prior_variances[j]
    for k in range(count):
        memory.estimates[k] = memory.initial[k]


@compiled
def forget(law: Record, count: int, memory: Record) -> None:
    """Increases the covariance; no variance exceeds its initial value."""
    covariance = memory.covariance
    for j in range(count):
        for k in range(count):
            covariance[j, k] /= law.forgetting
    for j in range(count):
        most = law.prior_variances[j]
        if covariance[j, j] > most:
            scale = np.sqrt(most / covariance[j, j])
            for k in range(count):
                covariance[j, k] *= scale
                covariance[k, j] *= scale


@compiled
def weigh_tracking(count: int, covariance: Floats, rates: Floats, memory: Record) -> None:
    """Writes the product of a covariance and the tracking term ``rates`` to ``gain``."""
    for j in range(count):
        tracking = 0.0
        for k in range(count):
            tracking += covariance[j, k] * rates[k]
        memory.gain[j] = tracking


@compiled
def set_rates(model: Record, work: Record, memory: Record, is_probed: Any) -> None:
    """Sets the rates that lead to the next estimates, with the tracking term in ``gain``.

    Args:
        model: Constants of the run.
        work: The rates are written to it.
        memory: Memory of the law.
        is_probed: True for an unknown that increases until its contact slips.
    """
    for k in range(model.num_unknowns):
        learnt = (memory.estimates[k] - memory.initial[k]) / model.law.period
        work.rates[k] = learnt + memory.gain[k]
        if is_probed(model, work, memory, k):
            work.rates[k] += model.law.probing * memory.initial[k]
