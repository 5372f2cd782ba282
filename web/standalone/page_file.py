"""Writes a page: the page of viser, scripts and styles, the kernel and the data, in one file.

Several pages of a site may share the parts that do not depend on their scenarios: `share_in` stores
these in scripts in the same folder, which can also be loaded from ``file://``.
"""

from __future__ import annotations

import gzip
import hashlib
import json
import re
from collections.abc import Callable, Sequence
from functools import cache
from html import escape
from importlib import resources
from pathlib import Path
from typing import Any, BinaryIO

from slipgrasp.core.run.result import RunResult
from slipgrasp.server.viewer.client_page import packed_page, unpack_page, with_head
from slipgrasp.web.model.intents.playback import (
    ChangeSpeed,
    ChooseWindow,
    GoToEdge,
    GoToNextSlip,
    JumpToEvent,
    Step,
    TogglePlay,
    Zoom,
)
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.page.colours import colours_html
from slipgrasp.web.page.keys import keys_html
from slipgrasp.web.standalone.controls import Control, controls_of, usual_controls
from slipgrasp.web.standalone.kernel_data import check_for_page, kernel_file, run_data
from slipgrasp.web.standalone.look import look_of
from slipgrasp.web.standalone.map_data import map_data
from slipgrasp.web.standalone.packing import encode, pack
from slipgrasp.web.standalone.recording_data import recording_data

_DASHBOARD, _OWN = "slipgrasp.web.page", "slipgrasp.web.standalone"
_MODULES = {
    _DASHBOARD: (
        *("charts", "clock", "close_up", "close_up_places", "contact_run", "gestures", "keyboard"),
        *("names", "overlay", "pace", "projection", "session_state", "viser_view"),
    ),
    _OWN: (
        *("address", "close_up_run", "compare", "map", "page", "page_data", "playback", "post"),
        *("recording", "rows", "scene_feed", "words"),
    ),
}
_STYLES = {
    _DASHBOARD: ("charts", "outcome", "study", "viser", "playback", "dashboard", "phone"),
    _OWN: ("page",),
}
_KEYS = (
    *(ChangeSpeed(-1), ChangeSpeed(1), GoToEdge(-1), GoToEdge(1), JumpToEvent(-1)),
    *(JumpToEvent(1), GoToNextSlip(), Step(-1), Step(1), TogglePlay()),
    *(ChooseWindow(WindowChoice.WHOLE), Zoom()),
)

Share = Callable[[str], str]
"""Returns the replacement of HTML that is equal in several pages."""


def write_page(
    result: RunResult,
    stream: BinaryIO,
    controls: Sequence[str],
    command: str = "",
    share: Share = str,
) -> None:
    """Writes a live page, which simulates the scenario of a run.

    Args:
        result: The run that the page shows initially.
        stream: Output.
        controls: Dotted keys of the parameters with sliders.
        command: Command line that runs the scenario; empty if there is none.
        share: Replaces the parts that do not depend on the scenario; by default they stay in the
            file.

    Raises:
        PageError: If a page cannot simulate or show the run.
        ControlError: If a parameter cannot have a slider.
        LinkError: If the kernel has to be linked and the linker is missing.
        PackingError: If this version of viser packs its page differently.
    """
    check_for_page(result)
    sliders = controls_of(result.scenario, controls)
    look = look_of(result, sliders)
    data = {**look.data, **_data_of(result, sliders), "command": command}
    head = "".join(
        (
            f"<title>{escape(result.name)} – slipgrasp</title>",
            f"<script>{_text(_OWN, 'boot.js')}</script>",
            share(f"<style>{_styles()}</style>"),
            keys_html(_KEYS),
            colours_html(),
        )
    )
    body = "".join(
        (
            share(_code()),
            share(_kernel(kernel_file(result.scenario))),
            _packed("sg-data", json.dumps(data, separators=(",", ":")).encode()),
            _packed("sg-formulas", look.formulas.encode()),
            f"<script>{_text(_OWN, 'unpack.js')}{_text(_OWN, 'loader.js')}</script>",
        )
    )
    before, end, after = with_head(unpack_page(packed_page()).page, head).rpartition(b"</body>")
    stream.write(before + body.encode() + end + after)


def write_usual_page(result: RunResult, stream: BinaryIO) -> None:
    """Writes the page of a run with the default sliders; see `write_page`."""
    write_page(result, stream, usual_controls(result.scenario))


def _data_of(result: RunResult, sliders: Sequence[Control]) -> dict[str, Any]:
    """Data of the scripts, in addition to the content of the page."""
    run = run_data(result)
    return {
        "run": run,
        "recording": recording_data(result, run["columns"]),
        "map": map_data(result.scenario, sliders),
    }


def share_in(folder: Path) -> Share:
    """Writes shared HTML to scripts in the folder of the pages, named by their content."""

    def share(html: str) -> str:
        # Inserted scripts are executed, and have ``document.currentScript`` like those of a page.
        script = (
            "document.currentScript.replaceWith("
            f"document.createRange().createContextualFragment({json.dumps(html)}))"
        )
        name = f"shared-{hashlib.sha256(script.encode()).hexdigest()[:16]}.js"
        (folder / name).write_text(script, encoding="utf-8")
        return f'<script src="{name}"></script>'

    return share


@cache
def _code() -> str:
    """The elements with scripts and styles, and what unpacks them."""
    viewer = unpack_page(packed_page())
    return "".join(
        (
            _plain("sg-worker", _worker()),
            _plain("sg-decoder", encode(gzip.compress(viewer.decoder, mtime=0))),
            _packed("sg-style", viewer.style),
            _packed("sg-viewer", viewer.code),
            _packed("sg-modules", _modules()),
        )
    )


@cache
def _kernel(content: bytes) -> str:
    return _packed("sg-kernel", content)


def _modules() -> bytes:
    """The scripts by name, as JSON, without the formulas."""
    texts = {
        name: _text(package, f"{name}.js") for package, names in _MODULES.items() for name in names
    }
    return json.dumps(texts).encode()


def _worker() -> str:
    """The script of the worker, with the interface of the kernel."""
    kernel = _text(_OWN, "kernel.js").replace("export ", "")
    return _text(_OWN, "unpack.js") + kernel + _text(_OWN, "worker.js")


def _styles() -> str:
    texts = (_text(package, f"{name}.css") for package, names in _STYLES.items() for name in names)
    return re.sub(r"@import [^;]+;|/\*.*?\*/\s*", "", "".join(texts), flags=re.DOTALL)


def _text(package: str, name: str) -> str:
    return resources.files(package).joinpath(name).read_text(encoding="utf-8")


def _plain(name: str, content: str) -> str:
    """A text element for scripts; its content must not contain an end tag."""
    assert "</script" not in content, "the text ends its element"
    return f'<script type="text/plain" id="{name}">{content}</script>'


def _packed(name: str, content: bytes) -> str:
    """A text element with packed content."""
    return _plain(name, pack(content))
