"""The examples of the page on the REST interface work, and print what the page says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fenced_blocks import DOCS, Block, blocks_of, output_of
from tests.server.serving import RunningServer, patient_settings, serve

pytestmark = pytest.mark.slow

PAGE = (DOCS / "api.md").read_text(encoding="utf-8")
ADDRESS = "localhost:8020"
ID = re.compile(r"\b[a-z0-9]{12}\b")
END = "end of example"


@pytest.fixture(scope="module")
def served(tmp_path_factory) -> Iterator[RunningServer]:
    folder = tmp_path_factory.mktemp("api_page")
    with serve(patient_settings(folder, study_executor="inline")) as running:
        # The page speaks of a store that has runs already.
        with running.client() as client:
            client.post("/runs", json={"scenario": "paper-case-1"}).raise_for_status()
        yield running


@pytest.fixture
def direct(monkeypatch) -> None:
    """No proxy stands between an example and this machine."""
    for name in ("NO_PROXY", "no_proxy"):
        monkeypatch.setenv(name, "localhost")


def check(example: Block, printed: str) -> None:
    if example.printed is None:
        assert printed == "", example.text
        return
    pieces = (re.escape(ID.sub("ID", piece)) for piece in example.printed.split("…"))
    assert re.fullmatch(".*".join(pieces), ID.sub("ID", printed), re.DOTALL), printed


def test_the_examples_in_python_print_what_the_page_says(served, direct) -> None:
    names: dict[str, object] = {"__name__": "example"}
    try:
        for example in blocks_of(PAGE, "python"):
            code = example.text.replace(ADDRESS, f"localhost:{served.port}")
            check(example, output_of(code, names))
    finally:
        names["api"].close()


def test_the_examples_in_the_shell_print_what_the_page_says(served, direct, tmp_path) -> None:
    found = blocks_of(PAGE, "sh")
    code = f"echo '{END}'\n".join(example.text for example in found)
    code = code.replace(ADDRESS, f"localhost:{served.port}")
    programs = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PATH": programs},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr + done.stdout
    printed = done.stdout.split(f"{END}\n")
    for example, text in zip(found, printed, strict=True):
        check(example, text)


def test_every_part_of_the_interface_is_told_of_in_both_languages() -> None:
    commands = blocks_of(PAGE, "sh")
    assert len(commands) >= 6 and len(blocks_of(PAGE, "python")) >= 8
    assert all(example.printed for example in commands)


def test_every_address_on_the_page_exists(served) -> None:
    with served.client() as client:
        known = client.get("/openapi.json").json()["paths"]
    first = {path.split("/")[3] for path in known} | {"openapi.json", "docs"}
    told = set(re.findall(r"(?:/api/v1|\"|`|[A-Z] )/([a-z.]+)", PAGE)) - {"api"}
    assert told and told <= first


def test_the_configuration_for_the_generator_is_the_one_that_is_tested() -> None:
    from tests.server.test_openapi import CONFIG

    (config,) = blocks_of(PAGE, "yaml")
    told = dict(re.findall(r"^  (\S+): (\S+)$", config.text, re.MULTILINE))
    assert told == CONFIG["content_type_overrides"]
