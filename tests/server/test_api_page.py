"""The examples of the page on the REST interface work, and print what the page says."""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.server.serving import RunningServer, patient_settings, serve

pytestmark = pytest.mark.slow

PAGE = Path(__file__).parents[2] / "docs" / "api.md"
ADDRESS = "localhost:8020"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ID = re.compile(r"\b[a-z0-9]{12}\b")
END = "end of example"


class Example(NamedTuple):
    language: str
    code: str
    expected: str | None


def examples(language: str) -> list[Example]:
    """Code and what it prints; None where the page does not say."""
    blocks = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    following = [*blocks[1:], ("", "")]
    return [
        Example(kind, code, output if next_kind == "text" else None)
        for (kind, code), (next_kind, output) in zip(blocks, following, strict=True)
        if kind == language
    ]


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


def check(example: Example, printed: str) -> None:
    if example.expected is None:
        assert printed == "", example.code
        return
    pieces = (re.escape(ID.sub("ID", piece)) for piece in example.expected.split("…"))
    assert re.fullmatch(".*".join(pieces), ID.sub("ID", printed), re.DOTALL), printed


def test_the_examples_in_python_print_what_the_page_says(served, direct) -> None:
    names: dict[str, object] = {"__name__": "example"}
    try:
        for example in examples("python"):
            code = example.code.replace(ADDRESS, f"localhost:{served.port}")
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(compile(code, str(PAGE), "exec"), names)
            check(example, printed.getvalue())
    finally:
        names["api"].close()


def test_the_examples_in_the_shell_print_what_the_page_says(served, direct, tmp_path) -> None:
    found = examples("sh")
    code = f"echo '{END}'\n".join(example.code for example in found)
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
    assert len(examples("sh")) >= 6 and len(examples("python")) >= 8
    assert all(example.expected for example in examples("sh"))


def test_every_address_on_the_page_exists(served) -> None:
    text = PAGE.read_text(encoding="utf-8")
    with served.client() as client:
        known = client.get("/openapi.json").json()["paths"]
    first = {path.split("/")[3] for path in known} | {"openapi.json", "docs"}
    told = set(re.findall(r"(?:/api/v1|\"|`|[A-Z] )/([a-z.]+)", text)) - {"api"}
    assert told and told <= first


def test_the_configuration_for_the_generator_is_the_one_that_is_tested() -> None:
    from tests.server.test_openapi import CONFIG

    (config,) = examples("yaml")
    told = dict(re.findall(r"^  (\S+): (\S+)$", config.code, re.MULTILINE))
    assert told == CONFIG["content_type_overrides"]
