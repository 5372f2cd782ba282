"""Takes the images of the dashboard in the README and docs/dashboard.md.

    python -m docs.take_pictures                # all of them, in some minutes
    python -m docs.take_pictures slip study     # those of some stories

Each story is played once per window size and theme, each in a separate page of a Chromium, with a
server on a temporary folder. The simulations have fixed parameters, so that later calls show the
same runs.
"""

from __future__ import annotations

import argparse
import io
import json
import re
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any, Literal, NamedTuple

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from slipgrasp import load_scenario, simulate, with_values
from slipgrasp.server.settings import Settings
from slipgrasp.web.app import create_dashboard_app
from tests.ensure_programs import FLAGS, find_chromium
from tests.server.serving import RunningServer, serve
from tests.waiting import PATIENCE
from tests.web.driving import pause, pause_at, select_part, set_number

FOLDER = Path(__file__).parent / "images" / "dashboard"
SIZES = ((1440, 900), (1024, 700))
THEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")

COLOURS = 256
_GRID = 15
_WEIGHTS = (1.0, 20.0)
_UNEQUAL = {"fingers.0.friction": 0.25, "fingers.1.friction": 0.3}
_RUNS: dict[str, tuple[str, dict[str, Any]]] = {
    **{f"Q = {q:g}": ("paper-case-1", {"controller.lyapunov_weight": q}) for q in _WEIGHTS},
    "theorem 4": ("composite-case-2", {**_UNEQUAL, "controller.kind": "theorem-4"}),
    "composite": ("composite-case-2", _UNEQUAL),
    "three fingers": ("three-fingers", {}),
    "low-friction patch": ("wet-patch", {"controller.kind": "pd-gravity"}),
    "space": ("spatial-prism", {}),
}
_STUDY: dict[str, Any] = {
    "title": "Case I: mass and friction, Q = 1 and 20",
    "base": "paper-case-1",
    "recordings": "none",
    "sampling": {"method": "grid"},
    "vary": {
        "object.mass": {"min": 0.1, "max": 30.0, "count": _GRID, "scale": "log"},
        "fingers.*.friction": {"min": 0.02, "max": 3.0, "count": _GRID, "scale": "log"},
        "controller.lyapunov_weight": {"values": list(_WEIGHTS)},
    },
}
# 1.73 kg at friction 0.24, adapting slowly: lost, while the same cell of the other map is held.
_MEMBER = (7 * _GRID + 7) * len(_WEIGHTS)
_LOOK_AGAIN_MS, _LOOKS = 500, 60
# viser warns that there is no graphics card, once it has detected this.
_NO_WARNING = ".mantine-Notification-root { display: none }"


class Stage(NamedTuple):
    """The settings of the stories.

    Attributes:
        url: Address of the dashboard.
        run_ids: Stored runs, by name.
    """

    url: str
    run_ids: dict[str, str]


def show_slip(page: Page, stage: Stage) -> None:
    """Both fingertips slip in case I; the controller underestimates the mass."""
    _open(page, stage.url)
    page.get_by_text("Saved as").wait_for()
    pause_at(page, 0.08)


def show_comparison(page: Page, stage: Stage) -> None:
    """Case I with slow adaptation, still slipping, and with fast adaptation, pale below it."""
    _compare(page, stage, "Q = 1", "Q = 20", 0.2)


def show_laws(page: Page, stage: Stage) -> None:
    """Unequal friction: the paper's law loses the object; the composite law is pale below it."""
    _compare(page, stage, "theorem 4", "composite", 0.1)


def show_three_fingers(page: Page, stage: Stage) -> None:
    """Two fingers on the sides and one below."""
    _replay(page, stage, "three fingers", 0.005)


def show_space(page: Page, stage: Stage) -> None:
    """A prism slips between three fingers of a spatial hand."""
    _replay(page, stage, "space", 0.06)


def show_low_friction_patch(page: Page, stage: Stage) -> None:
    """The left face has become wet, and its fingertip slips."""
    _replay(page, stage, "low-friction patch", 3.06)


def show_study(page: Page, stage: Stage) -> None:
    """The masses and frictions that are held in case I, and one of the runs."""
    _open(page, stage.url)
    pause(page)
    page.get_by_role("tab", name="Study").click()
    _choose(page, "studies", _STUDY["title"])
    marks = page.locator(".sg-map [data-sg-intent]")
    marks.first.wait_for()
    intents = marks.evaluate_all("marks => marks.map(mark => mark.dataset.sgIntent)")
    index = next(i for i, intent in enumerate(intents) if json.loads(intent)["index"] == _MEMBER)
    marks.nth(index).click()
    page.locator(".sg-map-ring").wait_for()
    pause_at(page, 0.25)


def show_end(page: Page, stage: Stage) -> None:
    """Case I, 2 kg and slow adaptation: the object sags until a fingertip leaves its face."""
    _open(page, stage.url)
    pause(page)
    _choose(page, "scenario", "paper-case-1")
    page.get_by_text("stopped at t = 87 ms").wait_for()
    _choose(page, "controls act", "on the whole run")
    select_part(page, "all")
    set_number(page, "Lyapunov weight Q", "1")
    select_part(page, "object")
    set_number(page, "mass [kg]", "2")
    page.get_by_text("slid off its face").first.wait_for()
    page.get_by_text("Saved as").wait_for()
    page.get_by_role("combobox", name="scenario").scroll_into_view_if_needed()
    page.evaluate("document.activeElement.blur()")
    page.keyboard.press("x")
    page.keyboard.press("End")


