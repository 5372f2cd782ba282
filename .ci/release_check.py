"""Builds a release from a commit twice, and installs it into empty environments.

`python .ci/release_check.py [PYTHON …]`: the other files are checked (release_material.py); source
archive and wheel, with the kernel as WebAssembly, are built in two folders and must have equal
bytes; their metadata and contents are checked; each interpreter installs the wheel and runs a
preset with that kernel and with machine code, and its hash must be the one in
docs/data/preset-hashes.csv. Nothing is published. `… --build FOLDER` only builds.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from hash_table import known_hashes
from release_material import check_forms, check_material

ROOT = Path(__file__).parents[1]
PRESET = "paper-case-1"
# Waits for the machine code, which another process has compiled since the first run.
COMPILE = """
from slipgrasp.core.kernel.webassembly.shipped import shipped_file
from slipgrasp.core.run.simulator import prepare_kernel
assert shipped_file() is not None, "the wheel has no kernel of its sources"
prepare_kernel(machine_code=True)
"""
VERSIONS = ("python3.11", "python3.12", "python3.13")


def main(interpreters: Sequence[str]) -> None:
    """Checks a release with the given interpreters; with the installed ones if none is given."""
    check_material()
    check_forms()
    print("Citation, Zenodo, conda recipe, paper and workflows are in order")
    found = interpreters or [each for name in VERSIONS if (each := shutil.which(name))]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        commit = last_commit()
        files = build(folder / "first", commit)
        again = build(folder / "second", commit)
        assert [digest(each) for each in files] == [digest(each) for each in again], "two builds"
        print(f"Two builds are equal bytes: {', '.join(each.name for each in files)}")
        tool("twine", "check", "--strict", *files)
        (wheel,) = (each for each in files if each.suffix == ".whl")
        tool("check_wheel_contents", "--toplevel", "slipgrasp", wheel)
        for number, interpreter in enumerate(found):
            check_installed(interpreter, wheel, folder / f"environment{number}")


def last_commit() -> str:
    """The commit that is checked, even if another one is made meanwhile."""
    return subprocess.check_output(["git", "rev-parse", "HEAD"], cwd=ROOT, text=True).strip()


def build(folder: Path, commit: str) -> list[Path]:
    """Builds source archive and wheel of a commit in a folder."""
    sources = folder / "sources"
    sources.mkdir(parents=True)
    archive = subprocess.check_output(["git", "archive", commit], cwd=ROOT)
    (folder / "sources.tar").write_bytes(archive)
    with tarfile.open(folder / "sources.tar") as tar:
        tar.extractall(sources, filter="data")
    instant = subprocess.check_output(
        ["git", "log", "-1", "--format=%ct", commit], cwd=ROOT, text=True
    )
    kernels = sources / "core" / "kernel" / "webassembly" / "kernels"
    # As imported here: if that is not the commit, the wheel does not use it (check_installed).
    tool("slipgrasp.core.kernel.webassembly.build", kernels)
    environment = {**os.environ, "SOURCE_DATE_EPOCH": instant.strip()}
    subprocess.run(
        [sys.executable, "-m", "build", "--outdir", str(folder / "dist"), str(sources)],
        env=environment,
        check=True,
        stdout=subprocess.DEVNULL,
    )
    files = sorted((folder / "dist").iterdir())
    for each in files:
        if each.suffix == ".gz":
            without_build_time(each, int(instant))
    return files


def without_build_time(path: Path, instant: int) -> None:
    """Rewrites a source archive with one time for all files; setuptools uses the present time."""
    with tarfile.open(path) as tar:
        members = [(each, tar.extractfile(each)) for each in tar.getmembers()]
        contents = [(each, file.read() if file else b"") for each, file in members]
    with (
        path.open("wb") as raw,
        gzip.GzipFile(filename="", fileobj=raw, mode="wb", mtime=instant) as packed,
        tarfile.open(fileobj=packed, mode="w") as tar,
    ):
        for member, content in sorted(contents, key=lambda each: each[0].name):
            member.mtime, member.uid, member.gid, member.uname, member.gname = instant, 0, 0, "", ""
            member.pax_headers = {}
            tar.addfile(member, io.BytesIO(content))


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def tool(module: str, *arguments: str | Path) -> None:
    """Runs a checker of this environment."""
    subprocess.run([sys.executable, "-m", module, *map(str, arguments)], check=True)


def check_installed(interpreter: str, wheel: Path, folder: Path) -> None:
    """Installs a wheel into an empty environment, and compares the hashes of two runs."""
    subprocess.run([interpreter, "-m", "venv", str(folder)], check=True)
    python = str(folder / "bin" / "python")
    # Outside the sources, so that only installed packages are imported.
    own = {"SLIPGRASP_DATA": str(folder / "runs"), "SLIPGRASP_CACHE": str(folder / "cache")}
    environment = {**os.environ, **own}
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", str(wheel)]
    subprocess.run(install, check=True, cwd=folder)

    def check_hash() -> float:
        """Compares the hash of a run; returns the time taken [s]."""
        start = time.monotonic()
        run = [python, "-m", "slipgrasp", "run", PRESET, "--json"]
        printed = subprocess.check_output(run, cwd=folder, env=environment, text=True)
        assert json.loads(printed)["sha256"] == known_hashes()[PRESET], f"{python}: another hash"
        return time.monotonic() - start

    first = check_hash()
    subprocess.run([python, "-c", COMPILE], cwd=folder, env=environment, check=True)
    check_hash()
    version = subprocess.check_output([python, "--version"], text=True).strip()
    print(f"{version}: installed, and {PRESET} has the known hash, first after {first:.1f} s")


def build_into(folder: Path) -> None:
    """Puts source archive and wheel into a folder."""
    with tempfile.TemporaryDirectory() as name:
        for each in build(Path(name), last_commit()):
            folder.mkdir(exist_ok=True)
            shutil.copy(each, folder)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--build"]:
        build_into(Path(sys.argv[2]))
    else:
        main(sys.argv[1:])
