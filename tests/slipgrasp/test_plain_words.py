"""Retired terms stay out of the code and its documents: each has a standard one in its place."""

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = (
    "core",
    "scene",
    "recordings",
    "figures",
    "server",
    "web",
    "slipgrasp",
    "benchmarks",
    "docs",
    "examples",
)
PAGES = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "SECURITY.md")

# What each one is called now. Contracts, such as options, keys and reason codes, are no terms.
RETIRED = {
    r"laws? of one's own|one's own laws?": "custom law",
    r"(?<!laws[./])(?<!spatial[./])(\b|_)own[ _]laws?\b|OwnLaw": "custom law",
    r"\bpale (second )?run|(?-i:\bPale:)": "ghost",
    r"\blook(s|ing)? only\b|\blets? look\b": "read-only",
    r"(?<!friction )\b(gives?|gave|given|giving) back\b": "returns, releases",
    r"\bwhoever\b": "a noun: the user, the caller, the peer",
    r"(?-i:(?<![./-])(\b|_)verdicts?(\b|_))": "outcome, outcome in words",
    r"\b(the|its|theorems.) premises?\b|\bpremises of\b": "assumptions of the theorems",
    r"\b(least|the|no) squeeze\b(?! met)": "grip force, internal force",
    r"(?<![./])(?<!kept its )\b(belief|beliefs(?![:=])|believes?|believing)\b": "estimate, phase",
    r"\b(is|are|was|were|be|been) told\b(?! is)|\btold apart\b": "known, given, shown",
    r"\b(tells?|telling) (\w+ ){1,3}apart\b|\"{3}Tells\b|: Told the\b": "shows, reports",
    r"where it was wanted": "its target",
    r"laws? of the field": "published control law",
    r"(?<![`\"._])\bstretch(es)?\b(?!_| =|\.\w|, model|\)$)": "segment, time range",
    r"(?-i:(\b|[a-z]_)(?<!\.)rooms?\b|\broom_)(?! for one run)": "package, space, capacity",
    r"hands? in (space|the plane)\b(?! of)": "spatial hand, planar hand",
    r"(?-i:\b(in_space|is_spatial)\b)": "space (core/scenario/space.py)",
    r"wrong hand": "model mismatch",
    r"unknowns? of a run": "unknown parameter",
    r"front ends? of a law": "way to write a law",
    r"\bcarriers?\b": "tracking controller",
    r"wet[ _]?spots?": "low-friction patch (button: wet patch)",
    r"knobs?": "control, slider",
    r"holds? on to|to be had": "retain, available",
    r"goes over to (the|where)|go(ing)? over to the next": "switches to, continues with",
}
# Of these the code still has identifiers.
RETIRED_IN_DOCUMENTS = {
    r"\blens(es)?\b": "close-up",
}
# The name of the numerics covers local variables there; titles of presets identify old runs.
LEFT_OUT = ("core/kernel/", "core/scenario/table.py", "core/scenario/presets/")


@cache
def sources():
    """Texts of the tracked and new files, by name."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", *FOLDERS, *PAGES],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    return {
        name: (ROOT / name).read_text("utf-8")
        for name in listed
        if name.endswith((".py", ".md", ".toml", ".js"))
        and not name.startswith(LEFT_OUT)
        and (ROOT / name).is_file()
    }


@pytest.mark.parametrize("term", RETIRED | RETIRED_IN_DOCUMENTS)
def test_a_retired_term_does_not_come_back(term):
    pattern = re.compile(term, re.IGNORECASE | re.MULTILINE)
    lines = [
        f"{name}:{number}: {line.strip()[:100]}"
        for name, text in sources().items()
        if (term in RETIRED or name.endswith(".md")) and pattern.search(text)
        for number, line in enumerate(text.splitlines(), 1)
        if pattern.search(line)
    ]
    assert not lines, f"write {(RETIRED | RETIRED_IN_DOCUMENTS)[term]}:\n" + "\n".join(lines)
