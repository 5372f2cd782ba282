"""The part of the scenario whose controls are shown, and the search among all controls."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slipgrasp.core.scenario import RAIL
from slipgrasp.web.model.draft import Draft

OBJECT, LAW_PART = "object", "controller"
PUSH, PATCH = "pulses", "patches"


@dataclass(frozen=True, slots=True)
class Selection:
    """Content of the controls.

    Attributes:
        part: The beginning of the keys of its parameters, such as ``object`` or ``fingers.0``.
        search: Only parameters with these words are shown, of all parts; empty if none.
        all: Whether the controls of all parts are shown.
    """

    part: str = OBJECT
    search: str = ""
    all: bool = False

    @property
    def finger(self) -> int | None:
        """Index of the selected finger; None if another part is selected."""
        kind, _, index = self.part.partition(".")
        return int(index) if kind == "fingers" else None


def finger_part(index: int) -> str:
    """The part of a finger."""
    return f"fingers.{index}"


def parts_of(draft: Draft) -> Iterator[tuple[str, str]]:
    """Every part that can be selected, and its name on the page."""
    yield OBJECT, "object"
    if draft.base.space is RAIL:
        yield from (("finger", "finger"), ("rail", "rail"), (LAW_PART, "law"))
    elif draft.base.space.has_hand:
        for i, name in enumerate(draft.base.finger_names):
            yield finger_part(i), name
        yield LAW_PART, "law"
    else:
        yield from (("support", "support"), ("motion", "start"))
    counts = {PUSH: 0, PATCH: 0}
    for each in draft.disturbances:
        noun = "push" if each.place == PUSH else "wet patch"
        yield f"{each.place}.{counts[each.place]}", f"{noun} {each.time:.4g} s"
        counts[each.place] += 1


def matches(search: str, *texts: str) -> bool:
    """True if every word of a search is in one of some texts, regardless of case."""
    text = " ".join(texts).lower()
    return all(word in text for word in search.lower().split())
