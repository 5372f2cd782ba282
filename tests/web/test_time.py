"""Time in a real Chromium: keys, the strip, links, and a server that comes back."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from recordings.store import RecordingStore
from tests.server.serving import RunningServer
from tests.web.conftest import PATIENCE, dismiss_warning
from tests.web.driving import pause, pause_at, wait_until
from tests.web.serving_process import ServerProcess
from web.timeline.events import neighbouring_event_time
from web.timeline.playback import slip_window

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

OpenDashboard = Callable[[], Page]


def state(page: Page) -> dict:
    """What the session has told the page last."""
    told = page.locator("#sg-beacon").get_attribute("data-sg-state")
    return json.loads(told or "{}")


def wait_for_time(page: Page, seconds: float) -> None:
    """Waits until the play head rests at a time, in the session and on the page."""

    def rests_there() -> bool:
        told = state(page)
        return not told["playing"] and abs(told["time"] - seconds) < 1e-9

    wait_until(rests_there, f"the play head is not at {seconds} s")
    exact = f"{seconds:.6f}".rstrip("0").rstrip(".")
    expect(page.get_by_label("time [s]", exact=True)).to_have_value(exact)


def test_the_keyboard_alone_plays_steps_jumps_and_chooses(
    open_dashboard: OpenDashboard, dashboard: RunningServer
) -> None:
    page = open_dashboard()
    run = RecordingStore(dashboard.data_directory).open(state(page)["run"])
    window, keyboard = slip_window(run), page.keyboard
    if state(page)["playing"]:
        keyboard.press("Space")
    page.get_by_role("button", name="Play", exact=True).wait_for()
    keyboard.press("Home")
    wait_for_time(page, window.start)
    after = neighbouring_event_time(run, window.start, 1)
    keyboard.press("Shift+ArrowRight")
    wait_for_time(page, after)
    keyboard.press("ArrowRight")
    stepped = float(run.trace.times[run.trace.times > after][0])
    wait_for_time(page, stepped)
    keyboard.press("ArrowLeft")
    wait_for_time(page, after)
    keyboard.press("[")
    wait_for_time(page, window.start)
    keyboard.press("End")
    wait_for_time(page, window.end)
    speed = page.get_by_label("speed", exact=True)
    slow = speed.input_value()
    keyboard.press("ArrowUp")
    expect(speed).not_to_have_value(slow)
    keyboard.press("-")
    expect(speed).to_have_value(slow)
    keyboard.press("w")
    expect(page.get_by_role("button", name="whole run")).to_have_attribute("aria-pressed", "true")
    keyboard.press("z")
    expect(page.get_by_role("button", name="closer")).to_have_attribute("aria-pressed", "true")
    keyboard.press("s")
    expect(page.get_by_role("button", name="slip", exact=True)).to_have_attribute(
        "aria-pressed", "true"
    )
    keyboard.press("?")
    expect(page.get_by_role("dialog", name="Keys")).to_contain_text("Play or pause")
    keyboard.press("Escape")
    field = page.get_by_label("time [s]", exact=True)
    field.fill("0.05")
    field.press("w")
    field.press("Enter")
    wait_for_time(page, 0.05)
    assert state(page)["end"] == window.end
    field.blur()
    keyboard.press("p")
    page.get_by_role("button", name="Pause", exact=True).wait_for()
    expect(page.locator(".sg-clock")).not_to_have_text("50.0 ms")


def test_the_play_head_follows_a_hand_on_the_strip_and_the_address_follows_the_play_head(
    open_dashboard: OpenDashboard,
) -> None:
    page = open_dashboard()
    pause(page)
    told, track = state(page), page.locator("[data-sg-track]")
    box = track.bounding_box()
    assert box is not None
    x, y = box["x"], box["y"] + 0.5 * box["height"]

    def time_at(share: float) -> float:
        return told["start"] + share * (told["end"] - told["start"])

    page.mouse.move(x + 0.2 * box["width"], y)
    page.mouse.down()
    for share in (0.3, 0.4, 0.5, 0.6, 0.75):
        page.mouse.move(x + share * box["width"], y)
    page.mouse.up()
    one_pixel = (told["end"] - told["start"]) / box["width"]
    wait_until(
        lambda: abs(state(page)["time"] - time_at(0.75)) < one_pixel, "it did not follow the hand"
    )
    head = page.locator("[data-sg-track] .sg-head").bounding_box()
    assert head is not None
    assert abs(head["x"] + 1 - (x + 0.75 * box["width"])) < 2.0
    page.locator(".sg-mark").nth(1).click()
    expect(page.get_by_label("time [s]", exact=True)).not_to_have_value(f"{time_at(0.75):.6f}")
    rested = state(page)
    page.wait_for_function(
        """({run, time}) => {
            const query = new URLSearchParams(location.search);
            return query.get("run") === run && Math.abs(Number(query.get("t")) - time) < 1e-6;
        }""",
        arg=rested,
    )


def open_link(browser: Browser, server: RunningServer, query: str) -> Page:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE)
    page.goto(f"{server.url}/?fixedDpr=0.5&{query}")
    page.locator(".sg-transport").wait_for()
    return page


def test_a_link_shows_somebody_else_the_same_run_at_the_same_time(
    browser: Browser, open_dashboard: OpenDashboard, dashboard: RunningServer
) -> None:
    mine = open_dashboard()
    mine.context.grant_permissions(["clipboard-read", "clipboard-write"])
    pause_at(mine, 0.08)
    mine.get_by_role("button", name="Copy link").click()
    mine.locator("[data-sg-copied]").wait_for()
    link = mine.evaluate("navigator.clipboard.readText()")
    run = state(mine)["run"]
    assert link == f"{dashboard.url}/?run={run}&t=0.08"
    mine.close()
    theirs = open_link(browser, dashboard, link.partition("?")[2])
    wait_for_time(theirs, 0.08)
    assert state(theirs)["run"] == run
    theirs.get_by_text("Replay", exact=True).wait_for()
    theirs.close()


def test_a_link_to_nowhere_and_a_session_that_broke_are_told_on_the_page(
    browser: Browser, dashboard: RunningServer
) -> None:
    page = open_link(browser, dashboard, "run=nope&t=soon")
    expect(page.locator("#sg-notice")).to_contain_text("there is no recording 'nope'")
    page.get_by_role("button", name="Dismiss").click()
    expect(page.locator("#sg-notice")).to_have_count(0)
    pause_at(page, 0.05)
    # What a session does when it ends by an error.
    dashboard.app.state.dashboard.directory.remove(state(page)["session"])
    page.locator("#sg-alarm").get_by_text("ended by an internal error").wait_for()
    page.get_by_role("button", name="Start again").click()
    page.locator(".sg-transport").wait_for()
    expect(page.locator("#sg-alarm")).to_have_count(0)
    page.close()


@pytest.fixture
def process(tmp_path: Path) -> Iterator[ServerProcess]:
    process = ServerProcess(tmp_path)
    process.start()
    yield process
    process.kill()


def test_a_page_survives_its_server_and_shows_the_same_again(
    browser: Browser, process: ServerProcess
) -> None:
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.set_default_timeout(PATIENCE)
    page.goto(f"{process.url}/?fixedDpr=0.5")
    page.get_by_text("Saved as").wait_for()
    dismiss_warning(page)
    pause_at(page, 0.08)
    before = state(page)
    page.evaluate("window.sameDocument = true")
    process.kill()
    alarm = page.locator("#sg-alarm")
    alarm.wait_for(timeout=4000)
    expect(alarm).to_contain_text(re.compile("Connection lost.*frozen since [0-9]"))
    process.start()
    wait_until(lambda: state(page)["session"] != before["session"], "it did not come back")
    wait_until(lambda: state(page)["run"] == before["run"], "it shows another run")
    wait_for_time(page, 0.08)
    expect(alarm).to_have_count(0)
    assert page.evaluate("window.sameDocument")
    page.get_by_role("button", name="Next event").click()
    wait_until(lambda: state(page)["time"] > 0.08, "the page is dead")
    page.close()
