"""Stored runs in a real Chromium: opened, renamed, deleted, sent, and compared."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Locator, Page, expect

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.store.store import RecordingStore
from tests.server.serving import RunningServer
from tests.waiting import wait_until
from tests.web.conftest import Visitors
from tests.web.driving import fill, number_field, pause

pytestmark = [
    pytest.mark.browser,
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]


def store_of(running: RunningServer) -> RecordingStore:
    return running.app.state.run_service.store


@pytest.fixture
def listed(
    page: Page, shared: Visitors, dashboard: RunningServer, case_1: RunResult, sluggish: RunResult
) -> Iterator[Page]:
    """The page, with the tab of the stored runs in front: Q = 1 and Q = 20 of case I."""
    store = store_of(dashboard)
    for run in store.list():
        if run.name.startswith("Q = "):
            store.delete(run.id)
    store.annotate(store.save(sluggish).id, name="Q = 1")
    store.annotate(store.save(case_1).id, name="Q = 20")
    page.get_by_role("tab", name="Recordings").click()
    for words in ("", "Q = "):
        fill(number_field(page, "find"), words)
    expect(page.locator(".sg-row")).to_have_count(2)
    yield page
    page.get_by_role("tab", name="Recordings").click()
    fill(number_field(page, "find"), "")
    # Browsers complain by themselves of a file that the server does not keep.
    shared.complaints = [words for words in shared.complaints if " 422 " not in words]


def row(page: Page, words: str) -> Locator:
    return page.locator(".sg-row", has_text=words)


def open_row(page: Page, words: str) -> None:
    row(page, words).get_by_label("Open ").click()
    expect(row(page, words).get_by_text("on screen")).to_be_visible()
    pause(page)  # A picture that plays takes the time of everything else.


def test_a_run_is_found_opened_renamed_and_deleted_and_others_deletions_are_told(
    listed: Page, dashboard: RunningServer
) -> None:
    page = listed
    number_field(page, "find").fill("q = 2")
    expect(page.locator(".sg-row")).to_have_count(1)
    open_row(page, "Q = 20")
    chosen = row(page, "Q = 20").get_by_role("button").first
    chosen.focus()
    chosen.press("Enter")
    page.get_by_text("Name and tags").click()
    fill(number_field(page, "name"), "Q = 20, for the report")
    fill(number_field(page, "tags"), "report, slip")
    number_field(page, "tags").press("Enter")
    expect(row(page, "for the report").get_by_text("report", exact=True)).to_be_visible()
    store = store_of(dashboard)
    kept = next(run for run in store.list() if run.name == "Q = 20, for the report")
    assert kept.tags == ("report", "slip")
    page.get_by_role("button", name="Delete …").click()
    question = page.get_by_role("dialog")
    expect(question.get_by_text("Q = 20, for the report")).to_be_visible()
    question.get_by_role("button", name="Cancel").click()
    expect(question).to_have_count(0)
    page.get_by_role("button", name="Delete …").click()
    question.get_by_role("button", name="Delete", exact=True).click()
    page.get_by_text("No stored run matches.").wait_for()
    assert kept.id not in {run.id for run in store.list()}
    number_field(page, "find").fill("Q = ")
    row(page, "Q = 1").get_by_role("button").first.click()
    page.get_by_text("Chosen run").wait_for()
    other = next(run for run in store.list() if run.name == "Q = 1")
    store.delete(other.id)
    page.get_by_text(f"Run {other.id} is no longer stored.").wait_for()
    expect(page.locator(".sg-row")).to_have_count(0)


def test_a_damaged_file_is_refused_in_words_and_a_whole_one_is_kept_and_chosen(
    listed: Page, dashboard: RunningServer, case_1: RunResult, tmp_path: Path
) -> None:
    page = listed
    whole, damaged = tmp_path / "whole.mcap", tmp_path / "damaged.mcap"
    write_recording(case_1, whole)
    content = bytearray(whole.read_bytes())
    content[len(content) // 2] ^= 0xFF
    damaged.write_bytes(content)
    store = store_of(dashboard)
    before = store.count()
    sending = page.locator("[data-sg-upload] input")
    sending.set_input_files(damaged)
    answer = page.locator(".sg-upload-answer[role=status]")  # There may be one of an export, too.
    expect(answer).to_contain_text("damaged.mcap is not kept: ")
    expect(answer).to_contain_text("is damaged")
    assert store.count() == before
    sending.set_input_files(whole)
    expect(answer).to_contain_text("whole.mcap is kept as ")
    assert store.count() == before + 1
    newest = store.list()[0]
    page.locator(".sg-facts").get_by_text(newest.id).wait_for()
    assert newest.path.read_bytes() == whole.read_bytes()


def test_two_runs_are_compared_over_each_other_and_swapped(listed: Page) -> None:
    page = listed
    open_row(page, "Q = 20")
    row(page, "Q = 1").get_by_role("button").first.click()
    page.get_by_role("button", name="Compare with the screen").click()
    page.get_by_role("tab", name="Compare").click()
    compared = page.locator(".sg-compare")
    table = compared.locator("tr")
    expect(table.filter(has_text="controller Lyapunov weight Q")).to_contain_text("201")
    expect(table.filter(has_text="last slip ends")).to_contain_text("87.5379+292")
    assert compared.locator(".sg-run b").all_inner_texts() == ["Q = 20", "Q = 1"]
    page.locator(".sg-ghost-lane").first.wait_for()
    compared.locator(".sg-time", has_text="84.8 ms").first.click()
    expect(page.locator(".sg-clock")).to_contain_text("84.8 ms")
    compared.get_by_role("button", name="First difference").click()
    expect(page.locator(".sg-clock")).to_contain_text("5.0 ms")
    compared.get_by_role("button", name="Swap").click()
    expect(table.filter(has_text="controller Lyapunov weight Q")).to_contain_text("120")
    assert compared.locator(".sg-run b").all_inner_texts() == ["Q = 1", "Q = 20"]
    wait_until(lambda: page.locator(".sg-outdated").count() == 0, "the comparison is not made")
    compared.get_by_role("button", name="End").click()
    compared.get_by_text("Compare two runs").wait_for()
    expect(page.locator(".sg-ghost-lane")).to_have_count(0)
