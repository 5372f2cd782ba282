"""The scenario editor in a real Chromium: controls at the play head, undo, errors, files."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import Change, ObjectParameters, Pulse, Scenario
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_toml, scenario_to_toml
from slipgrasp.recordings.store.store import RecordingStore
from tests.server.serving import RunningServer
from tests.waiting import wait_until
from tests.web.conftest import Visitors, begin_anew
from tests.web.driving import (
    choose_case_2,
    choose_law,
    number_field,
    pause_at,
    picture,
    select_part,
    set_number,
    slip_at_end,
    unfold_changes,
)

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

MASS, INERTIA = "mass [kg]", "inertia [kg\N{NO-BREAK SPACE}m²]"


@pytest.fixture(autouse=True)
def first_scenario(page: Page, dashboard: RunningServer) -> None:
    """Every test begins with the scenario that a newcomer sees, whichever ran before."""
    begin_anew(page, dashboard)
    unfold_changes(page)
    leave_field(page)


def shows(page: Page, label: str, value: str) -> None:
    expect(number_field(page, label)).to_have_value(value)


def note(page: Page, words: str) -> Locator:
    return page.locator(".sg-editor-note", has_text=words)


def newest(store: RecordingStore) -> ObjectParameters:
    """The object of the run that was saved last."""
    return store.open(store.list(limit=1)[0].id).scenario.object


def drag_object(page: Page, right: float) -> None:
    """Drags what is held to the right [px]; beside it the mouse would turn the picture."""
    box = page.locator("canvas[data-engine]").bounding_box()
    assert box is not None
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.6 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    for share in (0.2, 0.4, 0.6, 0.8, 1.0):
        page.mouse.move(x + share * right, y)
    page.mouse.up()


def leave_field(page: Page) -> None:
    """Takes the focus out of a field: while one types, keys are for the field."""
    page.evaluate("document.activeElement.blur()")


def test_a_control_acts_from_the_play_head_on_leaves_a_ghost_and_is_undone(
    page: Page, dashboard: RunningServer
) -> None:
    store = RecordingStore(dashboard.data_directory)
    slip_before = slip_at_end(page)
    pause_at(page, 0.08)
    note(page, "from 0.08 s on").wait_for()
    timeline = page.locator(".sg-strip").bounding_box()
    set_number(page, MASS, "1.2345")
    note(page, "0.08 s object mass 1.2345 kg").wait_for()
    note(page, "Ghost: the run before").wait_for()
    page.locator(".sg-ghost-lane").first.wait_for()
    # With another height, the view would move.
    assert page.locator(".sg-strip").bounding_box() == timeline
    wait_until(lambda: slip_at_end(page) != slip_before, "the chart did not change")
    page.get_by_text("Saved as").wait_for()
    saved = store.open(store.list(limit=1)[0].id).scenario
    assert saved.changes == (Change(time=0.08, parameter="object.mass", value=1.2345),)
    leave_field(page)
    page.keyboard.press("x")
    note(page, "Ghost:").wait_for(state="detached")
    page.keyboard.press("Control+z")
    shows(page, MASS, "1")
    expect(page.locator(".sg-listed > summary")).to_contain_text("No changes during the run")
    page.keyboard.press("Control+Shift+z")
    shows(page, MASS, "1.2345")
    page.get_by_role("button", name="Remove this change").click()
    shows(page, MASS, "1")
    wait_until(lambda: abs(slip_at_end(page) - slip_before) < 1e-9, "the first run is not back")


def test_the_object_is_dragged_to_push_it(visitors: Visitors) -> None:
    page = visitors.open()  # the shared one may be scrolled, and its object elsewhere
    page.get_by_text("Saved as").wait_for()
    unfold_changes(page)
    pause_at(page, 0.08)
    picture(page)  # Of 0.08 s: the mouse holds the object where it is drawn.
    drag_object(page, 60.0)
    pushed = note(page, "push (").filter(has_not_text="Ghost:")
    expect(pushed).to_be_visible()
    # Of a note that is being drawn anew there is a text, but none to be seen.
    found = re.fullmatch(r"0\.08 s push \((\S+), (\S+)\) N.*", pushed.text_content() or "")
    assert found
    to_the_right, up = map(float, found.groups())
    assert to_the_right > 1.0 and abs(up) < 0.1 * to_the_right
    page.keyboard.press("Control+z")
    pushed.wait_for(state="detached")


def test_a_push_a_low_friction_patch_and_a_pour_happen_at_the_play_head_and_are_undone(
    page: Page, dashboard: RunningServer
) -> None:
    store = RecordingStore(dashboard.data_directory)
    slip_before = slip_at_end(page)
    pause_at(page, 0.08)
    note(page, "from 0.08 s on").wait_for()
    for button, words in (
        ("push", "0.08 s push (0, -5) N for 0.05 s"),
        ("wet patch", "0.08 s low-friction patch on"),
        ("pour", "0.08 s object mass 1.5 kg"),
    ):
        page.get_by_role("button", name=button, exact=True).click()
        note(page, words).wait_for()
    select_part(page, "push 0.08 s")
    set_number(page, "force y [N]", "-12")
    note(page, "push (0, -12) N for 0.05 s").wait_for()
    wait_until(lambda: slip_at_end(page) != slip_before, "the chart did not change")

    def scenario() -> Scenario:
        return store.open(store.list(limit=1)[0].id).scenario

    push = Pulse(time=0.08, force=(0.0, -12.0))
    wait_until(lambda: scenario().pulses == (push,), "the run was not saved")
    assert [patch.start_time for patch in scenario().patches] == [0.08]
    assert [change.time for change in scenario().changes] == [0.08, 0.08]
    title = page.locator(".sg-mark[title*='push (0, -12) N']").get_attribute("title")
    assert title is not None
    assert "low-friction patch" in title
    leave_field(page)
    for gone in (
        "push (0, -12) N",
        "object mass 1.5 kg",
        "low-friction patch on",
        "push (0, -5) N",
    ):
        page.keyboard.press("Control+z")
        # The name of the ghost, the one before, still has it.
        note(page, gone).filter(has_not_text="Ghost:").wait_for(state="detached")
    wait_until(lambda: abs(slip_at_end(page) - slip_before) < 1e-9, "the first run is not back")
    expect(page.locator("label", has_text="force y [N]")).to_have_count(0)


def test_a_typed_number_counts_to_the_last_digit_and_a_wrong_one_is_explained_below_it(
    page: Page, dashboard: RunningServer
) -> None:
    store = RecordingStore(dashboard.data_directory)
    page.get_by_label("controls act").first.click()
    page.get_by_role("option", name="on the whole run").click()
    note(page, "on the whole run").wait_for()
    num_runs = store.count()
    set_number(page, INERTIA, "-1")
    wrong = page.get_by_role("alert").filter(has_text="object.inertia is -1.0")
    wrong.wait_for()
    field, sentence = number_field(page, INERTIA).bounding_box(), wrong.bounding_box()
    assert field is not None
    assert sentence is not None
    assert 0.0 <= sentence["y"] - (field["y"] + field["height"]) < 25.0
    assert page.get_by_text("last valid run").count() == 1
    set_number(page, INERTIA, "0.0123456789")
    wrong.wait_for(state="detached")
    wait_until(lambda: newest(store).inertia == 0.0123456789, "no recording was saved")
    set_number(page, MASS, "4.56789")
    number_field(page, MASS).blur()
    wait_until(lambda: newest(store).mass == 4.56789, "no recording was saved")
    shows(page, MASS, "4.56789")
    saved = [store.open(run.id).scenario for run in store.list(limit=store.count() - num_runs)]
    assert {scenario.object.inertia for scenario in saved} == {0.0123456789}
    page.get_by_role("button", name="reset").click()
    shows(page, MASS, "1")
    shows(page, INERTIA, "0.01042")
    page.get_by_label("controls act").first.click()
    page.get_by_role("option", name="at the play head").click()


def test_a_scenario_is_saved_as_a_file_and_loaded_again(page: Page, tmp_path: Path) -> None:
    pause_at(page, 0.08)
    set_number(page, MASS, "1.4")
    note(page, "object mass 1.4 kg").wait_for()
    page.get_by_text("Saved as").wait_for()
    page.get_by_text("Scenario file (TOML)").click()
    with page.expect_download() as download:
        page.get_by_role("button", name="Save scenario").click()
    content = Path(download.value.path()).read_bytes()
    saved = scenario_from_toml(content, "saved")
    assert saved.changes == (Change(time=0.08, parameter="object.mass", value=1.4),)
    assert tomllib.loads(content.decode()) == tomllib.loads(scenario_to_toml(saved))
    own = tmp_path / "own.toml"
    own.write_text(scenario_to_toml(load_scenario("paper-case-1")).replace("mass = 1.0", "mas = 1"))
    load(page, own)
    page.get_by_role("alert").filter(has_text="Not loaded").wait_for()
    assert page.get_by_text("did you mean 'mass'?").count() == 1
    note(page, "object mass 1.4 kg").wait_for()
    own.write_bytes(content.replace(b"value = 1.4", b"value = 1.6"))
    load(page, own)
    note(page, "object mass 1.6 kg").wait_for()
    expect(page.get_by_label("scenario").first).to_have_value("file own.toml")
    assert page.get_by_role("alert").filter(has_text="Not loaded").count() == 0


def load(page: Page, path: Path) -> None:
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Load scenario").click()
    chooser.value.set_files(path)


def card(scenario: Scenario) -> tuple[str, str]:
    """What the card of a run is headed, and what it says first."""
    verdict = describe_run(simulate(scenario))
    return verdict.headline, " ".join(verdict.sentences[:2])


def test_a_law_chosen_on_the_page_shows_what_it_can_do_and_back_is_the_run_before(
    page: Page,
) -> None:
    case_2 = load_scenario("paper-case-2")
    note = page.get_by_role("status").filter(has_text="pd-gravity on the whole run")

    def tells(told: tuple[str, str]) -> None:
        expect(page.locator(".sg-outcome")).to_contain_text(told[1])
        expect(page.locator(".sg-verdict")).to_have_text(told[0])
        expect(page.get_by_text("Not simulated")).to_have_count(0)

    choose_case_2(page)
    choose_law(page, "pd-gravity")
    note.wait_for()
    tells(card(with_law(case_2, "pd-gravity")))
    leave_field(page)
    page.keyboard.press("Control+z")
    tells(card(case_2))
    expect(note).to_have_count(0)
