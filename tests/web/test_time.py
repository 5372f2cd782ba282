"""Time in a real Chromium: keys, the strip, links, and a server that comes back."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, WebSocket, expect

from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.web.model.events import neighbouring_event_time
from slipgrasp.web.model.playback import slip_window
from tests.server.serving import RunningServer
from tests.waiting import wait_until
from tests.web.conftest import PATIENCE, SMALL, Visitors
from tests.web.driving import (
    choose_case_2,
    number_field,
    pause_at,
    set_number,
    slip_at_end,
    told,
    wait_for_time,
)
from tests.web.serving_process import ServerProcess

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

# Many attempts that came to nothing: each new one is delayed by a second or more from then on,
# as it was by those of an outage of half a minute.
FAIL_TO_CONNECT = """() => {
    const url = location.origin.replace("http", "ws");
    for (let i = 0; i < 150; i += 1) new WebSocket(url).close();
}"""
ASKS_AT_ONCE = """() => {
    const { fetch } = window;
    let asked = false;
    window.fetch = (...request) => (asked = true) && fetch(...request);
    document.querySelector("#sg-alarm button").click();
    window.fetch = fetch;
    return asked;
}"""
BACK_WITHOUT_SESSION = {"alive": False, "server": "another", "full": False}


def test_the_keyboard_alone_plays_steps_jumps_and_chooses(
    page: Page, dashboard: RunningServer
) -> None:
    run = RecordingStore(dashboard.data_directory).open(told(page)["run"])
    window, keyboard = slip_window(run), page.keyboard
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
    assert told(page)["end"] == window.end
    field.blur()
    keyboard.press("p")
    page.get_by_role("button", name="Pause", exact=True).wait_for()
    expect(page.locator(".sg-clock")).not_to_have_text("50.0 ms")
    keyboard.press("Space")
    page.get_by_role("button", name="Play", exact=True).wait_for()


def test_the_play_head_follows_a_hand_on_the_strip_and_the_address_follows_the_play_head(
    page: Page,
) -> None:
    track = page.locator("[data-sg-track]")
    track.hover()  # It stands still then.
    box = track.bounding_box()
    assert box is not None
    x, y = box["x"], box["y"] + 0.5 * box["height"]

    def time_at(share: float) -> float:
        state = told(page)
        return state["start"] + share * (state["end"] - state["start"])

    page.mouse.move(x + 0.2 * box["width"], y)
    page.mouse.down()
    for share in (0.3, 0.4, 0.5, 0.6, 0.75):
        page.mouse.move(x + share * box["width"], y)
    page.mouse.up()
    one_pixel = (time_at(1.0) - time_at(0.0)) / box["width"]
    wait_until(
        lambda: abs(told(page)["time"] - time_at(0.75)) < one_pixel, "it did not follow the hand"
    )
    head = page.locator("[data-sg-track] .sg-head").bounding_box()
    assert head is not None
    assert abs(head["x"] + 1 - (x + 0.75 * box["width"])) < 2.0
    page.locator(".sg-mark").nth(1).click()
    expect(page.get_by_label("time [s]", exact=True)).not_to_have_value(f"{time_at(0.75):.6f}")
    page.wait_for_function(
        """() => {
            const told = JSON.parse(document.getElementById("sg-session-state").dataset.sgState);
            const query = new URLSearchParams(location.search);
            return told.run !== "" && query.get("run") === told.run
                && Math.abs(Number(query.get("t")) - told.time) < 1e-6;
        }"""
    )
    for share in (0.3, 0.7):
        page.get_by_role("button", name="Play", exact=True).click()
        page.get_by_role("button", name="Pause", exact=True).wait_for()
        page.mouse.click(x + share * box["width"], y)
        page.get_by_role("button", name="Play", exact=True).wait_for()
        wait_until(
            lambda share=share: abs(told(page)["time"] - time_at(share)) < one_pixel,
            "it was not caught",
        )
        # What the page held back is void by now: it shows what the session says.
        page.wait_for_function("() => !document.querySelector('[data-sg-time]').matches(':focus')")
        exact = f"{told(page)['time']:.6f}".rstrip("0").rstrip(".")
        expect(page.get_by_label("time [s]", exact=True)).to_have_value(exact)
        clock = page.locator(".sg-clock").inner_text()
        assert float(clock.removesuffix(" ms")) == pytest.approx(1e3 * told(page)["time"], abs=0.06)


def num_preview_workers() -> int:
    return sum(thread.name == "preview" for thread in threading.enumerate())


def test_a_link_shows_the_same_to_somebody_else_who_shares_no_control(
    page: Page, visitors: Visitors, dashboard: RunningServer
) -> None:
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    pause_at(page, 0.08)
    page.locator("[data-sg-chart=slip] .sg-line").first.click()
    page.get_by_text("Slip: left hidden.").wait_for()
    page.get_by_role("button", name="Copy link").click()
    page.locator("[data-sg-copied]").wait_for()
    link = page.evaluate("navigator.clipboard.readText()")
    run = told(page)["run"]
    assert link.startswith(f"{dashboard.url}/?run={run}&t=0.08&charts=")
    theirs = visitors.open(link.partition("?")[2])
    wait_for_time(theirs, 0.08)
    assert told(theirs)["run"] == run
    theirs.get_by_text("Replay", exact=True).wait_for()
    hidden = theirs.locator("[data-sg-chart=slip] .sg-line").first
    expect(hidden).to_have_attribute("aria-pressed", "false")

    slip = slip_at_end(page)
    set_number(page, "mass [kg]", "1.3")
    wait_until(lambda: slip_at_end(page) != slip, "the chart did not change")
    # What comes back after this had every occasion to bring the other's mass with it.
    choose_case_2(theirs)
    expect(number_field(theirs, "mass [kg]")).to_have_value("1")
    assert number_field(page, "mass [kg]").input_value() == "1.3"
    sessions, workers = dashboard.app.state.dashboard.num_sessions, num_preview_workers()
    theirs.close()
    wait_until(lambda: dashboard.app.state.dashboard.num_sessions == sessions - 1, "a session")
    wait_until(lambda: num_preview_workers() == workers - 1, "a worker is still there")


def test_what_goes_wrong_is_told_on_the_page(visitors: Visitors, dashboard: RunningServer) -> None:
    theirs = visitors.open("run=nope")
    expect(theirs.locator("#sg-notice")).to_contain_text("there is no recording 'nope'")
    theirs.get_by_role("button", name="Dismiss").click()
    expect(theirs.locator("#sg-notice")).to_have_count(0)
    # What a session does when it ends by an error.
    dashboard.app.state.dashboard.directory.remove(told(theirs)["session"])
    theirs.locator("#sg-alarm").get_by_text("ended by an internal error").wait_for()
    with theirs.expect_navigation(wait_until="commit"):
        theirs.get_by_role("button", name="Start again").click()


@pytest.fixture
def process(tmp_path: Path) -> Iterator[ServerProcess]:
    process = ServerProcess(tmp_path)
    process.start()
    yield process
    process.kill()


def test_a_page_survives_its_server_and_shows_the_same_again(
    browser: Browser, process: ServerProcess
) -> None:
    page = browser.new_page(viewport=SMALL)
    page.set_default_timeout(PATIENCE)
    page.goto(f"{process.url}/?fixedDpr=0.3")
    page.get_by_text("Saved as").wait_for()
    pause_at(page, 0.08)
    before = told(page)
    page.evaluate("window.sameDocument = true")
    page.evaluate(FAIL_TO_CONNECT)
    process.kill()
    attempts: list[WebSocket] = []
    page.on("websocket", lambda attempt: attempts.append(attempt))
    alarm = page.locator("#sg-alarm")
    expect(alarm).to_contain_text(re.compile("Connection lost.*frozen since [0-9]"))
    # Without effect while it is asking anyway.
    page.wait_for_function(ASKS_AT_ONCE)
    assert attempts == []
    process.start()
    wait_until(lambda: told(page)["session"] != before["session"], "it did not come back")
    wait_until(lambda: told(page)["run"] == before["run"], "it shows another run")
    wait_for_time(page, 0.08)
    expect(alarm).to_have_count(0)
    assert page.evaluate("window.sameDocument")
    page.get_by_role("button", name="Next event").click()
    wait_until(lambda: told(page)["time"] > 0.08, "the page is dead")

    # What the page is told between the return of the server and its new session.
    page.route("**/dashboard/sessions/*", lambda route: route.fulfill(json=BACK_WITHOUT_SESSION))
    expect(alarm).to_contain_text("The server is back.")
    page.wait_for_url(f"**run={before['run']}*")
    with page.expect_navigation(wait_until="commit"):
        page.get_by_role("button", name="Reload now").click()
    assert page.evaluate("window.sameDocument") is None
    page.close()
