"""The README and the pages of docs: what they point at is there, the keys are those of the page."""

import re
import tomllib
from pathlib import Path

import pytest

from slipgrasp.web.page.keys import KEYS, keys_of

ROOT = Path(__file__).parents[2]
PAGES = sorted(ROOT.glob("*.md")) + sorted((ROOT / "docs").rglob("*.md"))
TARGET = re.compile(r'\]\(([^)\s]+)\)|(?:src|srcset|href)="([^"]+)"')


def text_of(page):
    """A page without its examples, in which brackets are code."""
    return re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def targets(page):
    """What a page points at in this repository: paths, maybe with the name of a section."""
    found = ("".join(groups) for groups in TARGET.findall(text_of(page)))
    return [target for target in found if "://" not in target]


def sections(page):
    """The names of a page's sections as they stand in links to them."""
    heads = re.findall(r"^#+ (.+)$", text_of(page), re.M)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_everything_that_a_page_points_at_is_there(page):
    for target in targets(page):
        path, _, section = target.partition("#")
        file = page.parent / path if path else page
        assert file.exists(), target
        assert not section or section in sections(file), target


def test_every_picture_and_data_file_of_the_documentation_is_on_a_page():
    shown = {(page.parent / target).resolve() for page in PAGES for target in targets(page)}
    files = {*(ROOT / "docs" / "images").rglob("*.*"), *(ROOT / "docs" / "data").iterdir()}
    assert {path for path in files if path.suffix != ".pdf"} - shown == set()


def test_the_tests_that_the_list_of_checks_names_exist():
    with (ROOT / "docs" / "data" / "checks.csv").open(encoding="utf-8") as file:
        named = re.findall(r"`(\w+/\w+\.py)`", file.read())
    assert len(named) > 25
    assert [name for name in named if not (ROOT / "tests" / name).is_file()] == []


def test_the_keys_of_the_guide_are_those_of_the_page():
    guide = (ROOT / "docs" / "dashboard.md").read_text(encoding="utf-8")
    (table,) = re.findall(r"^\| key \|.*\n\|.*\n((?:\|.*\n)+)", guide, re.M)
    expected = [f"| {keys_of(command.intent)} | {command.text} |" for command in KEYS]
    own = ["| Shift+F | Full screen, or back |", "| ? | This list |"]
    assert table.splitlines() == [*expected, *own]


def test_the_citation_is_of_the_present_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.+)$", citation, re.M) == [project["version"]]
