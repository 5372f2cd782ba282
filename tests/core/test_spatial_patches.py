"""Round low-friction patches on the faces of an object in space."""

import math

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome

# Three fingertips slide 40 mm straight up their faces, then rest.
SLIDING = with_values(load_scenario("spatial-unknown-friction"), {"simulation.duration": 0.15})
# All rest from 0.11 s on.
STILL = 0.12
OWN = 0.25


def wet(scenario, *patches):
    """The scenario with patches, each given by what differs from (side-0, in its middle, half)."""
    usual = {"face": "side-0", "friction_factor": 0.5}
    entries = [{**usual, **patch} for patch in patches]
    return scenario_from_mapping({**scenario.to_mapping(), "patches": entries})


def crossings(result, contact=0):
    """Time, slip and friction on both sides wherever the friction of a contact jumps."""
    trace = result.trace
    friction = trace.friction_coefficient[:, contact]
    return [
        (float(trace.times[k]), trace.slip[k, 2 * contact : 2 * contact + 2], *friction[k : k + 2])
        for k in np.flatnonzero(np.diff(friction))
    ]


@pytest.mark.parametrize("friction", ["cone", "pyramid"])
def test_a_rim_is_crossed_where_it_is_and_not_between_two_samples(friction):
    scenario = with_values(SLIDING, {"simulation.friction": friction})
    patch = {"centre": (0.02, 0.002), "radius": 0.005}
    (t_in, into, *entering), (t_out, out_of, *leaving) = crossings(simulate(wet(scenario, patch)))
    half_chord = math.sqrt(0.005**2 - 0.002**2)
    np.testing.assert_allclose(into, (0.02 - half_chord, 0.0), atol=1e-11)
    np.testing.assert_allclose(out_of, (0.02 + half_chord, 0.0), atol=1e-11)
    assert entering == [OWN, 0.5 * OWN] and leaving == [0.5 * OWN, OWN]
    assert t_in < t_out


@pytest.mark.parametrize("middle", np.linspace(0.01, 0.0106, 7).tolist())
def test_a_patch_is_met_that_is_shorter_than_what_is_slid_in_one_control_period(middle):
    spot = {"centre": (middle, 9e-5), "radius": 1e-4}
    (_, into, *_), (_, out_of, *_) = crossings(simulate(wet(SLIDING, spot)))
    assert SLIDING.controller.control_period * 0.4 > 4.0 * (out_of[0] - into[0])
    half_chord = math.sqrt(1e-8 - 8.1e-9)
    np.testing.assert_allclose((into[0], out_of[0]), (middle - half_chord, middle + half_chord))


def test_a_patch_does_what_timed_changes_of_friction_at_its_rim_do():
    result = simulate(wet(SLIDING, {"centre": (0.02, 0.0), "radius": 0.004}))
    (t_in, *_), (t_out, *_) = crossings(result)
    mapping = SLIDING.to_mapping()
    changes = [
        {"time": t, "parameter": "fingers.0.friction", "value": value}
        for t, value in ((t_in, 0.5 * OWN), (t_out, OWN))
    ]
    timed = simulate(scenario_from_mapping({**mapping, "changes": changes}))
    np.testing.assert_allclose(result.metrics.slip_path, timed.metrics.slip_path, rtol=1e-9)
    assert [c.time for c in result.phase_changes] == pytest.approx(
        [c.time for c in timed.phase_changes], abs=1e-11
    )
    assert np.abs(result.trace.energy_residual).max() < 2e-9
    assert result.metrics.slip_path[0] > simulate(SLIDING).metrics.slip_path[0] + 1e-4


def test_where_patches_overlap_their_factors_multiply():
    spots = (
        {"centre": (0.02, 0.0), "radius": 0.005, "friction_factor": 0.8},
        {"centre": (0.02, 0.0), "radius": 0.003, "friction_factor": 0.5},
    )
    seen = [after / OWN for *_, after in crossings(simulate(wet(SLIDING, *spots)))]
    assert seen == pytest.approx([0.8, 0.4, 0.8, 1.0])


def test_a_face_that_becomes_wet_under_a_fingertip_lets_it_slip_and_dries():
    spot = {"friction_factor": 0.1, "radius": 0.2, "start_time": 0.12, "end_time": 0.125}
    result = simulate(wet(SLIDING, spot))
    later = [c for c in result.phase_changes if c.time > STILL - 1e-9 and c.contact == 0]
    assert (later[0].time, later[0].to_phase) == (0.12, ContactPhase.SLIP)
    (_, _, *becoming), (_, _, *drying) = crossings(result)
    assert becoming == pytest.approx([OWN, 0.1 * OWN]) and drying == pytest.approx([0.1 * OWN, OWN])
    assert result.outcome is Outcome.COMPLETED


@pytest.mark.parametrize(("factor", "felt"), [(0.5, 0.5), (2.0, 1.0)])
def test_at_rest_on_a_rim_the_smaller_friction_holds(factor, felt):
    spot = {"centre": (0.0, 0.01), "radius": 0.01, "friction_factor": factor}
    held = with_values(load_scenario("spatial-composite"), {"simulation.duration": 0.001})
    trace = simulate(wet(held, spot)).trace
    assert trace.friction_coefficient[0, 0] == felt * held.fingers[0].friction


def test_a_fingertip_that_slides_off_its_face_in_a_low_friction_patch_has_left_it():
    spot = {"radius": 1.0, "friction_factor": 0.0}
    scenario = with_values(SLIDING, {f"fingers.{i}.contact_offset.0": 0.13 for i in range(3)})
    result = simulate(wet(scenario, *({**spot, "face": f"side-{k}"} for k in range(3))))
    assert result.reason is not None and result.reason.code == "contact_left_face"


def test_a_patch_is_made_by_setting_what_differs_from_a_usual_one():
    made = with_values(SLIDING, {"patches.0.face": "top", "patches.0.centre.1": 0.01})
    (patch,) = made.patches
    assert (patch.face, patch.centre, patch.radius) == ("top", (0.0, 0.01), 0.03)
    assert scenario_from_mapping(made.to_mapping()) == made
