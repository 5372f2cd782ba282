"""The wheel as others install it: one name, everything in it, whatever lies beside a script."""

import json
import os
import shutil
import signal
import subprocess
import sys
import urllib.request
import venv
import zipfile
from pathlib import Path
from types import SimpleNamespace

import pytest

from slipgrasp.core.run.simulator import prepare_kernel
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
PACKAGES = ("core", "figures", "recordings", "scene", "server", "web")
BESIDE = ("pyproject.toml", "setup.py", "README.md", "LICENSE")
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")


def files_of_the_packages():
    """What the packages consist of, as it lies in the repository and as it is installed."""
    for package in ("slipgrasp", *PACKAGES):
        for path in (ROOT / package).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                inside = path.relative_to(ROOT)
                yield inside if package == "slipgrasp" else "slipgrasp" / inside


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Built from a copy: in the repository what an earlier build left would get into it."""
    source = tmp_path_factory.mktemp("source")
    for package in ("slipgrasp", *PACKAGES):
        shutil.copytree(
            ROOT / package, source / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    for name in BESIDE:
        shutil.copy(ROOT / name, source)
    options = ("--no-deps", "--no-index", "--no-build-isolation")
    subprocess.run([*PIP, "wheel", *options, "--wheel-dir", source / "dist", source], check=True)
    (built,) = (source / "dist").glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """An environment with the wheel in it, and a folder full of packages with the old names."""
    place = tmp_path_factory.mktemp("installed")
    environment, folder = place / "environment", place / "work"
    venv.create(environment, symlinks=True)
    python = environment / "bin" / "python"
    options = ("--no-deps", "--no-index")
    subprocess.run([*PIP, "--python", python, "install", *options, wheel], check=True)
    # What slipgrasp needs is here. The links to the repository in these folders are dead there:
    # Python follows such links only in an environment's own folder.
    needed = [path for path in sys.path if Path(path).name in ("site-packages", "dist-packages")]
    (packages,) = environment.rglob("site-packages")
    (packages / "needed.pth").write_text("\n".join(needed))
    for package in PACKAGES:
        (folder / package).mkdir(parents=True)
        (folder / package / "__init__.py").write_text(
            f"raise RuntimeError('the foreign {package}')"
        )
    # The installed kernel is the same code, and finds what is compiled here.
    prepare_kernel()
    return SimpleNamespace(
        python=python,
        command=environment / "bin" / "slipgrasp",
        folder=folder,
        options={
            "cwd": folder,
            "env": {
                **os.environ,
                "PYTHONPATH": str(folder),
                "SLIPGRASP_DATA": str(folder / "data"),
            },
            "text": True,
        },
    )


def output_of(installed, *command, status=0):
    done = subprocess.run(command, **installed.options, capture_output=True, timeout=PATIENCE)
    assert done.returncode == status, done.stderr
    return done.stdout


def test_a_wheel_brings_one_name(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        (top_level,) = (name for name in names if name.endswith(".dist-info/top_level.txt"))
        assert archive.read(top_level).decode().split() == ["slipgrasp"]
    folders = {name.split("/")[0] for name in names}
    assert {folder for folder in folders if not folder.endswith(".dist-info")} == {"slipgrasp"}


def test_a_wheel_holds_every_file_of_the_packages_and_no_other(wheel):
    with zipfile.ZipFile(wheel) as archive:
        held = {Path(name) for name in archive.namelist() if name.startswith("slipgrasp/")}
    expected = set(files_of_the_packages())
    assert held == expected
    assert Path("slipgrasp/py.typed") in held


def test_foreign_packages_of_the_old_names_are_what_is_imported_beside_the_installed(installed):
    code = "import slipgrasp.core.scenario.loading as m; print(m.__file__)\nimport core"
    done = subprocess.run(
        [installed.python, "-c", code], **installed.options, capture_output=True, timeout=PATIENCE
    )
    assert Path(done.stdout.strip()).is_relative_to(installed.folder.parent / "environment")
    assert "the foreign core" in done.stderr


def test_the_installed_command_simulates_beside_foreign_packages(installed):
    asked = ("run", "paper-case-1", "--set", "simulation.duration=0.05", "--json")
    told = json.loads(output_of(installed, installed.command, *asked))
    assert told["outcome"] == "completed"


def test_the_installed_service_simulates_beside_foreign_packages(installed):
    command = (installed.command, "serve", "--port", "0")
    with subprocess.Popen(command, **installed.options, stdout=subprocess.PIPE) as service:
        try:
            url = service.stdout.readline().strip()
            body = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.05}}
            request = urllib.request.Request(
                f"{url}api/v1/runs", json.dumps(body).encode(), {"Content-Type": "application/json"}
            )
            with urllib.request.urlopen(request, timeout=PATIENCE) as answer:
                assert answer.status == 201
                assert json.load(answer)["outcome"] == "completed"
            with urllib.request.urlopen(url, timeout=PATIENCE) as page:
                assert page.status == 200
        finally:
            service.send_signal(signal.SIGINT)
            service.wait(timeout=PATIENCE)
