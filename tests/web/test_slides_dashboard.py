"""A body on a support and a finger on a rail in the dashboard, and what is not offered there."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import (
    all_preset_names,
    load_scenario,
    parameter_definitions,
    preset_names,
)
from slipgrasp.core.scenario.space import RAIL, SUPPORT, Space
from slipgrasp.recordings.compare.comparison import IncomparableError, compare
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import charts_of
from slipgrasp.web.charts.xy import xy_charts
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.events import events_of
from slipgrasp.web.model.intents.scenario import AddDisturbance, ChooseLaw, DragObject, SetParameter
from slipgrasp.web.model.parameter_groups import group_parameters, law_groups
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
from tests.web.reducing import after, at, view_of


class Kind(NamedTuple):
    """What is expected of a kind of scenario, shown by one preset and edited from another."""

    space: Space
    preset: str
    charts: set[str]
    edited: str
    parts: list[str]
    keys: dict[str, set[str]]
    offered: tuple[str, ...]
    words: list[str]


ON_SUPPORT = Kind(
    SUPPORT,
    "spinning-slide",
    {"slip", "slip-velocity", "forces", "moments", "spin", "energy"},
    "sliding-block",
    ["object", "support", "motion"],
    {
        "object": {"object.mass", "object.inertia"},
        "support": {"support.friction", "support.radius", "support.incline"},
        "motion": {"motion.velocity.0", "motion.velocity.2"},
    },
    ("push", "pour"),
    ["The body slid 100 mm, turned 90.6° and stopped at 0.356 s"],
)
ON_RAIL = Kind(
    RAIL,
    "drag-slider",
    {"slip", "forces", "normal-forces", "position", "torques", "energy", "xy-cone"},
    "push-slider",
    ["object", "finger", "rail", "controller"],
    {
        "object": {"object.mass"},
        "rail": {"rail.friction"},
        "finger": {"finger.friction"},
        "controller": {"controller.kind", "controller.grip_force"},
    },
    ("pour",),
    [
        "Moved 1000 mm; the fingertip slid 33.9 mm",
        "object starts to slip to the right",
        "fingertip starts to slip to the left",
        "along the rail",
    ],
)
UNWANTED = ("finger", "hand", "law", "controller", "desired")
"""Words that mean nothing to a body on a support."""


@pytest.fixture(scope="module", params=[ON_SUPPORT, ON_RAIL], ids=lambda kind: kind.preset)
def kind(request: pytest.FixtureRequest) -> Kind:
    return request.param


@pytest.fixture(scope="module")
def run(kind: Kind) -> RunResult:
    return simulate(load_scenario(kind.preset))


@pytest.fixture
def view(kind: Kind, run: RunResult) -> ViewState:
    return at(replace(view_of(run), draft=Draft.from_preset(kind.preset)), 0.1)


def nodes(server: ViewerServer, part: str) -> dict[str, viser.SceneNodeHandle]:
    """The nodes below a part of the name."""
    handles = server.scene._handle_from_node_name
    return {name[name.index(part) :]: each for name, each in handles.items() if part in name}


def test_presets_of_the_kind_are_offered(kind: Kind) -> None:
    assert {kind.preset, kind.edited} <= set(all_preset_names())


def test_the_scene_follows_body_and_fingertip(
    kind: Kind, run: RunResult, viewer_server: ViewerServer
) -> None:
    scene = Scene(viewer_server)
    layout = scene.show(run, run)
    assert (layout.hand[0] < layout.hand[1]).all()
    sampler = Sampler(run.trace)
    for time in (0.0, 0.1, 0.5):
        sample = sampler.at(time)
        scene.update(sample, sampler.at(0.0))
        place = nodes(viewer_server, "/slide")["/slide/tip"].position
        if kind.space is SUPPORT:
            np.testing.assert_allclose(place[:2], sample.states.slip[0, 0], atol=1e-3)
            continue
        assert place[0] == pytest.approx(sample.states.object_pose[0, 0], abs=1e-3)
        tip = nodes(viewer_server, "/contact0")["/contact0/tip"].position
        assert tip[0] == pytest.approx(-sample.states.slip[0, 0, 0], abs=1e-3)


def test_another_kind_of_scenario_replaces_the_scene(
    run: RunResult, case_2: RunResult, viewer_server: ViewerServer
) -> None:
    scene = Scene(viewer_server)
    for each in (run, case_2, run):
        scene.show(each)
        scene.update(Sampler(each.trace).at(0.1))
        assert ("/slide/tip/arrows" in nodes(viewer_server, "/slide")) == (each is run)


def test_charts_have_finite_lines_and_say_nothing_foreign(kind: Kind, run: RunResult) -> None:
    charts = [chart for tab in charts_of(run).values() for chart in tab]
    charts += [each.chart for each in xy_charts(run)]
    assert kind.charts <= {chart.key for chart in charts}
    for chart in charts:
        assert all(np.isfinite(line.values).all() for line in chart.lines)
        words = f"{chart.title} {chart.about}".lower()
        assert kind.space is RAIL or not any(word in words for word in UNWANTED), words


def test_a_finger_that_learns_has_charts_of_estimates() -> None:
    assert charts_of(simulate(load_scenario("push-slider")))["Estimates"]


def test_parts_and_controls_are_those_of_the_kind(kind: Kind) -> None:
    draft = Draft.from_preset(kind.edited)
    assert [part for part, _ in parts_of(draft)] == kind.parts
    groups = group_parameters(parameter_definitions(draft.base), draft.base.finger_names)
    found = {group.part: {e.parameter.key for e in group.entries} for group in groups if group.part}
    assert all(keys <= found[part] for part, keys in kind.keys.items())
    used = [each for group in groups for each in group.entries if each.parameter.used_by]
    assert all(draft.value_at(0.0, each.kind_key) is not None for each in used)
    assert law_groups(draft.base) == ()
    friction = f"{kind.parts[-2]}.friction"
    assert {"object.mass", friction} <= {each.key for each in offers_of(draft.base)}


def test_controls_make_another_run_and_what_is_not_offered_does_not(
    kind: Kind, view: ViewState
) -> None:
    moved = after(view, SetParameter(f"{kind.space.name}.friction", 0.4))
    assert moved.draft.scenario() != view.draft.scenario()
    poured = after(view, AddDisturbance(DisturbanceKind.POUR, None))
    assert "object.mass" in {change.parameter for change in poured.draft.scenario().changes}
    pushed = after(view, AddDisturbance(DisturbanceKind.PUSH, None)).draft
    assert (pushed != view.draft) == ("push" in kind.offered)
    unoffered = [AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH, None), ChooseLaw("composite")]
    if kind.space is RAIL:
        unoffered.append(DragObject((1.0,)))
    assert all(after(view, intent).draft == view.draft for intent in unoffered)


def test_the_law_of_a_finger_on_a_rail_is_chosen() -> None:
    view = replace(view_of(simulate(load_scenario("drag-slider"))))
    view = replace(view, draft=Draft.from_preset("drag-slider"))
    law = after(view, SetParameter("controller.kind", "pd-gravity"))
    laws = [c.value for c in law.draft.scenario().changes if c.parameter == "controller.kind"]
    assert laws == ["pd-gravity"]


def test_the_panel_offers_neither_laws_nor_patches(
    kind: Kind, view: ViewState, viewer_server: ViewerServer
) -> None:
    panel = ScenarioPanel(viewer_server.gui, view.draft, lambda _: None)
    panel.update(view)
    assert panel.laws.content == ""
    assert panel.disturbances.options == kind.offered


def test_card_caption_and_events_speak_of_what_is_there(kind: Kind, run: RunResult) -> None:
    shown = Shown(1, run, 0.01)
    card = outcome_html(RunStatus(RunStage.SAVED), shown)
    texts = [card, caption_html(shown, None, 0.0), *(event.text for event in events_of(run))]
    assert all(any(words in text for text in texts) for words in kind.words)
    welcome = welcome_html(kind.space)
    if kind.space is RAIL:
        assert "along a rail" in welcome and "Drag the object" not in welcome
    else:
        texts = [text.lower() for text in (*texts, welcome)]
        assert not any(word in text for text in texts for word in UNWANTED)


def test_a_page_that_simulates_is_refused_with_a_way_out(run: RunResult) -> None:
    with pytest.raises(PageError, match="slipgrasp replay"):
        check_for_page(run)


def test_two_slides_are_compared_and_a_slide_with_a_hand_is_not(case_2: RunResult) -> None:
    slide, other = (simulate(load_scenario(n)) for n in (ON_SUPPORT.preset, ON_SUPPORT.edited))
    html = findings_html(compare(slide, other), slide.scenario.finger_names, (), SUPPORT)
    assert "error of the object" not in html and "slip path" in html
    with pytest.raises(IncomparableError, match="body on a support"):
        compare(slide, case_2)


def test_two_runs_on_rails_are_compared_in_the_coordinate_of_the_rail() -> None:
    a, b = (simulate(load_scenario(name)) for name in preset_names(RAIL)[:2])
    html = findings_html(compare(a, b), a.scenario.finger_names, (), RAIL)
    errors = html.partition("error of the object, at the end")[2].partition("<th colspan")[0]
    assert re.findall(r"<th[^>]*>(\w+) \[(\w+)\]", errors) == [("x", "mm")]
