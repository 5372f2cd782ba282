"""ARCHITECTURE.md: it lists the packages there are; no page for developers names a lost file.

Rules for the code that no linter has are checked here too.
"""

import ast
import re
import tomllib
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
PAGES = (
    *(ROOT / name for name in ("ARCHITECTURE.md", "CONTRIBUTING.md")),
    *sorted((ROOT / "docs" / "decisions").glob("*.md")),
)
PACKAGES = ("core", "recordings", "scene", "figures", "server", "web", "slipgrasp")
KINDS = (
    *("parameter", "drawn object", "signal", "chart", "metric", "control law"),
    *("export format", "job whose memory grows with a run", "REST route", "REST filter"),
    *("integration method", "executor", "guard that ends a run"),
    *("guard that changes a phase, or known instant", "outcome", "finger kind"),
    *("figure", "panel", "CLI command", "shape of a low-friction patch", "preset"),
)


def rows_of(section):
    """The rows of a section's table: its cells."""
    _, _, text = PAGE.partition(f"\n## {section}\n")
    lines = re.findall(r"^\| (.+) \|$", text.partition("\n## ")[0], re.M)
    return [line.split(" | ") for line in lines[1:]]


def paths_in(text):
    """What stands in a text as code and is a path of this repository."""
    return [code for code in re.findall(r"`([^`\s]+)`", text) if "/" in code or ".md" in code]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_path_on_a_page_for_developers_leads_to_a_file_or_a_folder(page):
    for path in paths_in(page.read_text(encoding="utf-8")):
        assert (ROOT / path).is_dir() if path.endswith("/") else (ROOT / path).is_file(), path


def test_the_packages_of_the_page_are_those_of_the_repository():
    faces = [*ROOT.glob("*/__init__.py")]
    faces += [face for top in faces for face in top.parent.glob("*/**/__init__.py")]
    packages = {f"`{face.parent.relative_to(ROOT).as_posix()}/`" for face in faces}
    assert {package for package, _ in rows_of("Packages")} == packages


def test_the_way_of_imports_is_the_one_that_is_checked():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["importlinter"]
    packages = next(rule for rule in contracts["contracts"] if rule["name"] == "packages")
    assert f"`{' > '.join(packages['layers'])}`" in PAGE


def test_every_kind_of_change_names_the_files_that_it_touches():
    changes = dict(rows_of("Files to change"))
    assert tuple(changes) == KINDS
    assert all(paths_in(files) for files in changes.values())


def module_name(path):
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(
        part for part in ("slipgrasp", *parts[parts[0] == "slipgrasp" :]) if part != "__init__"
    )


def imported_names(tree):
    """What a module imports anywhere, also inside functions and for types alone."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((f"{node.module}.{alias.name}", node.module) for alias in node.names)


def test_no_modules_import_each_other_in_a_circle():
    modules = {module_name(path): path for top in PACKAGES for path in (ROOT / top).rglob("*.py")}
    imports = {}
    for name, path in modules.items():
        pairs = imported_names(ast.parse(path.read_text(encoding="utf-8")))
        found = (first if first in modules else second for first, second in pairs)
        imports[name] = {each for each in found if each in modules and each != name}
    assert sum(map(len, imports.values())) > len(modules)
    TopologicalSorter(imports).prepare()  # raises CycleError


QUIET = {("core/scenario/loading.py", "_with_plain_values")}
"""The quick way to set values: whatever it cannot do, the thorough one does again and refuses."""


def test_no_handler_of_a_validation_error_is_silent():
    silent = set()
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            text = path.read_text(encoding="utf-8")
            tree = ast.parse(text if "ValidationError" in text else "")
            for function in (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)):
                if any(map(is_silent, handlers_of_validation_errors(function))):
                    silent.add((path.relative_to(ROOT).as_posix(), function.name))
    assert silent == QUIET


def handlers_of_validation_errors(function):
    handlers = (n for n in ast.walk(function) if isinstance(n, ast.ExceptHandler) and n.type)
    return [each for each in handlers if "ValidationError" in ast.unparse(each.type)]


def is_silent(handler):
    """Whether a handler neither raises nor writes to the log."""
    nodes = [node for statement in handler.body for node in ast.walk(statement)]
    calls = [ast.unparse(node.func) for node in nodes if isinstance(node, ast.Call)]
    return not any(isinstance(n, ast.Raise) for n in nodes) and "_logger.warning" not in calls
