"""The links and joints of a hand from its URDF file."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from slipgrasp.core.scenario.field_errors import shortened
from slipgrasp.core.scenario.hand_files.description import (
    AT_ORIGIN,
    UPPER,
    Body,
    Floats,
    Follows,
    Joint,
    Pose,
    pose_of,
    refusal,
)

_ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def read_urdf(text: str) -> tuple[dict[str, Body], list[Joint]]:
    """Links by name, and the joints between them.

    Args:
        text: The file.

    Raises:
        ScenarioError: If the file is not a valid description of links and joints.
    """
    if "<!" in text.replace("<!--", ""):
        raise refusal("a document type", "none", "a URDF file has no document type; remove it")
    try:
        root = ElementTree.fromstring(text)
        bodies = {each.get("name", ""): _body_of(each) for each in root.findall("link")}
        return bodies, [_joint_of(each) for each in root.findall("joint")]
    except (ElementTree.ParseError, ValueError) as error:
        raise refusal("the file", "URDF", f"the file cannot be read as URDF: {error}") from None


def _body_of(link: ElementTree.Element) -> Body:
    inertial = link.find("inertial")
    if inertial is None:
        return Body(0.0, np.zeros(3), np.zeros((3, 3)))
    mass = float(_attribute_of(inertial, "mass", "value"))
    given, inertia = inertial.find("inertia"), np.zeros((3, 3))
    if given is not None:
        for (a, b), name in zip(zip(*UPPER, strict=True), _ENTRIES, strict=True):
            inertia[a, b] = inertia[b, a] = float(given.get(name, "0"))
    return Body(mass, np.zeros(3), inertia).seen_from(pose_in(inertial))


def _joint_of(joint: ElementTree.Element) -> Joint:
    axis, limit = joint.find("axis"), joint.find("limit")
    direction = np.array([1.0, 0.0, 0.0]) if axis is None else vector(axis.get("xyz", "1 0 0"))
    low = high = most = None
    if limit is not None:
        most = float(limit.get("effort", "0")) or None
        if joint.get("type") != "continuous":
            low, high = (float(limit.get(name, "0")) for name in ("lower", "upper"))
    return Joint(
        joint.get("name", ""),
        joint.get("type", ""),
        _attribute_of(joint, "parent", "link"),
        _attribute_of(joint, "child", "link"),
        pose_in(joint),
        direction / np.linalg.norm(direction),
        low,
        high,
        most,
        _follows_of(joint.find("mimic")),
    )


def _follows_of(mimic: ElementTree.Element | None) -> Follows | None:
    if mimic is None:
        return None
    ratio, offset = (float(mimic.get(*each)) for each in (("multiplier", "1"), ("offset", "0")))
    return Follows(mimic.get("joint", ""), ratio, offset)


def _attribute_of(element: ElementTree.Element, name: str, attribute: str) -> str:
    """A required attribute of a required child element."""
    child = element.find(name)
    value = None if child is None else child.get(attribute)
    if value is None:
        raise ValueError(f"there is no '{attribute}' of '{name}' in '{element.tag}'")
    return value


def pose_in(element: ElementTree.Element) -> Pose:
    """The pose of an element, from its ``origin``.

    Raises:
        ValueError: If it does not consist of numbers.
    """
    origin = element.find("origin")
    if origin is None:
        return AT_ORIGIN
    return pose_of(vector(origin.get("xyz", "0 0 0")), vector(origin.get("rpy", "0 0 0")))


def vector(text: str) -> Floats:
    """Three numbers.

    Raises:
        ValueError: If the text contains others.
    """
    numbers = np.array([float(part) for part in text.split()])
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f"'{shortened(text)}' is not three numbers")
    return numbers
