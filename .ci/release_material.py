"""Checks the files of a release other than its code: every file has the present version and form.

`python .ci/release_material.py` needs nothing but PyYAML; `make release-check` checks the forms of
workflows and citation too, with check-jsonschema.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
_ACTION = re.compile(r"[\w.-]+/[\w./-]+@[\w./]+")


def check_versions() -> None:
    """Citation, Zenodo and conda name the version, licence and requirements of pyproject.toml."""
    project = tomllib.loads(_text("pyproject.toml"))["project"]
    zenodo, citation = json.loads(_text(".zenodo.json")), yaml.safe_load(_text("CITATION.cff"))
    recipe = yaml.safe_load(_text("deploy/conda/recipe.yaml"))
    versions = zenodo["version"], citation["version"], recipe["context"]["version"]
    assert set(versions) == {project["version"]}, f"versions: {versions}"
    licences = zenodo["license"], citation["license"], recipe["about"]["license"]
    assert set(licences) == {project["license"]}, f"licences: {licences}"
    assert zenodo["keywords"] == citation["keywords"] == project["keywords"], "keywords"
    python, *requirements = recipe["requirements"]["run"]
    assert python == f"python {project['requires-python']}", python
    assert requirements == project["dependencies"], "requirements of the conda recipe"


def check_paper() -> None:
    """Every work that the paper cites is in its bibliography, and vice versa."""
    text = _text("paper/paper.md")
    cited = set(re.findall(r"@([a-z]+)", text.split("---", 2)[2]))
    known = set(re.findall(r"^@\w+{(\w+),", _text("paper/paper.bib"), re.MULTILINE))
    assert cited == known, f"cited: {sorted(cited)}, known: {sorted(known)}"
    assert "# Statement of need" in text


def check_workflows() -> None:
    """Every step uses an action of a fixed version or runs a command; jobs need jobs that exist."""
    for path in sorted((ROOT / ".github" / "workflows").glob("*.yml")):
        workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
        assert "permissions" in workflow, f"{path.name}: no permissions"
        jobs = workflow["jobs"]
        for name, job in jobs.items():
            needs = job.get("needs", name)
            assert needs in jobs, f"{path.name}, {name}: needs {needs}"
            for step in job["steps"]:
                assert ("uses" in step) != ("run" in step), f"{path.name}, {name}: {step}"
                assert _ACTION.fullmatch(step.get("uses", "a/b@v1")), step["uses"]


def check_forms() -> None:
    """Workflows and citation match their schemas."""
    workflows = sorted(map(str, (ROOT / ".github" / "workflows").glob("*.yml")))
    for schema, files in {
        "vendor.github-workflows": workflows,
        "vendor.citation-file-format": [str(ROOT / "CITATION.cff")],
    }.items():
        command = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", schema, *files]
        subprocess.run(command, check=True)


def check_material() -> None:
    """Everything but the forms."""
    check_versions()
    check_paper()
    check_workflows()


def _text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


if __name__ == "__main__":
    check_material()
