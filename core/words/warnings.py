"""Words for what is worth knowing about a run although it did not end it."""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.trace.types import RunWarning

_COUNTED = (
    (
        "multiple_phases",
        "several combinations of phases were consistent; the one with most sticking was taken",
    ),
    (
        "recognition_hold",
        "no phase was consistent under its own torque; "
        "the controller kept its belief for the recognition time",
    ),
    (
        "adaptation_unphysical",
        "an estimate reached its bound and was projected onto it",
    ),
    (
        "torque_limited",
        "the joints could not give the commanded torque; they gave what their limits allow",
    ),
)

# Of spatial hands only, after the others.
_COUNTED_IN_SPACE = (
    (
        "free_rotation",
        "the contacts lie on a line, about which nothing resists that the object turns",
    ),
    (
        "contact_restarts",
        "the contact problem was solved from random forces, not from those of stick",
    ),
    (
        "softened",
        "a part of the demand that only huge forces would have given was given up",
    ),
    (
        "torsion_split",
        "soft contacts can twist the object against each other, and no equation says how far; "
        "the least moments were taken, and such contacts creep",
    ),
)

_GRASP_CODE = "grasp_outside_cones"
_GRASP_MESSAGE = "no squeeze met all estimated friction cones; the least violation was taken"


def describe_warnings(run: Record) -> tuple[RunWarning, ...]:
    """All warnings of a run, each with how often and when first.

    Args:
        run: Its progress in the kernel.
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
