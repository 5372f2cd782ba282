"""The documentation as a site: it is built without a warning, and everything in it is there."""

import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

from slipgrasp import load_scenario, simulate

ROOT = Path(__file__).parents[2]
TARGET = re.compile(r'(?:href|src|srcset)="([^"]+)"')
ELSEWHERE = ("http:", "https:", "mailto:", "data:", "javascript:")

# All of them, so that one process builds the site once.
pytestmark = [pytest.mark.slow, pytest.mark.browser]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning"]
    command += ["-c", "docs/site", "-d", str(folder / "trees"), ".", str(folder / "pages")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "pages"


def links(page):
    for target in TARGET.findall(page.read_text(encoding="utf-8")):
        if not target.startswith(ELSEWHERE):
            path, _, section = unquote(target).partition("#")
            yield page.parent / path.partition("?")[0] if path else page, section


def test_every_link_and_picture_of_every_page_is_there(site):
    missing, names = [], {}
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 30
    for page in pages:
        for file, section in links(page):
            text = names.setdefault(
                file, file.read_text("utf-8", "replace") if file.is_file() else None
            )
            # What a live page starts with, such as t=0, is no section of it.
            is_section = section and "=" not in section
            if text is None or (is_section and f'id="{section}"' not in text):
                missing.append((page.name, str(file), section))
    assert missing == []


def test_the_reference_has_every_public_name(site):
    import slipgrasp

    text = (site / "docs/site/reference.html").read_text(encoding="utf-8")
    assert [name for name in slipgrasp.__all__ if f"slipgrasp.interface.{name}" not in text] == []


def test_nothing_is_fetched_from_elsewhere(site):
    """So that the site is whole without a network: formulas, fonts and search too."""
    loaded = re.compile(r'<(?:script|link|img|source)\b[^>]*(?:src|href|srcset)="(https?:[^"]+)"')
    for page in site.rglob("*.html"):
        assert loaded.findall(page.read_text(encoding="utf-8")) == [], page.name


def test_every_preset_and_every_lesson_has_a_live_page(site):
    gallery = (site / "docs/gallery.html").read_text(encoding="utf-8")
    shown = set(re.findall(r'href="live/([\w-]+)\.html"><img', gallery))
    presets = {path.stem for path in (ROOT / "core/scenario/presets").glob("*.toml")}
    without_page = {
        "wet-patch",
        "sliding-block",
        "spinning-slide",
        "drag-slider",
        "push-slider",
    }  # patches, and bodies without a hand
    assert presets - shown == without_page
    lessons = (site / "docs/lessons.html").read_text(encoding="utf-8")
    assert len(re.findall(r'href="live/[\w-]+\.html#t=0"', lessons)) == 6
    start = (site / "README.html").read_text(encoding="utf-8")
    assert 'href="docs/live/spatial-prism.html"' in start


def test_live_pages_share_what_is_equal(site):
    live = site / "docs/live"
    assert sum(file.stat().st_size for file in live.iterdir()) < 5e6
    assert len(list(live.glob("shared-*.js"))) == 4


def test_a_live_page_of_the_site_simulates(site, browser):
    context = browser.new_context(viewport={"width": 800, "height": 800}, offline=True)
    page = context.new_page()
    try:
        page.goto((site / "docs/lessons.html").as_uri())
        page.get_by_role("link", name="published-law.html").click()
        page.wait_for_function("document.documentElement.dataset.sgStarted !== undefined")
        sha256 = simulate(load_scenario("paper-case-2")).sha256
        assert page.locator("#sg-sha256").text_content() == sha256
        assert page.get_by_role("slider").count() == 1
    finally:
        context.close()


def test_pages_fit_a_phone_no_code_is_cut_off_and_the_search_shows_excerpts(site, browser):
    context = browser.new_context(viewport={"width": 360, "height": 740})
    page = context.new_page()
    try:
        page.goto((site / "docs/site/index.html").as_uri())
        page.goto((site / "docs/model.html").as_uri())
        page.wait_for_selector("mjx-container")
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        page.goto((site / "docs/get-started.html").as_uri())
        widths = "codes => codes.map(code => code.scrollWidth - code.clientWidth)"
        assert set(page.eval_on_selector_all("pre", widths)) == {0}
        page.goto((site / "search.html").as_uri() + "?q=Painlev%C3%A9")
        found = page.locator("#search-results li a")
        found.first.wait_for()
        assert any("model" in (a.get_attribute("href") or "") for a in found.all())
        excerpt = page.locator("#search-results p.context").first
        assert "Painlevé" in (excerpt.text_content() or "")
    finally:
        context.close()
