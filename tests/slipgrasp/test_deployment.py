"""The files of deploy/, as far as they can be tried without systemd and an engine."""

from __future__ import annotations

import ast
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tomllib
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import packages_distributions
from itertools import chain
from pathlib import Path

import pytest

from tests.slipgrasp.forked import Forked
from tests.slipgrasp.test_installed import PACKAGES
from tests.slipgrasp.test_serving_a_network import free_port
from tests.waiting import wait_until

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
UNIT = ROOT / "deploy" / "slipgrasp.service"
CONTAINERFILE = ROOT / "deploy" / "Containerfile"
PROGRAM = "/opt/slipgrasp/bin/slipgrasp"


def settings_of(unit: Path) -> dict[str, str]:
    lines = [line for line in unit.read_text().splitlines() if re.match(r"[A-Z]\w+=", line)]
    return {name: value for name, _, value in (line.partition("=") for line in lines)}


def instructions(name: str) -> list[str]:
    lines = CONTAINERFILE.read_text().splitlines()
    return [line.removeprefix(f"{name} ") for line in lines if line.startswith(f"{name} ")]


@contextmanager
def started(command: list[str], folder: Path, environment: dict[str, str]) -> Iterator[Forked]:
    program, *arguments = command
    assert program == PROGRAM
    with Forked(arguments, folder, {**os.environ, **environment}) as process:
        try:
            yield process
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait() == 0


def is_ready(url: str, token: str) -> bool:
    asked = urllib.request.Request(url, headers={"Authorization": f"Bearer {token}"})
    try:
        with urllib.request.urlopen(asked) as answer:
            return json.load(answer)["status"] == "ready"
    except urllib.error.HTTPError as refused:
        # 503 while the simulation is being loaded.
        with refused:
            assert refused.code == 503
            return False


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd here")
def test_systemd_finds_no_fault_with_the_unit(tmp_path) -> None:
    unit = tmp_path / UNIT.name
    unit.write_text(UNIT.read_text().replace(PROGRAM, sys.executable))
    done = subprocess.run(
        ["systemd-analyze", "verify", unit], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")


def test_the_service_of_the_unit_keeps_everything_where_the_unit_says(tmp_path) -> None:
    told = settings_of(UNIT)
    folders = {"%S": str(tmp_path / "state"), "%C": str(tmp_path / "cache")}
    text = told["Environment"]
    for short, folder in folders.items():
        text = text.replace(short, folder)
    environment = dict(pair.split("=", 1) for pair in shlex.split(text))
    kept = Path(environment["SLIPGRASP_DATA"])
    assert kept == tmp_path / "state" / told["StateDirectory"]
    assert all(value.startswith(str(tmp_path)) for value in environment.values())
    # The kernel that is compiled already.
    del environment["SLIPGRASP_CACHE"]
    port = free_port()
    command = [str(port) if word == "8020" else word for word in shlex.split(told["ExecStart"])]
    with started(command, tmp_path, environment) as process:
        assert process.stdout.readline().startswith(f"http://127.0.0.1:{port}/")
        token = (kept / "service.token").read_text().strip()
        url = f"http://127.0.0.1:{port}/api/v1/ready"
        wait_until(lambda: is_ready(url, token))
        assert kept.stat().st_mode & 0o777 == int(told["StateDirectoryMode"], 8)


def test_the_image_has_all_that_an_installation_needs() -> None:
    copied = [line.split()[:-1] for line in instructions("COPY")]
    sources = {name for names in copied for name in names}
    assert all((ROOT / name).exists() for name in sources)
    assert {"slipgrasp", *PACKAGES, "pyproject.toml", "setup.py", "requirements.txt"} <= sources
    for folders in instructions("COPY")[1:]:
        source, target = folders.split()
        assert target == f"/tmp/source/{source}"


def version(line: str) -> str:
    """Name and version of a package, whatever the platforms it is for."""
    return line.partition(" ; ")[0]


def test_every_requirement_is_one_version_of_the_constraints_with_its_hashes() -> None:
    text = (ROOT / "requirements.txt").read_text()
    constrained = {version(line) for line in (ROOT / "constraints.txt").read_text().splitlines()}
    pinned = [line.removesuffix(" \\") for line in text.splitlines() if line[:1].isalnum()]
    assert pinned and set(map(version, pinned)) <= constrained
    entries = re.split(r"\n(?=[a-z0-9])", text)[1:]
    assert all(re.search(r"--hash=sha256:[0-9a-f]{64}", entry) for entry in entries)
    assert len(entries) == len(pinned) and "://" not in text


def test_the_requirements_hold_all_that_an_installation_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    asked = [*project["dependencies"], *extras["dask"], *extras["metrics"], "setuptools>=77"]
    text = (ROOT / "requirements.txt").read_text()
    pinned = set(re.findall(r"^([a-z0-9-]+)==", text, re.MULTILINE))
    assert {re.split(r"[<>=]", name)[0] for name in asked} <= pinned


def test_everything_that_is_imported_is_named_as_a_dependency() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    known = {re.split(r"[<>=\[]", name)[0] for name in named}
    needed = {name for folder in (*PACKAGES, "slipgrasp") for name in imported_in(ROOT / folder)}
    assert {"starlette", "h11", "numpy"} <= needed
    installed = packages_distributions()
    unnamed = {
        name
        for name in needed
        if not known & {d.lower().replace("_", "-") for d in installed.get(name, [name])}
    }
    assert unnamed == set()


def imported_in(folder: Path) -> set[str]:
    """Top-level packages of others that modules of a folder import, wherever they do."""
    found: set[str] = set()
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found.update(name.name for name in node.names)
            elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
                found.add(node.module)
    top = {name.partition(".")[0] for name in found}
    return top - sys.stdlib_module_names - {"slipgrasp"}


FIRST_WITHOUT_KNOWN_HOLES = {
    "distributed": (2026, 1, 1),  # CVE-2026-23528
    "h11": (0, 16),  # CVE-2025-43859
    "pillow": (12, 3),  # CVE-2026-59199, CVE-2026-59205 and others
    "protobuf": (6, 33, 5),  # CVE-2025-4565, CVE-2026-0994
    "pyarrow": (23, 0, 1),  # CVE-2026-25087
    "starlette": (1, 3, 1),  # CVE-2025-62727, CVE-2026-48710, CVE-2026-54283 and others
}


def test_no_version_with_a_hole_that_is_known_here_is_admitted() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    named = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    for name, least in FIRST_WITHOUT_KNOWN_HOLES.items():
        bounds = [re.fullmatch(rf"{name}>=([0-9.]+).*", one) for one in named]
        admitted = [tuple(map(int, found[1].split("."))) for found in bounds if found]
        assert admitted and min(admitted) >= least, name


def test_the_command_of_the_image_serves_behind_the_port_that_it_exposes(tmp_path) -> None:
    entry, command = (json.loads(instructions(name)[0]) for name in ("ENTRYPOINT", "CMD"))
    (exposed,) = instructions("EXPOSE")
    assert entry[entry.index("--port") + 1] == exposed
    port = str(free_port())
    words = [word.replace(exposed, port) for word in (*entry, *command)]
    with started(words, tmp_path, {"SLIPGRASP_DATA": str(tmp_path / "data")}) as process:
        token = process.stdout.readline().strip().removeprefix(f"http://localhost:{port}/?token=")
        wait_until(lambda: is_ready(f"http://localhost:{port}/api/v1/ready", token))
