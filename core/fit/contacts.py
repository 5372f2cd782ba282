"""Contacts in a fit: slip time, use of friction, and whether the data show slip at all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slipgrasp.core.fit.objective import Objective, run_at
from slipgrasp.core.fit.optimiser import Minimum, minimise
from slipgrasp.core.fit.profile import THRESHOLD_95, Profile, rise_at
from slipgrasp.core.fit.report import ContactInformation
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import rows_from_start

SLIP_RISE = 20.0
"""Rise of chi-squared without slip that shows slip.

Where two contacts stick, noise alone exceeds it in one of 20 000 fits (two degrees of freedom). The
threshold of the intervals would take noise for slip in one of 20.
"""

SAME_FRICTION = 0.05
"""Largest relative distance of a bound without slip from the lower end of the interval with slip.

Data that hardly show whether a contact slips may allow a much smaller friction with another mass.
"""


def contacts_until(run: RunResult, end: float) -> tuple[ContactInformation, ...]:
    """Information about the contacts up to the end of the data, which the run exceeds."""
    trace = run.trace[rows_from_start(run.trace)]
    trace = trace[: np.searchsorted(trace.times, end, side="right")]
    steps = np.diff(trace.times)
    slips = (trace.phase[:-1] != 0) & (trace.phase[1:] != 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        used = np.where(trace.normal_force > 0.0, trace.tangential_size / trace.normal_force, 0.0)
    return tuple(
        ContactInformation(
            contact=k,
            slip_time=float(steps[slips[:, k]].sum()),
            most_used_friction=float(used[:, k].max()),
        )
        for k in range(trace.shape.num_contacts)
    )


@dataclass(frozen=True, slots=True)
class StuckContact:
    """A contact of which the data do not show that it slipped.

    Attributes:
        used: Largest ratio of tangential to normal force in the run without slip.
        rise: Rise of chi-squared without slip.
        limit: Rise that would show slip.
        with_slip: Lower end of the interval, at which the contact slips less than the data show.
    """

    used: float
    rise: float
    limit: float
    with_slip: float

    @property
    def note(self) -> str:
        """A sentence for the report."""
        slipping = (
            f", or {self.with_slip:.4g} if it slipped by less than the data show"
            if self.with_slip < self.used
            else ""
        )
        return (
            "as far as the data show, the contact never slipped (without slip chi-squared rises by "
            f"{self.rise:.3g}, less than {self.limit:.3g}): its friction is at least the largest "
            f"ratio of tangential to normal force, {self.used:.4g}{slipping}"
        )


def stuck_contacts(
    objective: Objective, best: Minimum, profiles: Sequence[Profile], threshold: float
) -> dict[int, StuckContact]:
    """Contacts of which the data do not show that they slipped, by the index of their friction.

    In the best run they may slip a little, because that describes some of the noise; the profile
    may then bound their friction on both sides. So as many friction coefficients as chi-squared
    allows together are fixed at their largest values. Where slip would allow a much smaller
    friction, the profile decides.
    """
    problem = objective.problem
    limit = SLIP_RISE * threshold / THRESHOLD_95
    rises = {
        index: _rise_at_end(objective, best, index, found)
        for index, found in enumerate(profiles)
        if problem.parameters[index].contact is not None
    }
    fixed = sorted((index for index in rises if rises[index] < limit), key=rises.__getitem__)
    for count in range(len(fixed), 0, -1):
        found = minimise(objective, best.shares, dict.fromkeys(fixed[:count], 1.0))
        rise = max(found.chi_squared - best.chi_squared, 0.0)
        if rise < limit:
            run = run_at(problem, problem.values_at(found.shares))
            contacts = contacts_until(run, float(problem.data.times[-1]))
            bounds = {
                index: StuckContact(
                    contacts[contact].most_used_friction,
                    rise,
                    limit,
                    with_slip=problem.parameters[index].value_at(low),
                )
                for index in fixed[:count]
                if (contact := problem.parameters[index].contact) is not None
                and contacts[contact].slip_time == 0.0
                and (low := profiles[index].low) is not None
            }
            return {
                index: bound
                for index, bound in bounds.items()
                if bound.with_slip >= (1.0 - SAME_FRICTION) * bound.used
            }
    return {}


def _rise_at_end(objective: Objective, best: Minimum, index: int, found: Profile) -> float:
    """Rise of chi-squared at the largest value of a parameter."""
    if found.high is None:
        return found.points[-1][1]
    shares = best.shares.copy()
    shares[index] = 1.0
    return rise_at(objective, best, index, shares)
