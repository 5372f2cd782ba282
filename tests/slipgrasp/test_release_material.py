"""What a release needs beside its code: `make release-check` checks more of it."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def run(*arguments):
    command = [sys.executable, *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_versions_paper_and_workflows_agree():
    done = run(".ci/release_material.py")
    assert done.returncode == 0, done.stderr


def test_the_table_of_hashes_names_what_differs(tmp_path):
    known = run(
        "-c",
        "import sys; sys.path.insert(0, '.ci'); import hash_table, json;"
        "print(json.dumps(hash_table.known_hashes()))",
    )
    hashes = json.loads(known.stdout)
    for name, changed in {"linux": {}, "windows": {"paper-case-1": "0" * 64}}.items():
        (tmp_path / f"hashes-{name}.json").write_text(json.dumps({**hashes, **changed}))
    files = sorted(tmp_path.iterdir())
    same, both = (
        run(".ci/hash_table.py", "join", files[0]),
        run(".ci/hash_table.py", "join", *files),
    )
    assert same.returncode == 0 and "| paper-case-1 | 65d2b5e59b9d | the same |" in same.stdout
    assert both.returncode == 1 and "| the same | 000000000000 |" in both.stdout
