"""A finger on a rail in the dashboard: scene, charts, controls, and what is not offered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions
from slipgrasp.core.scenario.space import RAIL
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import charts_of
from slipgrasp.web.charts.xy import xy_charts
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.draft import Draft, offered_presets
from slipgrasp.web.model.events import events_of
from slipgrasp.web.model.intents.scenario import (
    AddDisturbance,
    ChooseLaw,
    DragObject,
    SetParameter,
)
from slipgrasp.web.model.parameter_groups import group_parameters, law_groups
from slipgrasp.web.model.playback import Playback, TimeWindow
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.model.selection import parts_of
from slipgrasp.web.model.study_draft import offers_of
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.panels.outcome_panel import outcome_html, welcome_html
from slipgrasp.web.panels.playback_panel import caption_html
from slipgrasp.web.panels.scenario_panel import ScenarioPanel
from slipgrasp.web.scene.scene import Scene
from slipgrasp.web.standalone.kernel_data import PageError, check_for_page
from tests.web.reducing import after, view_of


@pytest.fixture(scope="module")
def drag() -> RunResult:
    return simulate(load_scenario("drag-slider"))


def page(drag: RunResult) -> ViewState:
    return replace(
        view_of(drag),
        draft=Draft.from_preset("drag-slider"),
        playback=Playback(time=0.5, window=TimeWindow(0.0, 5.0), speed=1.0, playing=False),
    )


def nodes(server: ViewerServer, part: str) -> dict[str, viser.SceneNodeHandle]:
    """The nodes below a part of the name."""
    handles = server.scene._handle_from_node_name
    return {name[name.index(part) :]: each for name, each in handles.items() if part in name}


def test_presets_on_a_rail_are_offered() -> None:
    assert offered_presets()[-2:] == ("drag-slider", "push-slider")


def test_the_scene_shows_rail_finger_and_both_contacts(
    drag: RunResult, viewer_server: ViewerServer
) -> None:
    scene = Scene(viewer_server)
    layout = scene.show(drag, drag)
    assert (layout.hand_low < layout.hand_high).all()
    sampler = Sampler(drag.trace)
    for time in (0.0, 1.0, 3.0):
        sample = sampler.at(time)
        scene.update(sample, sampler.at(0.0))
        place = nodes(viewer_server, "/slide")["/slide/top"].position
        assert place[0] == pytest.approx(sample.object_pose[0], abs=1e-3)
        tip = nodes(viewer_server, "/contact0")["/contact0/tip"].position
        assert tip[0] == pytest.approx(-sample.slip[0, 0], abs=1e-3)
    scene.remove()
    assert nodes(viewer_server, "/slide") == {}


def test_charts_have_finite_lines(drag: RunResult) -> None:
    charts = [chart for tab in charts_of(drag).values() for chart in tab]
    charts += [each.chart for each in xy_charts(drag)]
    expected = {"slip", "forces", "normal-forces", "position", "torques", "energy", "xy-cone"}
    assert expected <= {chart.key for chart in charts}
    for chart in charts:
        assert all(np.isfinite(line.values).all() for line in chart.lines)
    learns = simulate(load_scenario("push-slider"))
    assert charts_of(learns)["Estimates"]


def test_parts_and_controls_are_those_of_a_rail() -> None:
    draft = Draft.from_preset("push-slider")
    assert [part for part, _ in parts_of(draft)] == ["object", "finger", "rail", "controller"]
    groups = group_parameters(parameter_definitions(draft.base), draft.base.finger_names)
    keys = {group.part: [e.parameter.key for e in group.entries] for group in groups if group.part}
    assert "object.mass" in keys["object"]
    assert "rail.friction" in keys["rail"]
    assert "finger.friction" in keys["finger"]
    assert {"controller.kind", "controller.grip_force"} <= set(keys["controller"])
    for group in groups:
        for each in group.entries:
            if each.parameter.used_by:
                assert draft.value_at(0.0, each.kind_key) is not None
    assert law_groups(draft.base) == ()
    assert {"object.mass", "rail.friction"} <= {each.key for each in offers_of(draft.base)}


def test_controls_make_another_run_and_pushes_do_not(drag: RunResult) -> None:
    view = page(drag)
    for key, value in (("rail.friction", 0.2), ("controller.grip_force", 20.0)):
        moved = after(view, SetParameter(key, value))
        assert moved.draft.scenario() != view.draft.scenario()
    law = after(view, SetParameter("controller.kind", "pd-gravity"))
    laws = [c.value for c in law.draft.scenario().changes if c.parameter == "controller.kind"]
    assert laws == ["pd-gravity"]
    poured = after(view, AddDisturbance(DisturbanceKind.POUR, None))
    assert "object.mass" in {change.parameter for change in poured.draft.scenario().changes}
    for unoffered in (DisturbanceKind.PUSH, DisturbanceKind.LOW_FRICTION_PATCH):
        assert after(view, AddDisturbance(unoffered, None)).draft == view.draft
    assert after(view, DragObject((1.0,))).draft == view.draft
    assert after(view, ChooseLaw("composite")).draft == view.draft


def test_the_panel_offers_only_to_add_mass(drag: RunResult, viewer_server: ViewerServer) -> None:
    view = page(drag)
    panel = ScenarioPanel(viewer_server.gui, view.draft, lambda _: None)
    panel.update(view)
    assert panel.laws.content == ""
    assert panel.disturbances.options == ("pour",)
    panel.remove()


def test_card_caption_and_events_speak_of_fingertip_and_object(drag: RunResult) -> None:
    shown = Shown(1, drag, 0.01)
    card = outcome_html(RunStatus(RunStage.SAVED), shown)
    assert "Moved 1000 mm, the fingertip slid 33.9 mm" in card
    texts = [event.text for event in events_of(drag)]
    assert "object starts to slip to the right" in texts
    assert "fingertip starts to slip to the left" in texts
    assert "along the rail" in caption_html(shown, None, 0.0)
    assert "along a rail" in welcome_html(RAIL) and "Drag the object" not in welcome_html(RAIL)


def test_a_page_that_simulates_is_refused_with_a_way_out(drag: RunResult) -> None:
    with pytest.raises(PageError, match=r"rail.*slipgrasp replay"):
        check_for_page(drag)
