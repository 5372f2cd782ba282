"""All figures of a run by name; those of the paper's two cases have the paper's numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from slipgrasp.core.run.premises import has_premises
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import PLANAR, RAIL, SPATIAL, SUPPORT, PlanarScenario, Scenario, Space
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.figures.panels import Panel, estimate_panels, force_panels, tracking_panels
from slipgrasp.figures.panels_in_space import spatial_force_panels, spatial_tracking_panels
from slipgrasp.figures.panels_on_rail import rail_force_panels, rail_motion_panels
from slipgrasp.figures.panels_on_support import friction_panels, motion_panels
from slipgrasp.figures.premises import premise_panels
from slipgrasp.figures.schematic import draw_schematic
from slipgrasp.figures.sheet import draw_sheet
from slipgrasp.figures.slip_planes import draw_slip_planes
from slipgrasp.figures.style import paper_style

SCHEMATIC, SLIPS = "schematic", "slips"

_Panels = dict[str, Callable[[RunResult], tuple[Panel, ...]]]
_TRACKING = {
    PLANAR: tracking_panels,
    SPATIAL: spatial_tracking_panels,
    SUPPORT: motion_panels,
    RAIL: rail_motion_panels,
}
_FORCES = {
    PLANAR: force_panels,
    SPATIAL: spatial_force_panels,
    SUPPORT: friction_panels,
    RAIL: rail_force_panels,
}


def _draw_hand(result: RunResult) -> Figure:
    assert isinstance(result.scenario, PlanarScenario), "spatial hands have no schematic"
    return draw_schematic(result.scenario)


_FIRST: Mapping[Space, tuple[str, Callable[[RunResult], Figure]]] = {
    PLANAR: (SCHEMATIC, _draw_hand),
    SPATIAL: (SLIPS, draw_slip_planes),
    SUPPORT: (SLIPS, draw_slip_planes),
}

_PAPER_KINDS = (SCHEMATIC, "tracking", "estimates", "forces")
_PAPER_NUMBERS = {"paper-case-1": (4, 5, 6, 7), "paper-case-2": (4, 8, 9, 10)}


def figure_names(scenario: Scenario) -> dict[str, str]:
    """Names of the figures of a scenario.

    Returns:
        Full name by kind, in order: ``schematic``, ``tracking``, ``estimates`` (if anything is
        estimated), ``forces`` and ``premises`` (assumptions of the theorems, if these apply); in a
        scenario equal to one of the paper's presets ``fig-4-schematic`` and so on, if the paper has
        such a figure. Only planar hands have a schematic, others ``slips``,
        rails neither.
    """
    first = [name for name, _ in _first(scenario)]
    names = {kind: kind for kind in (*first, *_panels(scenario))}
    for preset, numbers in _PAPER_NUMBERS.items():
        if scenario == load_scenario(preset):
            numbered = zip(_PAPER_KINDS, numbers, strict=True)
            names |= {kind: f"fig-{number}-{kind}" for kind, number in numbered}
    return names


def draw_figures(result: RunResult) -> dict[str, Figure]:
    """Draws the schematic, tracking and slip, estimates, forces and assumptions of a run.

    Args:
        result: The run, live or read from its recording: both give equal figures.

    Returns:
        The figures by name (`figure_names`), to be saved with `write_figures`.
    """
    names = figure_names(result.scenario)
    with paper_style():
        figures = {names[first]: draw(result) for first, draw in _first(result.scenario)}
        for kind, panels in _panels(result.scenario).items():
            figures[names[kind]] = draw_sheet(result, panels(result))
    return figures


def _first(scenario: Scenario) -> list[tuple[str, Callable[[RunResult], Figure]]]:
    """The figure without panels; a rail has none."""
    return [_FIRST[scenario.space]] if scenario.space in _FIRST else []


def _panels(scenario: Scenario) -> _Panels:
    """Content of each figure with panels, by kind."""
    panels: _Panels = {
        "tracking": _TRACKING[scenario.space],
        "estimates": estimate_panels,
        "forces": _FORCES[scenario.space],
        "premises": premise_panels,
    }
    if not scenario.estimates:
        del panels["estimates"]
    if not has_premises(scenario):
        panels.pop("premises", None)
    return panels
