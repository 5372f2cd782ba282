"""The kind of the desired motion, from the fields that a scenario gives if it names none."""

from __future__ import annotations

from typing import Any

from slipgrasp.core.scenario.field_errors import single_error
from slipgrasp.core.scenario.parameters import hints_of, split_hint
from slipgrasp.core.scenario.scenario import SCENARIOS
from slipgrasp.core.scenario.space import Space

_FIELD = "trajectory.kind"


def with_motion_kind(mapping: Any, space: Space) -> Any:
    """The scenario with a ``trajectory.kind`` if only one kind uses the fields that are given.

    Without any such field the kind remains the default.

    Args:
        mapping: A scenario as plain values.
        space: Its kind of hand.

    Raises:
        ScenarioError: If no kind uses all of the fields, or several do.
    """
    trajectory = mapping.get("trajectory") if isinstance(mapping, dict) else None
    if not space.has_hand or not isinstance(trajectory, dict) or "kind" in trajectory:
        return mapping
    kinds = {name: used for name, used in _kinds_by_field(space).items() if name in trajectory}
    if not kinds:
        return mapping
    common = set.intersection(*map(set, kinds.values()))
    if len(common) != 1:
        choices = sorted(common or set().union(*kinds.values()))
        raise single_error(
            _FIELD,
            None,
            ", ".join(choices),
            f"{_FIELD} is not given, and trajectory has {', '.join(kinds)}; choose one of "
            f"{', '.join(choices)}",
        )
    return {**mapping, "trajectory": {**trajectory, "kind": common.pop()}}


def _kinds_by_field(space: Space) -> dict[str, tuple[str, ...]]:
    """The kinds of motion that use a field; fields that all kinds use are left out."""
    hints = hints_of(hints_of(SCENARIOS[space])["trajectory"])
    quantities = {name: split_hint(hint)[0] for name, hint in hints.items()}
    return {name: q.used_by for name, q in quantities.items() if q is not None and q.used_by}
