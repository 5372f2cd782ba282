"""All figures of a run by name; those of the paper's two cases carry the paper's numbers."""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.figure import Figure

from slipgrasp.core.run.premises import has_premises
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.figures.panels import Panel, estimate_panels, force_panels, tracking_panels
from slipgrasp.figures.panels_in_space import spatial_force_panels, spatial_tracking_panels
from slipgrasp.figures.premises import premise_panels
from slipgrasp.figures.schematic import draw_schematic
from slipgrasp.figures.sheet import draw_sheet
from slipgrasp.figures.slip_planes import draw_slip_planes
from slipgrasp.figures.style import paper_style

SCHEMATIC, SLIPS = "schematic", "slips"

_Panels = dict[str, Callable[[RunResult], tuple[Panel, ...]]]
_PANELS: _Panels = {
    "tracking": tracking_panels,
    "estimates": estimate_panels,
    "forces": force_panels,
    "premises": premise_panels,
}
_PANELS_IN_SPACE: _Panels = {
    "tracking": spatial_tracking_panels,
    "estimates": estimate_panels,
    "forces": spatial_force_panels,
    "premises": premise_panels,
}

_PAPER_KINDS = (SCHEMATIC, "tracking", "estimates", "forces")
_PAPER_NUMBERS = {"paper-case-1": (4, 5, 6, 7), "paper-case-2": (4, 8, 9, 10)}


def figure_names(scenario: Scenario) -> dict[str, str]:
    """What the figures of a scenario are called.

    Returns:
        Full name by kind, in order: ``schematic``, ``tracking``, ``estimates`` (if
        anything is estimated), ``forces`` and ``premises`` (of the paper's theorems, where they
        speak of it); in a scenario equal to one of the paper's presets ``fig-4-schematic`` and
        so on, where the paper has such a figure. Of a hand in space ``slips`` in place of the
        schematic.
    """
    first = SLIPS if scenario.in_space else SCHEMATIC
    names = {kind: kind for kind in (first, *_panels(scenario))}
    for preset, numbers in _PAPER_NUMBERS.items():
        if scenario == load_scenario(preset):
            numbered = zip(_PAPER_KINDS, numbers, strict=True)
            names |= {kind: f"fig-{number}-{kind}" for kind, number in numbered}
    return names


def draw_figures(result: RunResult) -> dict[str, Figure]:
    """Draws the schematic, tracking and slip, estimates, forces and premises of a run.

    Args:
        result: The run, live or read back from its recording: both give equal figures.

    Returns:
        The figures by name (`figure_names`), to be saved with `write_figures`.
    """
    names = figure_names(result.scenario)
    with paper_style():
        if result.scenario.in_space:
            figures = {names[SLIPS]: draw_slip_planes(result)}
        else:
            figures = {names[SCHEMATIC]: draw_schematic(result.scenario)}
        for kind, panels in _panels(result.scenario).items():
            figures[names[kind]] = draw_sheet(result, panels(result))
    return figures


def _panels(scenario: Scenario) -> _Panels:
    """What each figure made of panels draws, by kind."""
    panels = dict(_PANELS_IN_SPACE if scenario.in_space else _PANELS)
    if not scenario.estimates:
        del panels["estimates"]
    if not has_premises(scenario):
        panels.pop("premises", None)
    return panels
