"""A custom law in the dashboard: its controls, its signals, and branches at the play head."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.custom_laws import CustomLaw, forget
from slipgrasp.core.scenario.law_loading import load_law
from slipgrasp.core.words.display_name import name_run
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.scenario import SetParameter, Undo
from slipgrasp.web.model.laws import with_law, without_law_change
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.model.selection import LAW_PART, Selection
from slipgrasp.web.model.study import StudyView
from slipgrasp.web.model.study_draft import offers_of
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.panels.controls_panel import ControlsPanel
from slipgrasp.web.panels.study_panel import draft_html
from tests.fenced_blocks import DOCS, blocks_of
from tests.web.conftest import PATIENCE, SMALL
from tests.web.driving import (
    choose_law,
    control,
    number_field,
    overwrite,
    pause,
    pause_at,
    unfold_changes,
)
from tests.web.reducing import AT_REST, after, first_view
from tests.web.serving_process import ServerProcess

LAW, GRIP = "controller.kind", "controller.parameters.grip"


@pytest.fixture(scope="module")
def law_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The law of docs/laws.md that has a parameter and a diagnostic."""
    page = (DOCS / "laws.md").read_text(encoding="utf-8")
    (text,) = (block.text for block in blocks_of(page) if block.file == "declared.py")
    path = tmp_path_factory.mktemp("law") / "declared.py"
    path.write_text(text)
    return path


@pytest.fixture
def squeeze(law_file: Path) -> Iterator[CustomLaw]:
    law = load_law(f"{law_file}:Squeeze")
    yield law
    forget(law.name)


@pytest.fixture
def first(squeeze: CustomLaw) -> Draft:
    return replace_duration(Draft.from_preset("paper-case-2"))


def replace_duration(draft: Draft) -> Draft:
    return draft.edited("simulation.duration", 0.3)


def view_at(time: float, draft: Draft) -> ViewState:
    playback = replace(AT_REST, time=time, window=TimeWindow(0.0, 0.3))
    return first_view(draft=draft, playback=playback, selection=Selection(LAW_PART))


def asked_force(draft: Draft, time: float) -> float:
    """What the law says it asks for at some time of the run, from its trace."""
    result = simulate(draft.scenario())
    row = np.searchsorted(result.trace.times, time, side="right") - 1
    return float(result.trace.diagnostics[row, 0])


def test_a_parameter_of_a_law_is_what_the_law_declares_until_it_is_set(first: Draft) -> None:
    draft = with_law(first, "squeeze", None)
    assert draft.value_at(0.0, GRIP) == 30.0
    assert asked_force(draft, 0.0) == 30.0
    set_by_hand = draft.edited(GRIP, 60.0)
    assert asked_force(set_by_hand, 0.0) == 60.0
    assert "law grip 60" in name_run(set_by_hand.scenario()).split(" · ")


def test_a_law_that_comes_at_the_play_head_is_tuned_from_there_on(first: Draft) -> None:
    view = after(view_at(0.1, first), SetParameter(LAW, "squeeze"), SetParameter(GRIP, 60.0))
    changes = {(each.time, each.key): each.value for each in view.draft.changes}
    assert changes[0.1, GRIP] == 60.0
    assert asked_force(view.draft, 0.05) == 0.0
    # It adds 0.4 N at a tick in which something slips.
    assert 60.0 <= asked_force(view.draft, 0.1) <= 60.4
    later = view.draft.edited_from(0.2, GRIP, 90.0)
    before, then = (asked_force(later, time) for time in (0.199, 0.2))
    assert before == asked_force(view.draft, 0.199)
    assert 30.0 <= then - before <= 30.4
    assert after(view, Undo(), Undo()).draft == first


def test_what_was_set_of_a_law_goes_with_the_law(first: Draft) -> None:
    whole = with_law(first, "squeeze", None).edited(GRIP, 60.0)
    assert with_law(whole, "theorem-4", None) == first
    timed = with_law(first, "squeeze", 0.1).edited_from(0.2, GRIP, 60.0)
    assert timed.scenario().changes[-1].parameter == GRIP
    assert without_law_change(timed, 0.1) == first
    # Also where the scenario came with it.
    stored = Draft.starting_from("a recording", whole.scenario())
    assert stored.value_at(0.0, GRIP) == 60.0
    assert not with_law(stored, "pd-gravity", None).scenario().controller.parameters


def test_the_controls_of_a_law_are_seen_while_it_is_the_law(
    first: Draft, viewer_server: ViewerServer
) -> None:
    panel = ControlsPanel(viewer_server.gui, lambda _: None)
    panel.update(view_at(0.0, first))
    folder = panel.law_folder("squeeze")
    assert not folder.visible
    chosen = with_law(first, "squeeze", None)
    panel.update(view_at(0.0, chosen))
    assert folder.visible
    assert panel.control(GRIP).value == 30.0
    # A law sees this one of the program's settings of a grip, and no other.
    assert panel.control("controller.grip_force").input.visible
    assert not panel.control("controller.grip_rate").input.visible
    panel.update(view_at(0.0, chosen.edited(GRIP, 60.0)))
    assert panel.control(GRIP).value == 60.0
    panel.update(view_at(0.0, first))
    assert not folder.visible
    assert not panel.control("controller.grip_force").input.visible
    assert panel.control(GRIP).value == 30.0


def test_a_recording_of_a_law_that_is_not_here_is_shown(
    first: Draft, viewer_server: ViewerServer
) -> None:
    result = simulate(with_law(first, "squeeze", None).edited(GRIP, 60.0).scenario())
    forget("squeeze")
    assert describe_run(result).headline
    draft = Draft.starting_from("a recording", result.scenario)
    panel = ControlsPanel(viewer_server.gui, lambda _: None)
    panel.update(view_at(0.0, draft))
    assert panel.control(LAW).value == "squeeze"
    assert offers_of(result.scenario) == ()
    assert "law of this scenario is not available" in draft_html(StudyView())


@pytest.fixture
def law_page(browser: Browser, law_file: Path, tmp_path: Path) -> Iterator[Page]:
    """The dashboard of ``slipgrasp serve --law``, at rest."""
    server = ServerProcess(tmp_path / "runs", "--law", f"{law_file}:Squeeze")
    server.start()
    page = browser.new_page(viewport=SMALL)
    page.set_default_timeout(PATIENCE)
    page.goto(f"{server.url}/?fixedDpr=0.3")
    page.locator(".sg-transport").wait_for()
    pause(page)
    yield page
    page.close()
    server.kill()


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection")
def test_a_law_that_the_server_was_started_with_has_controls_signals_and_branches(
    law_page: Page,
) -> None:
    page = law_page
    pause_at(page, 0.0)
    choose_law(page, "squeeze")
    unfold_changes(page)
    expect(control(page, "grip [N]")).to_have_attribute("aria-valuenow", "30")
    pause(page)
    page.get_by_role("tab", name="Estimates", exact=True).click()
    head = page.locator("[data-sg-chart=law-grip]")
    value = head.locator("[data-sg-value]")
    expect(head).to_contain_text("Grip, as reported by the law [N]")
    expect(value).to_have_text("30.00")
    pause_at(page, 0.2)
    overwrite(number_field(page, "grip [N]"), "75")
    expect(value).to_have_text("75.00")
    pause_at(page, 0.1)
    expect(value).to_have_text("30.00")
    expect(page.get_by_text("0.2 s law grip")).to_be_visible()
