"""A camera that frames the hand until the user takes it over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from slipgrasp.web.model.page_layout import Picture
from slipgrasp.web.scene.boxes import with_close_ups
from slipgrasp.web.scene.camera import OPENING, FrontCamera, frame_box, frame_nearest

LOW, HIGH = np.array([0.0, 0.0]), np.array([3.0, 2.0])
WIDE, NARROW = Picture(1000, 800, 200), Picture(600, 800, 200)
LOW_PICTURE = Picture(1000, 800, 400)
FAR_AWAY = (9.0, -3.0, 4.0)


@dataclass
class StandIn:
    """What a viewer's camera is told."""

    image_width: int = 1000
    image_height: int = 800
    fov: float = 0.0
    up_direction: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    look_at: tuple[float, float, float] = (0.0, 0.0, 0.0)


@pytest.fixture
def viewer() -> StandIn:
    return StandIn()


@pytest.fixture
def camera(viewer: StandIn) -> FrontCamera:
    camera = FrontCamera(viewer)
    camera.measure(WIDE)
    camera.show([(LOW, HIGH)])
    return camera


def place(picture: Picture) -> tuple[float, float, float]:
    return frame_box(LOW, HIGH, picture).position


def test_the_hand_is_framed_again_when_the_page_is_resized(
    camera: FrontCamera, viewer: StandIn
) -> None:
    assert viewer.position == place(WIDE)
    camera.measure(NARROW)
    assert viewer.position == place(NARROW)


def test_the_camera_stays_during_a_drag_and_then_follows(
    camera: FrontCamera, viewer: StandIn
) -> None:
    camera.hold(is_held=True)
    camera.measure(NARROW)
    camera.show([(LOW, 2.0 * HIGH)])
    assert viewer.position == place(WIDE)
    camera.hold(is_held=False)
    assert viewer.position == frame_box(LOW, 2.0 * HIGH, NARROW).position


def test_a_line_that_wraps_and_no_longer_wraps_in_the_panel_moves_the_camera_once(
    camera: FrontCamera, viewer: StandIn
) -> None:
    taller = Picture(1000, 800, 216)
    for picture in (taller, WIDE, taller, WIDE):
        camera.measure(picture)
        assert viewer.position == place(taller)
    camera.measure(Picture(1000, 800))
    assert viewer.position == place(Picture(1000, 800))


def test_a_camera_that_was_moved_by_hand_is_left_alone_until_it_is_asked_to_look_at_the_front(
    camera: FrontCamera, viewer: StandIn
) -> None:
    camera.report(place(WIDE))
    camera.report(FAR_AWAY)
    camera.measure(NARROW)
    assert viewer.position == place(WIDE)
    camera.frame()
    assert viewer.position == place(NARROW)


def test_reports_from_before_the_camera_was_put_there_do_not_count_as_moved(
    camera: FrontCamera, viewer: StandIn
) -> None:
    camera.report(FAR_AWAY)
    camera.measure(NARROW)
    assert viewer.position == place(NARROW)


def test_a_late_report_of_where_the_camera_was_does_not_count_as_moved(
    camera: FrontCamera, viewer: StandIn
) -> None:
    camera.report(place(WIDE))
    camera.measure(NARROW)
    camera.report(place(NARROW))
    camera.report(place(WIDE))
    camera.measure(LOW_PICTURE)
    assert viewer.position == place(LOW_PICTURE)
    camera.report(place(LOW_PICTURE))
    camera.report(FAR_AWAY)
    camera.measure(WIDE)
    assert viewer.position == place(LOW_PICTURE)


def test_a_page_that_returns_to_the_camera_of_its_opening_is_framed_again(
    camera: FrontCamera, viewer: StandIn
) -> None:
    camera.report(place(WIDE))
    viewer.position = OPENING.position
    camera.report(OPENING.position)
    assert viewer.position == place(WIDE)
    camera.measure(NARROW)
    assert viewer.position == place(NARROW)


def test_another_run_of_the_same_size_does_not_move_the_camera(
    camera: FrontCamera, viewer: StandIn
) -> None:
    viewer.position = FAR_AWAY
    camera.show([(LOW, HIGH)])
    assert viewer.position == FAR_AWAY
    camera.show([(LOW, HIGH + 1.0)])
    assert viewer.position != FAR_AWAY


def test_a_low_view_is_framed_with_close_ups_beside_the_hand_if_that_is_clearly_nearer() -> None:
    low, high = np.array([0.0, 0.0]), np.array([1.0, 1.0])
    above, beside = with_close_ups(low, high, 2)
    assert beside[0][0] < above[0][0] and beside[1][1] < above[1][1]
    for picture, box in ((Picture(700, 900, 200), above), (Picture(870, 750, 280), beside)):
        assert frame_nearest((above, beside), picture) == frame_box(*box, picture)
    _, tall = with_close_ups(low, high, 6)
    assert tall[1][1] - tall[0][1] > 1.9
    assert frame_nearest((above,), WIDE) == frame_box(*above, WIDE)
