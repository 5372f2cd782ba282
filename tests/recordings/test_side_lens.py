"""Close-ups of planar contacts in pictures, against the run and the picture of the hand."""

from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from PIL import Image

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.figures.lenses import add_lenses
from slipgrasp.figures.still import write_png
from slipgrasp.figures.style import paint, screen_style
from slipgrasp.recordings.clip import Clip
from slipgrasp.recordings.palette import PHASES, WATER
from slipgrasp.recordings.still import Still

PRESETS = ("paper-case-1", "tilted-object", "three-fingers")


@pytest.fixture(scope="module", params=PRESETS)
def run(request):
    return simulate(load_scenario(request.param))


def test_a_close_up_agrees_with_the_run(run):
    times = np.linspace(0.0, run.end_time, 4)
    motion = motion_of(run, times)
    with screen_style():
        lenses = add_lenses(Figure().add_axes((0, 0, 1, 1)), run, motion)
    largest = np.hypot(motion.states.tangential_force[..., 0], motion.states.normal_force).max()
    reach = np.abs(run.trace.slip).max()
    for i, lens in enumerate(lenses):
        inside, cone, backward, forward, _, link, ball, force = lens.artists[2:-2]
        for frame in range(len(times)):
            lens.place(frame)
            turn = _turn(motion.states.object_pose[frame])
            tip, *sides = cone.get_xy()[:3]
            inward = np.mean(sides, axis=0) - tip
            assert_allclose(_unit(turn @ inward), _unit(motion.normals[frame, i]), atol=1e-9)
            middle = np.radians(0.5 * (inside.theta1 + inside.theta2))
            assert_allclose((np.cos(middle), np.sin(middle)), inward / np.hypot(*inward), atol=1e-9)
            slip = motion.states.slip[frame, i, 0]
            assert_allclose(np.hypot(*tip), 0.62 * abs(slip) / max(reach, 1e-6), atol=1e-9)
            so_far = [*run.trace.slip[run.trace.times <= times[frame], i], slip, 0.0]
            for trail, end in ((backward, min(so_far)), (forward, max(so_far))):
                length = np.hypot(*trail.get_xy()[1])
                assert_allclose(length, 0.62 * abs(end) / max(reach, 1e-6), atol=1e-9)
            assert_allclose(ball.get_center() + 0.09 * inward / np.hypot(*inward), tip, atol=1e-9)
            arrow = force.get_xy()[3] - tip
            expected = 0.65 * motion.forces[frame, i] / largest
            assert_allclose(turn @ arrow, expected, atol=1e-9)
            phase = ContactPhase(int(motion.states.phases[frame, i]))
            assert_allclose(ball.get_facecolor()[:3], paint(PHASES[phase]))
            start, end = link.get_xy()[[0, 1]]
            back = motion.joints[frame, i, -2] - motion.joints[frame, i, -1]
            assert_allclose(_unit(turn @ (end - start)), _unit(back), atol=1e-9)


def _turn(pose):
    angle = 2.0 * np.arctan2(pose[6], pose[3])
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def _unit(vector):
    return vector / np.hypot(*vector)


def test_the_chart_of_a_still_shows_a_short_slip_unless_a_clip_is_given():
    run = simulate(load_scenario("paper-case-1"))
    pictures = [
        _chart(run, Still(time=0.06), Clip()),
        _chart(run, Still(time=0.06), Clip(start=0.0, end=run.end_time)),
        _chart(run, Still(), Clip()),
        _chart(run, Still(), Clip(start=0.0, end=run.end_time)),
    ]
    assert pictures[0] != pictures[1] and pictures[2] == pictures[3]


def _chart(run, still, clip):
    """The lower part of a picture, as bytes."""
    stream = io.BytesIO()
    write_png(run, stream, still, clip)
    image = Image.open(stream)
    return image.crop((0, image.height // 2, image.width, image.height)).tobytes()


def test_a_close_up_shows_a_low_friction_patch_while_it_is_there():
    run = simulate(load_scenario("wet-patch"))
    (patch,) = run.scenario.patches
    times = np.array([0.0, patch.start_time - 1e-3, patch.start_time, run.end_time])
    with screen_style():
        axes = Figure().add_axes((0, 0, 1, 1))
        lenses = add_lenses(axes, run, motion_of(run, times))
    dry, wet = sorted(lenses, key=lambda lens: len(lens.artists))
    (water,) = (part for part in wet.artists if _has_colour(part, WATER))
    assert not any(_has_colour(part, WATER) for part in dry.artists)
    seen = []
    for frame in range(len(times)):
        wet.place(frame)
        seen.append(water.get_visible())
    assert seen == [time >= patch.start_time for time in times]


def _has_colour(part, colour):
    return hasattr(part, "get_facecolor") and part.get_facecolor()[:3] == paint(colour)
