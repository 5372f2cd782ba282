"""Parameters that an adaptive controller can estimate, named by dotted keys."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Literal, NamedTuple

from slipgrasp.core.scenario import FingerParameters, Scenario
from slipgrasp.core.scenario.spatial import SpatialFinger


class Unknown(NamedTuple):
    """Kind, finger and link of an unknown parameter (-1 if not applicable).

    For an inertia of a spatial object, the link is the index of its axis.
    """

    kind: Literal["object_mass", "object_inertia", "friction", "link_mass"]
    finger: int
    link: int


PHYSICAL_BOUNDS: Mapping[str, tuple[float, float]] = {
    "friction": (0.05, 2.0),
    "object_mass": (0.05, 10.0),
    "link_mass": (0.05, 10.0),
    "object_inertia": (0.002, 0.2),
}
"""Usual bounds of an unknown of each kind, SI units."""

_FINGER = re.compile(r"fingers\.(\d{1,2})\.")
_FRICTION = re.compile(r"fingers\.(\d{1,2})\.friction")


def parse_unknown(scenario: Scenario, key: str) -> Unknown | None:
    """Returns the unknown of a dotted key, or None if it cannot be estimated."""
    if key == "object.mass":
        return Unknown("object_mass", -1, -1)
    inertias = scenario.space.inertias
    if key in inertias:
        return Unknown("object_inertia", -1, inertias.index(key) if len(inertias) > 1 else -1)
    if match := _FRICTION.fullmatch(key):
        finger = int(match[1])
        return Unknown("friction", finger, -1) if finger < len(scenario.fingers) else None
    match = _FINGER.match(key)
    finger = int(match[1]) if match else len(scenario.fingers)
    if finger < len(scenario.fingers) and key in (keys := mass_keys(scenario, finger)):
        return Unknown("link_mass", finger, keys.index(key))
    return None


def unknown_of(scenario: Scenario, key: str) -> Unknown:
    """Returns the unknown of an estimate of a scenario, by dotted key."""
    unknown = parse_unknown(scenario, key)
    assert unknown is not None, "validated scenarios name only what can be estimated"
    return unknown


def mass_keys(scenario: Scenario, finger: int) -> tuple[str, ...]:
    """Dotted keys of the masses of a finger: of its links, or of its slides."""
    if finger in scenario.slides:
        return (f"fingers.{finger}.mass",)
    own = scenario.fingers[finger]
    if isinstance(own, FingerParameters | SpatialFinger) and own.kind == "chain":
        links = range(len(own.joints))
        return tuple(f"fingers.{finger}.joints.{link}.mass" for link in links)
    masses = own.link_masses
    return tuple(f"fingers.{finger}.link_masses.{link}" for link in range(len(masses)))


def name_unknown(scenario: Scenario, key: str) -> str:
    """Returns the name of an unknown: ``the friction of the left fingertip``."""
    unknown = unknown_of(scenario, key)
    if unknown.kind == "object_mass":
        return "the mass of the object"
    if unknown.kind == "object_inertia":
        axis = f" about its {'xyz'[unknown.link]} axis" if unknown.link >= 0 else ""
        return f"the moment of inertia of the object{axis}"
    finger = scenario.finger_names[unknown.finger]
    if unknown.kind == "friction":
        return f"the friction of the {finger} fingertip"
    if unknown.finger in scenario.slides:
        return f"the moving mass of the {finger} finger"
    return f"the mass of link {unknown.link + 1} of the {finger} finger"


def unit_of_unknown(scenario: Scenario, key: str) -> str:
    """SI unit of an unknown after a space; empty for friction."""
    kind = unknown_of(scenario, key).kind
    return {"friction": "", "object_inertia": " kg m²"}.get(kind, " kg")
