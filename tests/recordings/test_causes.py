"""When two scenarios first ask for something different."""

from dataclasses import replace

import pytest

from slipgrasp.core.scenario import Change, Patch, Pulse
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.world import SpatialPatch, SpatialPulse
from slipgrasp.recordings.compare.accuracy import first_cause

BASE = load_scenario("composite-case-2")
MASS = Change(time=3.0, parameter="object.mass", value=1.6)
PUSH = Pulse(time=1.0, duration=0.5)
WET = Patch(face="left", start_time=2.0, end_time=4.0)


def with_events(**lists):
    return replace(BASE, **lists)


CASES = {
    "nothing": (BASE, None),
    "a title": (replace(BASE, title="other"), None),
    "how it is stored": (with_values(BASE, {"simulation.output_rate": 50.0}), None),
    "how exactly": (with_values(BASE, {"simulation.relative_tolerance": 1e-10}), None),
    "how long": (with_values(BASE, {"simulation.duration": 3.0}), None),
    "a mass": (with_values(BASE, {"object.mass": 1.1}), 0.0),
    "the law": (with_values(BASE, {"controller.kind": "theorem-4"}), 0.0),
    "a change": (with_events(changes=(MASS,)), 3.0),
    "a push": (with_events(pulses=(PUSH,)), 1.0),
    "a low-friction patch": (with_events(patches=(WET,)), 2.0),
    "a low-friction patch from the start": (
        with_events(patches=(replace(WET, start_time=0.0),)),
        0.0,
    ),
    "a push and a mass": (
        replace(with_events(pulses=(PUSH,)), object=replace(BASE.object, mass=2.0)),
        0.0,
    ),
}


SPATIAL_BASE = load_scenario("spatial-composite")
SPATIAL_PUSH = SpatialPulse(time=1.0, duration=0.5)
SPATIAL_WET = SpatialPatch(face="side-0", start_time=2.0, end_time=4.0)
SPATIAL_CASES = {
    "a push": ({"pulses": (SPATIAL_PUSH,)}, 1.0),
    "a low-friction patch": ({"patches": (SPATIAL_WET,)}, 2.0),
    "two low-friction patches": (
        {"patches": (replace(SPATIAL_WET, start_time=3.0), SPATIAL_WET)},
        2.0,
    ),
    "a mass": ({"changes": (MASS,)}, 3.0),
}


@pytest.mark.parametrize("what", SPATIAL_CASES)
def test_the_first_cause_of_spatial_hands_is_the_first_difference_that_acts(what):
    lists, expected = SPATIAL_CASES[what]
    other = replace(SPATIAL_BASE, **lists)
    assert first_cause(SPATIAL_BASE, other) == first_cause(other, SPATIAL_BASE) == expected
    assert first_cause(other, other) is None


def test_another_radius_of_a_patch_acts_once_the_patch_is_there():
    first = replace(SPATIAL_BASE, patches=(SPATIAL_WET,))
    other = replace(SPATIAL_BASE, patches=(replace(SPATIAL_WET, radius=0.05),))
    assert first_cause(first, other) == 2.0


@pytest.mark.parametrize("what", CASES)
def test_a_difference_acts_from_its_time_on(what):
    other, expected = CASES[what]

    assert first_cause(BASE, other) == first_cause(other, BASE) == expected


def test_events_that_both_have_are_no_cause():
    first = with_events(changes=(MASS,), pulses=(PUSH,), patches=(WET,))

    assert first_cause(first, first) is None
    assert first_cause(first, replace(first, pulses=(PUSH, replace(PUSH, time=5.0)))) == 5.0
    assert first_cause(first, replace(first, changes=(replace(MASS, value=1.7),))) == 3.0
    assert first_cause(first, replace(first, changes=(replace(MASS, time=2.5),))) == 2.5


def test_pushes_and_low_friction_patches_that_begin_alike_differ_when_one_ends():
    first = with_events(pulses=(PUSH,), patches=(WET,))

    assert first_cause(first, replace(first, pulses=(replace(PUSH, duration=0.2),))) == 1.2
    assert first_cause(first, replace(first, patches=(replace(WET, end_time=None),))) == 4.0


def test_the_order_in_which_things_are_listed_is_no_cause():
    other = replace(PUSH, time=1.2)

    assert first_cause(with_events(pulses=(PUSH, other)), with_events(pulses=(other, PUSH))) is None


def test_a_low_friction_patch_that_changes_its_friction_differs_from_then_on():
    first = with_events(patches=(WET,))
    dries = Change(time=3.0, parameter="patches.0.friction_factor", value=0.9)

    assert first_cause(first, replace(first, changes=(dries,))) == 3.0
    # What lies there no longer has no friction to change.
    late = replace(dries, time=5.0)
    assert first_cause(first, replace(first, changes=(late,))) is None


def test_an_estimate_that_is_set_anew_is_a_cause_each_time():
    once = Change(time=1.0, parameter="estimates.0.initial", value=0.5)
    again = replace(once, time=2.0)

    assert first_cause(with_events(changes=(once,)), with_events(changes=(once, again))) == 2.0
