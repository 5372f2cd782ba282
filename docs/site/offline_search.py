"""Excerpts in the search without a network: a page opened from a file cannot fetch other pages.

The pages are written once more as one script, which only the search page loads.
"""

import json
import re
from typing import Any

from sphinx.application import Sphinx

_CONTENT = re.compile(r'<article role="main".*?</article>', re.DOTALL)
_FORMULA = re.compile(r'(class="math[^>]*>)[^<]*')  # in TeX, which an excerpt would show
_TEXTS = "page_texts.js"


def add_scripts(
    app: Sphinx, page: str, template: str, context: dict[str, Any], tree: object
) -> None:
    """Adds the scripts to the search page."""
    if page == "search":
        app.add_js_file(_TEXTS)
        app.add_js_file("offline_search.js")


def write_texts(app: Sphinx, error: Exception | None) -> None:
    """Writes the content of all pages by address."""
    if error is not None:
        return
    texts = {}
    for name in app.env.found_docs:
        html = (app.outdir / f"{name}.html").read_text(encoding="utf-8")
        if content := _CONTENT.search(html):
            texts[f"{name}.html"] = _FORMULA.sub(r"\1…", content[0])
    script = f"const pageTexts = {json.dumps(texts, sort_keys=True)};\n"
    (app.outdir / "_static" / _TEXTS).write_text(script, encoding="utf-8")


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("html-page-context", add_scripts)
    app.connect("build-finished", write_texts)
