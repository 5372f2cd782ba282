"""Figure of the theorems' assumptions: Eq. 20, and the bound of Eq. 55."""

from __future__ import annotations

import numpy as np

from slipgrasp.core.run.premises import find_premises
from slipgrasp.core.run.result import RunResult
from slipgrasp.figures.panels import Curve, Panel, Values, panel_of
from slipgrasp.recordings.palette import CONE


def premise_panels(result: RunResult) -> tuple[Panel, ...]:
    """Eq. 20 along the desired motion; error, disturbance and radius of Eq. 50 to 57."""
    premises, contacts = find_premises(result), tuple(range(result.trace.shape.num_contacts))
    empty = not np.isfinite(premises.radius).any()
    radius = "radius of Eq. 55: none" if empty else "radius of Eq. 55"
    return (
        _panel(
            contacts,
            "eigenvalues of the integral of Eq. 20",
            r"$\log_{10}\lambda$",
            ("least", _log(premises.least_excitation)),
            ("greatest", _log(premises.greatest_excitation)),
        ),
        _panel(
            contacts,
            "error, and the radius that should bound it",
            r"$\log_{10}\Vert r_1\Vert$",
            (r"$\Vert r_1\Vert$", _log(premises.error)),
            (radius, _log(premises.radius)),
        ),
        _panel(
            contacts,
            "disturbance by unknown friction",
            r"$\Vert\tau_d^*\Vert$",
            ("", premises.disturbance),
        ),
        _panel(contacts, "correction of the estimates", r"$\sigma_s$", ("", premises.pull)),
    )


def _log(values: Values) -> Values:
    """Decadic logarithm; NaN (not drawn) for 0 and infinite values."""
    there = np.isfinite(values) & (values > 0.0)
    return np.log10(values, out=np.full(len(values), np.nan), where=there)


def _panel(
    contacts: tuple[int, ...],
    title: str,
    label: str,
    first: tuple[str, Values],
    *limits: tuple[str, Values],
) -> Panel:
    curves = [Curve(label=first[0], values=first[1])]
    curves += [Curve(label=name, colour=CONE, values=v, role="limit") for name, v in limits]
    return panel_of(title, contacts, {label: curves}, with_zero=False)