STORIES: dict[str, Callable[[Page, Stage], None]] = {
    "slip": show_slip,
    "compare": show_comparison,
    "study": show_study,
    "ended": show_end,
    "laws": show_laws,
    "three-fingers": show_three_fingers,
    "low-friction-patch": show_low_friction_patch,
    "space": show_space,
}
_TOLD_LARGE_ONLY = ("laws", "three-fingers", "low-friction-patch", "space")


def main(arguments: Sequence[str] | None = None) -> None:
    """Takes the images of the named stories, or of all."""
    parser = argparse.ArgumentParser(description="Takes the pictures of the dashboard.")
    parser.add_argument("stories", nargs="*", choices=[*STORIES, []], help="all if left out")
    parser.add_argument("--output", type=Path, default=FOLDER, help="where the pictures go")
    parsed = parser.parse_args(arguments)
    parsed.output.mkdir(parents=True, exist_ok=True)
    names = parsed.stories or list(STORIES)
    with tempfile.TemporaryDirectory() as folder, _setting_the_stage(Path(folder)) as stage:
        for path in _take(names, stage, parsed.output):
            print(f"{path} {path.stat().st_size / 1e3:.0f} kB")


@contextmanager
def _setting_the_stage(folder: Path) -> Iterator[Stage]:
    """Serves a dashboard with the runs of the stories, and a study of case I."""
    settings = Settings(data_directory=folder)
    with serve(settings, create_dashboard_app(settings)) as running:
        run_ids = {name: _store_run(running, name) for name in _RUNS}
        _run_study(running)
        yield Stage(running.url, run_ids)


def _store_run(running: RunningServer, name: str) -> str:
    store = running.app.state.run_service.store
    preset, values = _RUNS[name]
    run = store.save(simulate(with_values(load_scenario(preset), values)))
    return store.annotate(run.id, name=name).id


def _run_study(running: RunningServer) -> None:
    with running.client() as client:
        answer = client.post("/studies", json=_STUDY).raise_for_status().json()
        while answer["state"] in ("queued", "running"):
            time.sleep(0.5)
            answer = client.get(f"/studies/{answer['id']}").json()
    assert answer["state"] == "completed", answer


def _take(names: Sequence[str], stage: Stage, folder: Path) -> Iterator[Path]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=list(FLAGS))
        for name, size, theme in product(names, SIZES, THEMES):
            if name in _TOLD_LARGE_ONLY and size != SIZES[0]:
                continue
            path = folder / f"{name}-{size[0]}x{size[1]}-{theme}.png"
            _take_one(browser, STORIES[name], stage, size, theme, path)
            yield path
        browser.close()


def _take_one(
    browser: Browser,
    tell: Callable[[Page, Stage], None],
    stage: Stage,
    size: tuple[int, int],
    theme: Literal["light", "dark"],
    path: Path,
) -> None:
    width, height = size
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=theme)
    page.set_default_timeout(1000 * PATIENCE)
    tell(page, stage)
    # No element must appear hovered.
    page.mouse.move(width / 2, 2)
    _reduce(Image.open(io.BytesIO(_picture_at_rest(page)))).save(path, optimize=True)
    page.close()


def _reduce(picture: Image.Image) -> Image.Image:
    """The image with a palette, which needs a third of the space.

    Few pixels may have the colour of a phase: the palette must cover all colours rather than
    resolve frequent ones finely.
    """
    method, dither = Image.Quantize.MAXCOVERAGE, Image.Dither.NONE
    return picture.convert("RGB").quantize(COLOURS, method, kmeans=1, dither=dither)


def _open(page: Page, url: str, **query: str | float) -> None:
    """Opens the dashboard at full resolution, which viser would reduce on a slow machine."""
    more = "".join(f"&{key}={value}" for key, value in query.items())
    page.goto(f"{url}/?fixedDpr=1{more}")
    page.get_by_text(re.compile("^Held")).first.wait_for()
    page.add_style_tag(content=_NO_WARNING)
    # The introduction for new users would cover the results.
    page.locator("[data-sg-welcomed]").click()


def _replay(page: Page, stage: Stage, name: str, t: float) -> None:
    """Opens a stored run at a time."""
    _open(page, stage.url, run=stage.run_ids[name], t=t)
    page.get_by_text(f"Replay of {name}").wait_for()
    pause_at(page, t)


def _compare(page: Page, stage: Stage, name: str, other: str, t: float) -> None:
    """Opens a stored run at a time, with another one pale below it."""
    _open(page, stage.url, run=stage.run_ids[name], t=t)
    page.get_by_text(f"Replay of {name}").wait_for()
    page.get_by_role("tab", name="Recordings").click()
    page.locator(".sg-row", has_text=other).get_by_role("button").first.click()
    page.get_by_role("button", name="Compare with the screen").click()
    page.get_by_role("tab", name="Compare").click()
    page.locator(".sg-compare tr").first.wait_for()
    page.locator(".sg-ghost-lane").first.wait_for()
    pause_at(page, t)


def _choose(page: Page, label: str, option: str) -> None:
    """Chooses the first option of a list that contains a text."""
    page.get_by_role("combobox", name=label, exact=True).click()
    page.locator("[role=option]:visible").filter(has_text=option).first.click()


def _picture_at_rest(page: Page) -> bytes:
    """The page once it no longer changes."""
    before = b""
    for _ in range(_LOOKS):
        picture = page.screenshot(animations="disabled")
        if picture == before:
            break
        before = picture
        page.wait_for_timeout(_LOOK_AGAIN_MS)
    return before


if __name__ == "__main__":
    main()
