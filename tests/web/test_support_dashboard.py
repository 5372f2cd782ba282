"""A body on a support in the dashboard: scene, charts, controls, and what is not offered."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions
from slipgrasp.core.scenario.space import SUPPORT
from slipgrasp.recordings.compare.comparison import IncomparableError, compare
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import charts_of
from slipgrasp.web.charts.xy import xy_charts
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.draft import Draft, offered_presets
from slipgrasp.web.model.events import events_of
from slipgrasp.web.model.intents.scenario import AddDisturbance, ChooseLaw, SetParameter
from slipgrasp.web.model.parameter_groups import group_parameters, law_groups
from slipgrasp.web.model.playback import Playback, TimeWindow
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.model.selection import parts_of
from slipgrasp.web.model.study_draft import offers_of
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.panels.compare_panel import findings_html
from slipgrasp.web.panels.outcome_panel import outcome_html, welcome_html
from slipgrasp.web.panels.playback_panel import caption_html
from slipgrasp.web.panels.scenario_panel import ScenarioPanel
from slipgrasp.web.scene.scene import Scene
from slipgrasp.web.standalone.kernel_data import PageError, check_for_page
from tests.web.reducing import after, view_of

UNWANTED = ("finger", "hand", "law", "controller", "desired")


@pytest.fixture(scope="module")
def slide() -> RunResult:
    return simulate(load_scenario("spinning-slide"))


def page(slide: RunResult) -> ViewState:
    return replace(
        view_of(slide),
        draft=Draft.from_preset("spinning-slide"),
        playback=Playback(time=0.1, window=TimeWindow(0.0, 1.0), speed=1.0, playing=False),
    )


def nodes(server: ViewerServer) -> dict[str, viser.SceneNodeHandle]:
    """The nodes of the marks of a slide that are in the scene, by the end of their name."""
    handles = server.scene._handle_from_node_name
    return {
        name[name.index("/slide") :]: each for name, each in handles.items() if "/slide" in name
    }


def test_presets_on_a_support_are_offered() -> None:
    assert {"sliding-block", "spinning-slide"} <= set(offered_presets())


def test_the_scene_shows_body_path_and_friction(
    slide: RunResult, viewer_server: ViewerServer
) -> None:
    scene = Scene(viewer_server)
    layout = scene.show(slide, slide)
    assert (layout.hand_low < layout.hand_high).all()
    sampler = Sampler(slide.trace)
    for time in (0.0, 0.1, 0.5):
        scene.update(sampler.at(time), sampler.at(0.0))
        place = nodes(viewer_server)["/slide/top"].position
        np.testing.assert_allclose(place[:2], sampler.at(time).slip[0], atol=1e-3)
    scene.remove()
    assert nodes(viewer_server) == {}


def test_another_kind_of_scenario_replaces_the_scene(
    slide: RunResult, case_2: RunResult, viewer_server: ViewerServer
) -> None:
    scene = Scene(viewer_server)
    for run in (slide, case_2, slide):
        scene.show(run)
        scene.update(Sampler(run.trace).at(0.1))
        assert ("/slide/top/arrows" in nodes(viewer_server)) == (run is slide)
    scene.remove()


def test_charts_have_finite_lines_and_say_nothing_of_a_hand(slide: RunResult) -> None:
    charts = [chart for tab in charts_of(slide).values() for chart in tab]
    charts += [each.chart for each in xy_charts(slide)]
    assert {"slip", "slip-velocity", "forces", "moments", "spin", "energy"} <= {
        chart.key for chart in charts
    }
    for chart in charts:
        assert all(np.isfinite(line.values).all() for line in chart.lines)
        words = f"{chart.title} {chart.about}".lower()
        assert not any(word in words for word in UNWANTED), words


def test_parts_and_controls_are_those_of_a_slide(slide: RunResult) -> None:
    draft = Draft.from_preset("sliding-block")
    assert [part for part, _ in parts_of(draft)] == ["object", "support", "motion"]
    groups = group_parameters(parameter_definitions(draft.base), draft.base.finger_names)
    keys = {group.part: [e.parameter.key for e in group.entries] for group in groups if group.part}
    assert {"object.mass", "object.inertia"} <= set(keys["object"])
    assert {"support.friction", "support.radius", "support.incline"} <= set(keys["support"])
    assert {"motion.velocity.0", "motion.velocity.2"} <= set(keys["motion"])
    assert law_groups(draft.base) == ()
    assert {"object.mass", "support.friction"} <= {each.key for each in offers_of(draft.base)}


def test_controls_and_pushes_make_another_run_and_laws_do_not(slide: RunResult) -> None:
    view = page(slide)
    moved = after(view, SetParameter("support.friction", 0.4))
    assert moved.draft.scenario() != view.draft.scenario()
    push = after(view, AddDisturbance(DisturbanceKind.PUSH, None))
    assert len(push.draft.scenario().pulses) == 1
    poured = after(view, AddDisturbance(DisturbanceKind.POUR, None))
    assert {change.parameter for change in poured.draft.scenario().changes} == {
        "object.mass",
        "object.inertia",
    }
    assert after(view, AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH, None)).draft == view.draft
    assert after(view, ChooseLaw("composite")).draft == view.draft


def test_the_panel_offers_neither_laws_nor_patches(
    slide: RunResult, viewer_server: ViewerServer
) -> None:
    view = page(slide)
    panel = ScenarioPanel(viewer_server.gui, view.draft, lambda _: None)
    panel.update(view)
    assert panel.laws.content == ""
    assert panel.disturbances.options == ("push", "pour")
    panel.remove()


def test_card_caption_and_events_speak_of_a_body(slide: RunResult) -> None:
    shown = Shown(1, slide, 0.01)
    card = outcome_html(RunStatus(RunStage.SAVED), shown)
    assert "The body slid 100 mm, turned 90.6° and stopped at 0.356 s" in card
    words = [card, caption_html(shown, None, 0.0), welcome_html(SUPPORT)]
    words += [event.text for event in events_of(slide)]
    assert not any(word in text.lower() for text in words for word in UNWANTED)


def test_a_page_that_simulates_is_refused_with_a_way_out(slide: RunResult) -> None:
    with pytest.raises(PageError, match="slipgrasp replay"):
        check_for_page(slide)


def test_two_slides_are_compared_and_a_slide_with_a_hand_is_not(
    slide: RunResult, case_2: RunResult
) -> None:
    other = simulate(load_scenario("sliding-block"))
    html = findings_html(compare(slide, other), slide.scenario.finger_names, (), SUPPORT)
    assert "error of the object" not in html and "slip path" in html
    with pytest.raises(IncomparableError, match="body on a support"):
        compare(slide, case_2)
