"""One tick of a run that is stepped from outside, tick by tick."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from slipgrasp.core.kernel.compilation.records import Floats
from slipgrasp.core.run.law_code import Shape, answer_views, seer
from slipgrasp.core.scenario.custom_laws import OUTSIDE, custom_law


class Tick:
    """A control tick that waits for its torque.

    Attributes:
        seen: What a law would see (docs/laws.md).
    """

    def __init__(self, own: Any, shape: Shape) -> None:
        """Begins before the first tick.

        Args:
            own: The law's part of the run in the kernel.
            shape: How many fingers there are, and how many estimates.
        """
        law = custom_law(OUTSIDE)
        assert law is not None, "the law from outside is always known"
        self._look: Callable[[], Any] = seer(law, own, shape)
        self._out = answer_views((), own, shape)
        self.seen: Any = None

    def arrive(self) -> Tick:
        """The same object at the tick that waits now."""
        self.seen = self._look()
        return self

    @property
    def torque(self) -> Floats:
        """Torque ``(n, 2)``, in space ``(n, 3)``; where it is not set, that before [N m]."""
        return self._out.torque

    @torque.setter
    def torque(self, values: Any) -> None:
        self._out.torque[...] = values

    @property
    def estimates(self) -> Floats:
        """The estimates from now on, ``(p,)``; unless they are set as they were [SI]."""
        return self._out.estimates

    @estimates.setter
    def estimates(self, values: Any) -> None:
        self._out.estimates[...] = values
