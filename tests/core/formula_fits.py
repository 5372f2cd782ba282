"""Fits of formulas, whose intervals and minima have closed forms."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.fit.problem import FitProblem, FreeParameter, Observations
from slipgrasp.core.scenario.loading import load_scenario

Model = Callable[[NDArray[np.float64]], NDArray[np.float64]]


def formula_problem(
    starts: Sequence[float], values: NDArray[np.float64], sigma: float = 1.0, key: str = "p{}"
) -> FitProblem:
    """Data of one signal, and parameters between 0 and 1."""
    data = Observations(
        names=("x",),
        units=("m",),
        times=np.arange(len(values)) * 0.01,
        values=values[:, None],
        sigmas=np.array([sigma]),
    )
    parameters = tuple(
        FreeParameter(key=key.format(k), unit="1", low=0.0, high=1.0, start=float(start))
        for k, start in enumerate(starts)
    )
    return FitProblem(scenario=load_scenario("paper-case-1"), parameters=parameters, data=data)


def evaluation_of(model: Model) -> Callable[[Any, Sequence[float]], NDArray[np.float64]]:
    """What a fit takes instead of runs of the scenario."""
    return lambda _, values: model(np.array(values))[:, None]
