"""What the marks in the picture of a run need besides its instants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.sampling import Sample
from slipgrasp.web.scene.layout import SceneLayout, nice_at_least
from slipgrasp.web.scene.marks import FullScale

_LEAST_FULL_FORCE = 1.0
_LEAST_FULL_SPEED = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class RunFacts:
    """What the marks of a run need besides its instants.

    Attributes:
        full: What an arrow of full length stands for.
        beliefs: Where the estimate of each friction coefficient stands, None if it is known.
        magnification: How much larger than life the lenses show slip.
    """

    full: FullScale
    beliefs: tuple[int | None, ...]
    magnification: float

    def believed(self, sample: Sample, contact: int) -> float | None:
        """What the controller believes a friction coefficient to be, None if it knows it."""
        place = self.beliefs[contact]
        return None if place is None else max(float(sample.estimates[place]), 0.0)


def run_facts(result: RunResult, layout: SceneLayout, force_scale: float) -> RunFacts:
    """What the marks of a run need.

    Args:
        result: The run.
        layout: Where everything is.
        force_scale: How much longer than usual the user wants the arrows of forces.
    """
    unknowns = result.trace.shape.unknowns
    keys = [f"fingers.{i}.friction" for i in range(len(result.scenario.fingers))]
    full = _full_scale(result)
    return RunFacts(
        full=full._replace(force=full.force / force_scale),
        beliefs=tuple(unknowns.index(key) if key in unknowns else None for key in keys),
        magnification=layout.magnification,
    )


def _full_scale(result: RunResult) -> FullScale:
    """Round numbers, so that arrows of similar runs compare; a short peak may be longer."""
    forces = np.abs(result.trace.normal_force)
    usual = max(float(np.median(forces)), 0.4 * float(forces.max()))
    speed = float(np.abs(result.trace.slip_velocity).max())
    return FullScale(
        nice_at_least(max(usual, _LEAST_FULL_FORCE)), nice_at_least(max(speed, _LEAST_FULL_SPEED))
    )
