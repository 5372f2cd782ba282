"""Live pages of the site: each ``slipgrasp page`` of the docs, and each preset of the gallery.

They are written when the site is built, and share the parts that do not depend on scenarios.
"""

import contextlib
import io
import logging
import os.path
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

from slipgrasp.cli.main import main

ROOT = Path(__file__).parents[2]
FOLDER = Path("docs/live")
_BLOCK = re.compile(r"^```console\n(?:.*\n)*?```$", re.MULTILINE)
_COMMAND = re.compile(r"^\$ slipgrasp (page .+ --output ([\w-]+\.html))$", re.MULTILINE)
_PRESET = re.compile(r'href="[^"]*(?:core/scenario/presets/([\w-]+)\.toml|gallery\.html#([\w-]+))"')


def add_links(app: Sphinx, page: str, source: list[str]) -> None:
    """Puts a link below each block of commands that writes a page; it opens paused."""

    def with_link(block: re.Match[str]) -> str:
        links = "".join(
            f'<a href="live/{name}#t=0">Open {name}: nothing to install</a>'
            for _, name in _COMMAND.findall(block[0])
        )
        return f'{block[0]}\n\n<p class="live">{links}</p>' if links else block[0]

    source[0] = _BLOCK.sub(with_link, source[0])


def point_at_live_pages(
    app: Sphinx, page: str, template: str, context: dict[str, Any], tree: object
) -> None:
    """Changes links to presets, and to their images in the gallery, to live pages."""

    def address(link: re.Match[str]) -> str:
        target = FOLDER / f"{link[1] or link[2]}.html"
        return f'href="{os.path.relpath(target, Path(page).parent)}"'

    if "body" in context:
        context["body"] = _PRESET.sub(address, context["body"])


def write_pages(app: Sphinx, error: Exception | None) -> None:
    """Writes the live pages."""
    folder = app.outdir / FOLDER
    if error is not None:
        return
    logging.getLogger("slipgrasp").setLevel(logging.WARNING)
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    for arguments, name in _pages():
        with contextlib.redirect_stdout(io.StringIO()) as printed:
            status = main([*arguments, "--shared", "--output", str(folder / name)])
        assert status == 0, f"{name}: {printed.getvalue()}"


def _pages() -> Iterator[tuple[list[str], str]]:
    """Arguments and file name of each page."""
    for path in sorted((ROOT / "docs").glob("*.md")):
        text = path.read_text(encoding="utf-8")
        for command, name in _COMMAND.findall(text):
            yield shlex.split(command), name
        if path.name == "gallery.md":
            for preset, _ in _PRESET.findall(text):
                yield ["page", preset], f"{preset}.html"


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("source-read", add_links)
    app.connect("html-page-context", point_at_live_pages, priority=600)  # after those of conf.py
    app.connect("build-finished", write_pages)
