"""The control laws by number."""

from __future__ import annotations

(
    THEOREM_3,
    THEOREM_4,
    CERTAINTY_EQUIVALENCE,
    PD_GRAVITY,
    GRIP_REFLEX,
    COMPOSITE,
) = range(6)

KINDS = {
    "theorem-3": THEOREM_3,
    "theorem-4": THEOREM_4,
    "certainty-equivalence": CERTAINTY_EQUIVALENCE,
    "pd-gravity": PD_GRAVITY,
    "grip-reflex": GRIP_REFLEX,
    "composite": COMPOSITE,
}
