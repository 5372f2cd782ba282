"""Warnings about a run."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.trace.types import RunWarning

_COUNTED = (
    (
        "multiple_phases",
        "the forces allowed several combinations of stick and slip; the one with the most "
        "sticking contacts was taken",
    ),
    (
        "recognition_hold",
        "whichever combination of stick and slip the controller assumed, its torque would have "
        "caused another; it kept the previous one for the recognition time",
    ),
    (
        "adaptation_unphysical",
        "an estimate reached its bound and was projected onto it",
    ),
    (
        "torque_limited",
        "the commanded torque exceeded the limits of the joints and was reduced to them",
    ),
)

# For spatial hands only, after the others.
_COUNTED_IN_SPACE = (
    (
        "free_rotation",
        "the contacts lie on a line, and nothing resists rotation of the object about it",
    ),
    (
        "contact_restarts",
        "the contact problem was solved from random initial forces instead of those of stick",
    ),
    (
        "softened",
        "a component of the demand that needs very large forces was omitted",
    ),
    (
        "torsion_split",
        "moments of soft contacts that cancel each other are not determined; the smallest were "
        "used, and such contacts creep",
    ),
)

_GRASP_CODE = "grasp_outside_cones"
_GRASP_MESSAGE = "no grip force met all estimated friction cones; the smallest violation was used"


def describe_warnings(run: Record) -> tuple[RunWarning, ...]:
    """All warnings of a run, each with its count and first time.

    Args:
        run: State of the run in the kernel.
    """
    tally = run["tally"]
    counted = [
        (code, message, count, first)
        for (code, message), count, first in zip(  # noqa: B905
            (*_COUNTED, *_COUNTED_IN_SPACE), run["warning_counts"], run["warning_times"]
        )
    ]
    counted.append((_GRASP_CODE, _GRASP_MESSAGE, tally["violations"], tally["first_violation"]))
    return tuple(
        RunWarning(code=code, message=message, count=int(count), first_time=float(first))
        for code, message, count, first in counted
        if count
    )
