"""The page at its smallest sizes: nothing lies over anything else, and nothing is out of reach."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import pytest
from playwright.sync_api import Error, Locator, Page, ViewportSize

from tests.waiting import wait_until
from tests.web.driving import control, pause

pytestmark = [
    pytest.mark.browser,
    # A viewer may leave in the middle of a frame.
    pytest.mark.filterwarnings("ignore:Queued a .* on a closed connection"),
]

PHONE = ViewportSize(width=360, height=740)
SCENE = "canvas[data-engine]"
STRIP, VERDICT = ".sg-track", ".sg-verdict"


@dataclass(frozen=True)
class Box:
    """Where something is on a page [px]."""

    left: float
    top: float
    right: float
    bottom: float

    def is_beside(self, other: Box) -> bool:
        return self.right <= other.left + 1.0 or other.right <= self.left + 1.0

    def is_across(self, other: Box) -> bool:
        """Whether it is within another from left to right."""
        return other.left - 1.0 <= self.left and self.right <= other.right + 1.0


# All widths of the canvas until the first picture [px].
WATCH_WIDTHS = f"""window.widths = [];
const look = () => {{
  if (document.documentElement?.dataset.sgStarted !== undefined) return;
  const {{ clientWidth: width = 0 }} = document.querySelector('{SCENE}') ?? {{}};
  if (width > 0 && window.widths.at(-1) !== width) window.widths.push(width);
  requestAnimationFrame(look);
}};
look();"""

NOWHERE = Box(-1.0, -1.0, 1e6, 1e6)


def box_of(shown: Locator) -> Box:
    """Everywhere while the page makes it anew, which fits nowhere."""
    box = shown.bounding_box()
    if box is None:
        return NOWHERE
    return Box(box["x"], box["y"], box["x"] + box["width"], box["y"] + box["height"])


# It takes a moment until a page has told its size, and its columns have followed.


@pytest.mark.parametrize("size", [(577, 800), (800, 800), (1024, 700)])
def test_columns_leave_the_scene_its_place_and_the_strip_is_in_it(
    page: Page, size: tuple[int, int]
) -> None:
    page.set_viewport_size(ViewportSize(width=size[0], height=size[1]))
    window = page.locator("[data-floating-window]", has=page.locator(STRIP))

    def fits() -> bool:
        scene = box_of(page.locator(SCENE))
        columns = [box_of(page.locator(VERDICT)), box_of(control(page, "mass [kg]"))]
        return (
            250 <= scene.right - scene.left < size[0]
            and box_of(window).is_across(scene)
            and all(column.is_beside(scene) for column in columns)
        )

    wait_until(fits, "something lies over the scene, or there is none")


def test_the_scene_has_its_width_from_the_start(page: Page) -> None:
    page.set_viewport_size(ViewportSize(width=1180, height=800))
    page.add_init_script(WATCH_WIDTHS)
    page.reload()
    page.wait_for_function("document.documentElement.dataset.sgStarted !== undefined")
    pause(page)  # A picture that plays takes the time of everything else.
    (width,) = page.evaluate("window.widths")
    scene = page.locator(SCENE)
    wait_until(lambda: scene.evaluate("e => e.clientWidth") == width, "another width")


def test_a_phone_has_the_picture_the_strip_how_it_went_and_the_controls(page: Page) -> None:
    page.set_viewport_size(PHONE)
    page.locator(".mantine-Paper-root", has=page.locator(STRIP)).first.wait_for()
    whole = box_of(page.locator("body"))

    def is_reached(shown: Locator) -> bool:
        with suppress(Error):  # where the page draws it anew meanwhile
            shown.scroll_into_view_if_needed()
        strip, box = box_of(page.locator(STRIP)), box_of(shown)
        return (
            strip.top > 0.4 * PHONE["height"]
            and strip.is_across(whole)
            and box.is_across(whole)
            and strip.bottom <= box.top
            and box.bottom <= PHONE["height"]
        )

    for shown in (page.locator(VERDICT), control(page, "mass [kg]")):
        wait_until(lambda shown=shown: is_reached(shown), "it lies below the strip, or outside")


def test_on_a_phone_tabs_are_on_one_line_and_the_controls_of_time_on_two(page: Page) -> None:
    page.set_viewport_size(PHONE)
    tabs = page.get_by_role("tablist").filter(has_text="Recordings").get_by_role("tab")
    controls = page.locator(".sg-transport > :visible")

    def is_in_lines(shown: Locator, count: int) -> bool:
        boxes = [box_of(each) for each in shown.all()]
        lines = {round(0.5 * (box.top + box.bottom)) for box in boxes}
        return len(lines) == count and all(
            box.is_across(box_of(page.locator("body"))) for box in boxes
        )

    wait_until(lambda: tabs.count() == 5 and is_in_lines(tabs, 1), "a tab wraps")
    wait_until(lambda: is_in_lines(controls, 2), "the controls of time need more than two lines")
