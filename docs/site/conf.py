"""The documentation as a site: `make site` builds it into build/site (Sphinx)."""

import re
import shutil
import sys
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(Path(__file__).parent))  # of live.py and offline_search.py

project = "slipgrasp"
author = "the slipgrasp authors"
copyright = author
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx-mathjax-offline",
    "live",
    "offline_search",
]
root_doc = "docs/site/index"
# Pages can also be read in the repository; links between them work in both places.
include_patterns = ["*.md", "docs/**.md"]
exclude_patterns = ["build", ".venv"]
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_title = "slipgrasp"
html_favicon = str(ROOT / "web" / "page" / "icon.svg")
html_show_copyright = False
html_show_sphinx = False
html_copy_source = False
autodoc_member_order = "groupwise"
autodoc_typehints = "description"
napoleon_use_ivar = True
suppress_warnings = ["myst.header", "misc.highlighting_failure"]


# Targets of the HTML in pages, which Sphinx does not process: other pages, and images.


def point_at_pages(
    app: Sphinx, page: str, template: str, context: dict[str, Any], tree: object
) -> None:
    """Changes links to Markdown files to the pages made from them."""
    if "body" in context:
        context["body"] = re.sub(r'(href="(?!\w+:)[^"#]+)\.md\b', r"\1.html", context["body"])


def complete(app: Sphinx, error: Exception | None) -> None:
    """Adds the images, and a first page that redirects to the index."""
    if error is None:
        shutil.copytree(ROOT / "docs" / "images", app.outdir / "docs/images", dirs_exist_ok=True)
        first = f'<meta http-equiv="refresh" content="0; url={root_doc}.html">'
        (app.outdir / "index.html").write_text(f"<!doctype html>{first}\n", encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("html-page-context", point_at_pages)
    app.connect("build-finished", complete)
