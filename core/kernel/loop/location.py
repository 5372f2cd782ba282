"""Location of the first event of a step."""

from __future__ import annotations

from typing import Any

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.progress import Layouts

LOCATION_WIDTH = 2e-14
LOCATION_SHARE = 1e-13  # relative size that counts as zero


def make_locate(
    layouts: Layouts,
    *,
    step_to: Any,
    least_fired: Any,
    is_past_band: Any,
    keep_first_fired: Any,
    size_of_zero: Any,
    finish: Any,
    bisect_every: int,
) -> Any:
    """Creates the search for one kind of hand.

    Args:
        layouts: Records of this kind of hand.
        step_to: Repeats the step with another size.
        least_fired: Returns the smallest distance of the fired guards from their levels.
        is_past_band: Returns 1 if a fired guard is below its level by more than its band.
        keep_first_fired: Keeps the fired guards that are at their level.
        size_of_zero: Returns the size of values that count as zero, from those at both ends.
        finish: Takes the step to the event, between two given sizes.
        bisect_every: One trial in so many is a bisection.
    """

    @compiled_apart(
        types.float64, layouts.model, layouts.progress, types.float64, prefix=layouts.prefix
    )
    def locate(model: Record, run: Record, h: float) -> float:
        """Size of the step at whose end the first of the fired guards is at its level.

        Regula falsi (Illinois) with bisection as a safeguard. Every trial repeats the step, so that
        the root is that of the method itself and not of an interpolant.
        """
        discrete, step, work, guards = run.discrete, run.step, run.work, run.guards
        low, high, is_far = 0.0, h, False
        value_high = least_fired(model, discrete, step.end, work, guards)
        step_to(model, run, low)
        value_low = least_fired(model, discrete, step.end, work, guards)
        width = LOCATION_WIDTH * max(1.0, run.now)
        nothing = size_of_zero(value_low, value_high)
        side = 0
        for trial in range(100):
            if not value_low > 0.0 or (high - low <= width and not is_far):
                break
            at = (low * value_high - high * value_low) / (value_high - value_low)
            if not low < at < high or trial % bisect_every == bisect_every - 1:
                at = 0.5 * (low + high)
            step_to(model, run, at)
            value = least_fired(model, discrete, step.end, work, guards)
            if abs(value) <= nothing:
                high = at
                break
            if value > 0.0:
                low, value_low = at, value
                value_high *= 0.5 if side == 1 else 1.0
                side = 1
            else:
                high, value_high = at, value
                # Near a pole, a force crosses its full band within the width.
                is_far = is_past_band(model, discrete, guards) == 1
                value_low *= 0.5 if side == -1 else 1.0
                side = -1
        if not value_low > 0.0:
            high = 0.0
        finish(model, run, low, high)
        keep_first_fired(guards, least_fired(model, discrete, step.end, work, guards))
        return high

    return locate
