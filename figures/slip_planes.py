"""Every contact in the plane of its face, seen from outside the object.

t_y points to the right and t_x up, as in the dashboard: the path of the fingertip is a curve, and
friction on the object is a curve in the disc or square of its limit.
"""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.core.trace.trace import rows_from_start
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.panels import lighter
from slipgrasp.figures.phases import phase_patches
from slipgrasp.figures.sheet import ending_words
from slipgrasp.figures.style import PAGE_WIDTH, add_axes, add_box, new_figure, paint
from slipgrasp.recordings.palette import CONE, MARK, MUTED, PHASES
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.states import States, drawable, states_of

# Sizes on the page [mm].
_TOP, _TITLE, _KEY = 1.5, 6.0, 6.0
_LABELS, _TICKS, _RIGHT = 14.0, 11.0, 3.0
_LARGEST = 46.0

_LEAST_SPAN = 0.02  # [mm]
_MARGIN = 0.12


def draw_slip_planes(result: RunResult) -> Figure:
    """Draws the path of every fingertip on its face, and below it friction within its limit.

    Args:
        result: A run with slip in two dimensions.

    Returns:
        The figure. Its axes are labelled ``way 1``, ``friction 1`` and so on.
    """
    count = result.trace.shape.num_contacts
    column = PAGE_WIDTH / count
    size = min(column - _LABELS - _RIGHT, _LARGEST)
    height = _TOP + _TITLE + 2.0 * (size + _TICKS) + _KEY * (2 if ending_words(result) else 1)
    figure = new_figure(height)
    for i, name in enumerate(result.scenario.finger_names):
        left = column * i + 0.5 * (column - size + _LABELS - _RIGHT)
        title = add_box(figure, left, _TOP, size, _TITLE)
        of_hand = " fingertip" * result.scenario.space.has_hand
        title.text(0.5, 0.5, f"{name}{of_hand}", ha="center", va="center", fontsize=9.5)
        way = add_axes(figure, left, _TOP + _TITLE, size, size)
        way.set_label(f"way {i + 1}")
        _draw_way(way, result, i)
        friction = add_axes(figure, left, _TOP + _TITLE + size + _TICKS, size, size)
        friction.set_label(f"friction {i + 1}")
        _draw_friction(friction, result, i)
        way.set_ylabel("$s_x$ [mm]" if i == 0 else "", labelpad=2.0)
        friction.set_ylabel(r"$-F_x / (\mu F_n)$" if i == 0 else "", labelpad=2.0)
    _draw_key(figure, result, _TOP + _TITLE + 2.0 * (size + _TICKS))
    return figure


def in_plane(values: Values, contact: int) -> Values:
    """Components along (t_x, t_y) of a contact in all rows, as (right, up): ``(rows, 2)``."""
    return values[:, 2 * contact : 2 * contact + 2][:, ::-1]


def share_of_limit(states: States, contact: int, without: float) -> Values:
    """Friction on the object divided by its limit, as (right, up): ``(n, 2)``.

    Args:
        states: The instants.
        contact: Index of the contact.
        without: The value where there is no limit.
    """
    limit = (states.friction * states.normal_force)[:, contact, None]
    force = -states.tangential_force[:, contact, ::-1]
    return np.divide(force, limit, out=np.full_like(force, without), where=limit > 0.0)


def _draw_way(axes: Axes, result: RunResult, contact: int) -> None:
    rows = rows_from_start(result.trace)
    way = 1e3 * drawable(in_plane(result.trace.slip, contact)[rows])
    _draw_curve(axes, result, contact, way)
    middle = 0.5 * (way.min(axis=0) + way.max(axis=0))
    half = (0.5 + _MARGIN) * max(
        1e3 * float(np.ptp(drawable(result.trace.slip), axis=0).max()), _LEAST_SPAN
    )
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_xlabel("$s_y$ [mm]", labelpad=1.5)
    for place, mark, face in ((way[0], "o", "white"), (way[-1], "o", paint(MARK))):
        axes.plot(*place, marker=mark, markersize=3.5, mfc=face, mec=paint(MARK), zorder=4.0)


def _draw_friction(axes: Axes, result: RunResult, contact: int) -> None:
    """Friction on the object, opposite to x_c and y_c, divided by its limit."""
    states = states_of(result.trace[rows_from_start(result.trace)])
    share = share_of_limit(states, contact, np.nan)
    outline = friction_outline(result.scenario)
    axes.add_patch(Polygon(outline, fc=paint(lighter(CONE, 0.86)), ec=paint(CONE), lw=0.8))
    for draw in (axes.axhline, axes.axvline):
        draw(0.0, color=paint(lighter(MUTED, 0.4)), linewidth=0.5, zorder=1.5)
    _draw_curve(axes, result, contact, drawable(share))
    axes.set_xlim(-1.15, 1.15)
    axes.set_ylim(-1.15, 1.15)
    axes.set_xlabel(r"$-F_y / (\mu F_n)$", labelpad=1.5)


def _draw_curve(axes: Axes, result: RunResult, contact: int, points: Values) -> None:
    """A curve in the colours of the phases."""
    axes.set_aspect("equal")
    phases = result.trace.phase[rows_from_start(result.trace), contact]
    for number in np.unique(phases):
        shown = np.where((phases == number)[:, None], points, np.nan)
        phase = ContactPhase(int(number))
        slips = phase is not ContactPhase.STICK
        axes.plot(
            *shown.T,
            color=paint(PHASES[phase]),
            linewidth=1.6 if slips else 0.9,
            zorder=3.0 if slips else 2.5,
        )


def _draw_key(figure: Figure, result: RunResult, top: float) -> None:
    row = add_box(figure, 0.0, top, PAGE_WIDTH, _KEY)
    dots = [_dot("white", "first contact"), _dot(paint(MARK), "end")]
    handles: list[Artist] = [*phase_patches(result), *dots]
    row.legend(handles=handles, loc="center", ncols=5, handlelength=1.2, handleheight=0.8)
    if ending := ending_words(result):
        row.text(0.5, -0.4, ending, ha="center", va="center")


def _dot(face: str | tuple[float, float, float], label: str) -> Line2D:
    return Line2D([], [], ls="", marker="o", markersize=3.5, mfc=face, mec=paint(MARK), label=label)
