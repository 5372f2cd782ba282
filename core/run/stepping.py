"""A control tick of an externally stepped run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from slipgrasp.core.kernel.compilation.records import Floats
from slipgrasp.core.run.law_code import Shape, answer_views, seer
from slipgrasp.core.scenario.custom_laws import OUTSIDE, custom_law


class Tick:
    """A control tick that waits for its torque.

    Attributes:
        seen: Inputs of a law (docs/laws.md).
    """

    def __init__(self, own: Any, shape: Shape) -> None:
        """Creates the object before the first tick.

        Args:
            own: Record of the law in the kernel.
            shape: Numbers of fingers and estimates.
        """
        law = custom_law(OUTSIDE)
        assert law is not None, "the law 'outside' is always registered"
        self._look: Callable[[], Any] = seer(law, own, shape)
        self._out = answer_views((), own, shape)
        self.seen: Any = None

    def arrive(self) -> Tick:
        """Moves the object to the current tick."""
        self.seen = self._look()
        return self

    @property
    def torque(self) -> Floats:
        """Torque ``(n, 2)``, spatial ``(n, 3)`` [N m]; by default the previous one."""
        return self._out.torque

    @torque.setter
    def torque(self, values: Any) -> None:
        self._out.torque[...] = values

    @property
    def estimates(self) -> Floats:
        """Estimates ``(p,)`` [SI]; by default the previous ones."""
        return self._out.estimates

    @estimates.setter
    def estimates(self, values: Any) -> None:
        self._out.estimates[...] = values
