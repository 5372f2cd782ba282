"""Schematic of a scenario (Fig. 4): the hand in its start pose, the object, its contacts."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from slipgrasp.core.scenario import FingerParameters, PlanarScenario
from slipgrasp.core.scenario.chain import chain_points
from slipgrasp.core.scenario.geometry import ContactFrame, contact_frame, outline
from slipgrasp.figures.marks import Drawing, Frame, Point, new_drawing, unit
from slipgrasp.figures.panels import finger_colour, lighter
from slipgrasp.figures.style import PAGE_WIDTH, add_title, new_figure, paint
from slipgrasp.recordings.palette import (
    CONE,
    GROUND,
    JOINT,
    LINK,
    MARK,
    MOUNT,
    MUTED,
    OBJECT,
    OBJECT_EDGE,
)
from slipgrasp.scene.skeleton import chain_at_start, tip_at_start

# Sizes on the page [mm].
_HEIGHT = 84.0
_TITLE = 6.0
_HAND_WIDTH = 106.0
_HAND_BORDERS = (9.0, 11.0, 9.0, 8.0)
_OBJECT_BORDER = 19.5
_AXIS = 7.0
_TIP = 2.6


class FingerPose(NamedTuple):
    """A planar finger: base, elbow and tip [m], and its two joint angles [rad].

    For slides, the elbow is the first carriage; for a chain, the origin of its second link.
    """

    base: Point
    elbow: Point
    tip: Point
    first: float
    second: float


def draw_schematic(scenario: PlanarScenario) -> Figure:
    """Draws the hand in its start pose, and a close-up of the object with its contact frames.

    Args:
        scenario: Scenario to draw.

    Returns:
        The figure. Its axes are labelled ``a`` for the hand and ``b`` for the object.
    """
    figure = new_figure(_HEIGHT)
    width = PAGE_WIDTH - _HAND_WIDTH
    add_title(figure, "(a) hand at the start", 0.0, 1.5, _HAND_WIDTH, _TITLE)
    add_title(figure, "(b) object and contacts", _HAND_WIDTH, 1.5, width, _TITLE)
    top = 1.5 + _TITLE
    _draw_hand(figure, (0.0, top, _HAND_WIDTH, _HEIGHT - top), scenario)
    _draw_object(figure, (_HAND_WIDTH, top, width, _HEIGHT - top), scenario)
    return figure


def start_pose(scenario: PlanarScenario, index: int) -> FingerPose:
    """Position of a finger whose tip touches the object in its start pose.

    The second joint angle follows from the distance d between base and tip, cos q_2 = (d^2 - l_1^2
    - l_2^2) / (2 l_1 l_2), with the sign of the elbow branch.
    """
    finger = scenario.fingers[index]
    base = np.array(finger.base)
    tip = base + tip_at_start(scenario, index)[:2]
    if finger.kind == "slides":
        return FingerPose(base, np.array([tip[0], base[1]]), tip, 0.0, 0.0)
    if finger.kind == "chain":
        positions = chain_at_start(scenario, index)
        points, _ = chain_points(*finger.chain[1:], positions)
        return FingerPose(base, base + points[1, :2], tip, 0.0, 0.0)
    l1, l2 = finger.link_lengths
    dx, dy = tip - base
    bend = math.acos(min(1.0, max(-1.0, (dx * dx + dy * dy - l1**2 - l2**2) / (2.0 * l1 * l2))))
    second = -bend if finger.elbow == "up" else bend
    first = math.atan2(dy, dx) - math.atan2(l2 * math.sin(second), l1 + l2 * math.cos(second))
    return FingerPose(base, base + l1 * unit(first), tip, first, second)


def _draw_hand(figure: Figure, frame: Frame, scenario: PlanarScenario) -> None:
    poses = [start_pose(scenario, i) for i in range(len(scenario.fingers))]
    x, y, angle = scenario.trajectory.start
    axes = np.stack([unit(angle), unit(angle + 0.5 * math.pi)])
    corners = np.array([x, y]) + outline(scenario.object) @ axes
    points = np.concatenate([corners, *([p.base, p.elbow, p.tip] for p in poses)])
    drawing = new_drawing(figure, frame, points, _HAND_BORDERS, halo=True)
    drawing.axes.set_label("a")
    _draw_outline(drawing, corners)
    for i, (pose, finger) in enumerate(zip(poses, scenario.fingers, strict=True)):
        _draw_finger(drawing, pose, finger, i)
    drawing.dot(corners.mean(axis=0), 3.0, MARK, MARK)
    _draw_world_frame(drawing)


def _draw_outline(drawing: Drawing, corners: Point) -> None:
    """The object."""
    face, edge = paint(OBJECT), paint(OBJECT_EDGE)
    drawing.axes.add_patch(Polygon(corners, facecolor=face, edgecolor=edge, linewidth=0.8))


def _draw_finger(drawing: Drawing, pose: FingerPose, finger: FingerParameters, index: int) -> None:
    """Two links, or bars; of slides, the first is a rail along x."""
    has_links = finger.kind == "links"
    if has_links:
        _draw_mount(drawing, pose.base)
    for start, end in ((pose.base, pose.elbow), (pose.elbow, pose.tip)):
        drawing.line(start, end, colour=JOINT, width=6.4)
        drawing.line(start, end, colour=lighter(LINK, 0.3), width=5.2)
    if has_links:
        _write_lengths(drawing, pose, finger, index)
        _draw_angles(drawing, pose, index)
        drawing.dot(pose.base, 6.0, lighter(LINK, 0.7), JOINT)
    drawing.dot(pose.elbow, 6.0, lighter(LINK, 0.7), JOINT)
    drawing.dot(pose.tip, 5.0, finger_colour(index), JOINT)
    x, y = pose.base
    drawing.write(pose.base + drawing.mm * np.array([0.0, -7.2]), f"({x:.4g}, {y:.4g}) m")


def _write_lengths(
    drawing: Drawing, pose: FingerPose, finger: FingerParameters, index: int
) -> None:
    away = 0.5 * (pose.base + pose.tip)
    joints = (pose.base, pose.elbow, pose.tip)
    for k, direction in enumerate((pose.first, pose.first + pose.second)):
        middle = 0.5 * (joints[k] + joints[k + 1])
        side = unit(direction + 0.5 * math.pi)
        side = side if (middle - away) @ side >= 0.0 else -side
        number = 2 * index + k + 1
        text = f"$l_{{{number}}}$ = {finger.link_lengths[k]:.4g} m"
        drawing.write(middle + 3.6 * drawing.mm * side, text, turn=direction)


def _draw_angles(drawing: Drawing, pose: FingerPose, index: int) -> None:
    reach = 11.0 * drawing.mm
    drawing.line(pose.base, pose.base + reach * unit(0.0), colour=MUTED)
    drawing.line(pose.elbow, pose.elbow + reach * unit(pose.first), colour=MUTED, style="--")
    drawing.angle(pose.base, 0.0, pose.first, 8.0, f"$q_{{{2 * index + 1}}}$")
    direction = pose.first + pose.second
    drawing.angle(pose.elbow, pose.first, direction, 8.0, f"$q_{{{2 * index + 2}}}$")


def _draw_mount(drawing: Drawing, base: Point) -> None:
    outline = np.array([[-3.2, -3.6], [3.2, -3.6], [1.6, 0.0], [-1.6, 0.0]])
    colour = paint(lighter(MOUNT, 0.3))
    mount = Polygon(base + drawing.mm * outline, facecolor=colour, edgecolor=paint(MOUNT))
    mount.set_linewidth(0.6)
    drawing.axes.add_patch(mount)
    left, right = (base + drawing.mm * np.array([x, -3.6]) for x in (-4.8, 4.8))
    drawing.line(left, right, colour=MOUNT, width=1.0)
    for share in np.linspace(0.08, 0.98, 8):
        foot = left + share * (right - left)
        drawing.line(foot, foot - drawing.mm * np.array([1.2, 1.4]), colour=GROUND, width=0.6)


def _draw_world_frame(drawing: Drawing) -> None:
    """The inertial axes in the upper left corner, gravity in the upper right one."""
    mm = drawing.mm
    left, right = drawing.axes.get_xlim()
    top = drawing.axes.get_ylim()[1]
    origin = np.array([left + 5.0 * mm, top - 13.0 * mm])
    for direction, label in ((0.0, "$x$"), (0.5 * math.pi, "$y$")):
        end = origin + _AXIS * mm * unit(direction)
        drawing.arrow(origin, end)
        drawing.write(end + 2.4 * mm * unit(direction), label)
    start = np.array([right - 7.0 * mm, top - 4.0 * mm])
    drawing.arrow(start, start - np.array([0.0, 9.0 * mm]))
    drawing.write(start + mm * np.array([3.0, -4.5]), "$g$")


def _draw_object(figure: Figure, frame: Frame, scenario: PlanarScenario) -> None:
    body, corners = scenario.object, outline(scenario.object)
    below, above = (_clearance(scenario, side) for side in ("bottom", "top"))
    borders = (_OBJECT_BORDER, below + 6.0, _OBJECT_BORDER, above + 8.0)
    drawing = new_drawing(figure, frame, corners, borders, halo=False)
    drawing.axes.set_label("b")
    _draw_outline(drawing, corners)
    for i, finger in enumerate(scenario.fingers):
        _draw_contact(drawing, contact_frame(body, finger), finger, i)
    _draw_object_frame(drawing)
    if not body.corners:
        _draw_dimensions(drawing, scenario)
    _write_properties(drawing, scenario)


def _write_properties(drawing: Drawing, scenario: PlanarScenario) -> None:
    """Mass, inertia and start pose above the object."""
    body, mm = scenario.object, drawing.mm
    x, y, angle = scenario.trajectory.start
    turned = f", $\\theta_o$ = {angle:.4g} rad" if angle else ""
    lines = (
        f"$(x_o, y_o)$ = ({x:.4g}, {y:.4g}) m{turned}",
        f"$m_o$ = {body.mass:.4g} kg,  $I_o$ = {body.inertia:.4g} kg m²",
    )
    lowest = float(outline(body)[:, 1].max()) + (_clearance(scenario, "top") - 0.5) * mm
    for k, text in enumerate(lines):
        drawing.write(np.array([0.0, lowest + 5.0 * k * mm]), text)


def _draw_object_frame(drawing: Drawing) -> None:
    for direction, label in ((0.0, "$x$"), (0.5 * math.pi, "$y$")):
        end = 5.0 * drawing.mm * unit(direction)
        drawing.arrow(np.zeros(2), end, OBJECT_EDGE)
        aside = unit(direction - 0.5 * math.pi)
        drawing.write(end + 2.0 * drawing.mm * aside, label, colour=OBJECT_EDGE)
    drawing.dot(np.zeros(2), 3.0, MARK, MARK)


def _draw_dimensions(drawing: Drawing, scenario: PlanarScenario) -> None:
    """Half width or radius below the object, half length next to it, away from the fingers."""
    mm, body = drawing.mm, scenario.object
    width, length = body.half_sizes
    low = -length - _clearance(scenario, "bottom") * mm
    far = width + _clearance(scenario, "right") * mm
    over = 1.5 * mm
    drawing.line(np.array([0.0, -2.0 * mm]), np.array([0.0, low - over]), colour=MUTED)
    drawing.line(np.array([width, -length - mm]), np.array([width, low - over]), colour=MUTED)
    drawing.arrow(np.array([0.0, low]), np.array([width, low]), both=True, width=0.5)
    name = r"$\rho$" if body.is_round else "$L_o$"
    drawing.write(np.array([0.5 * width, low - 3.0 * mm]), f"{name} = {width:.4g} m")
    if body.is_round:
        return
    drawing.line(np.array([width - 5.0 * mm, 0.0]), np.array([far + over, 0.0]), colour=MUTED)
    drawing.line(np.array([width + mm, length]), np.array([far + over, length]), colour=MUTED)
    drawing.arrow(np.array([far, 0.0]), np.array([far, length]), both=True, width=0.5)
    label = np.array([far + 2.8 * mm, 0.5 * length])
    drawing.write(label, f"{length:.4g} m", turn=0.5 * math.pi)


def _clearance(scenario: PlanarScenario, side: str) -> float:
    """Distance of a label from a side of the object [mm]."""
    return 15.0 if any(_side(scenario, finger) == side for finger in scenario.fingers) else 5.0


def _side(scenario: PlanarScenario, finger: FingerParameters) -> str:
    """The side of the object with a given finger."""
    x, y = contact_frame(scenario.object, finger).normal
    if abs(x) > abs(y):
        return "left" if x > 0.0 else "right"
    return "bottom" if y > 0.0 else "top"


def _draw_contact(
    drawing: Drawing, frame: ContactFrame, finger: FingerParameters, index: int
) -> None:
    """The fingertip, its frame (x_c, n), the direction of positive slip and the friction cone."""
    mm, number, colour = drawing.mm, index + 1, finger_colour(index)
    anchor, tangent, normal = (np.array(v) for v in (frame.anchor, frame.tangent, frame.normal))
    cone = [anchor + 8.0 * mm * (normal + sign * finger.friction * tangent) for sign in (1, -1)]
    white = paint(lighter(CONE, 0.72))
    drawing.axes.add_patch(Polygon([anchor, *cone], facecolor=white, edgecolor="none"))
    centre = anchor - 0.5 * _TIP * mm * normal
    drawing.line(centre, centre - 6.0 * mm * normal, colour=lighter(LINK, 0.3), width=5.2)
    drawing.dot(centre, _TIP * 72.0 / 25.4, colour, JOINT)
    drawing.arrow(anchor, anchor + _AXIS * mm * normal, colour)
    n_label = anchor + mm * (_AXIS * normal - 2.6 * tangent)
    drawing.write(n_label, f"$n_{number}$", colour=colour)
    drawing.arrow(anchor, anchor - _AXIS * mm * tangent, colour)
    x_label = anchor - mm * ((_AXIS - 1.0) * tangent - 3.0 * normal)
    drawing.write(x_label, f"$x_{{c{number}}}$", colour=colour)
    slip = anchor - 4.0 * mm * normal
    drawing.arrow(slip + 2.0 * mm * tangent, slip + 10.0 * mm * tangent, MARK)
    drawing.write(slip + mm * (6.0 * tangent - 5.0 * normal), f"$s_{number}>0$")
    # Text is wide: it needs more space next to a vertical normal than above a horizontal one.
    across, along = (4.6, 7.8) if abs(normal[0]) > 0.5 else (8.5, 4.5)
    friction = anchor + mm * (across * tangent + along * normal)
    drawing.write(friction, rf"$\mu_{number}$ = {finger.friction:.4g}")
