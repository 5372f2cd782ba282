"""Planar fingers that are chains of two joints: the closed forms written as chains, and others."""

import math

import numpy as np
import pytest

from slipgrasp import (
    Simulation,
    load_scenario,
    open_recording,
    register_law,
    simulate,
    verify,
    with_law,
    write_recording,
)
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.chain import chain_points
from slipgrasp.core.scenario.loading import preset_names, scenario_from_mapping, with_values
from slipgrasp.core.scenario.unknowns import name_unknown
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.types import Outcome
from slipgrasp.scene import skeleton
from slipgrasp.scene.parts import entities_of
from slipgrasp.scene.skeleton import frames_of, world_poses
from slipgrasp.scene.states import states_of
from slipgrasp.web.scene.close_ups import arrays_of
from slipgrasp.web.scene.layout import lay_out
from tests.core.drawn_chains import with_chains
from tests.core.drawn_scenarios import KINDS, draw_scenario
from tests.each_case import each_case

pytestmark = pytest.mark.slow

TURN, SHIFT = 0.7, 0.3  # of frames that a finger does not need [rad, m]


def as_chains(scenario, **values):
    """The same hand, its fingers written as chains whose frames are turned and moved."""
    mapping = scenario.to_mapping()
    for finger, links in zip(mapping["fingers"], scenario.fingers, strict=True):
        finger |= chain_of(links)
    for part in (*mapping.get("estimates", ()), *mapping.get("changes", ())):
        for link in (0, 1):
            old, new = f"link_masses.{link}", f"joints.{link}.mass"
            part["parameter"] = part["parameter"].replace(old, new)
    return with_values(scenario_from_mapping(mapping), values)


def chain_of(links):
    """Two links: joint 1 beside the base, and the frame of link 2 turned against its rod."""
    (inner, outer), (x, y) = links.link_lengths, links.base
    centres, inertias = links.link_centre_fractions, links.link_inertia_fractions
    bend = -1.0 if links.elbow == "up" else 1.0
    c, s = math.cos(TURN), math.sin(TURN)
    joints = [
        {"place": (0.0, SHIFT), "centre": (centres[0] * inner, 0.0)},
        {
            "place": (inner, 0.0),
            "attitude": TURN,
            "centre": (c * centres[1] * outer, -s * centres[1] * outer),
        },
    ]
    for k, length in enumerate(links.link_lengths):
        joints[k] |= {
            "mass": links.link_masses[k],
            "unit_inertia": inertias[k] * length**2,
        }
    return {
        "kind": "chain",
        "base": (x + SHIFT * s, y - SHIFT * c),
        "attitude": TURN,
        "joints": joints,
        "tip": (c * outer, -s * outer),
        "posture": (0.0, bend),
    }


def angles_of(run):
    """Joint angles as those of links."""
    return run.trace.joint_position + np.tile([TURN, 0.0], len(run.scenario.fingers))


@pytest.mark.parametrize("preset", preset_names()[::2])
def test_links_written_as_a_chain_give_the_same_run(preset):
    links = load_scenario(preset)
    chain, closed = simulate(as_chains(links)), simulate(links)
    assert chain.outcome is closed.outcome
    ours, theirs = ([(c.contact, c.to_phase) for c in run.phase_changes] for run in (chain, closed))
    assert ours == theirs
    times = [[change.time for change in run.phase_changes] for run in (chain, closed)]
    np.testing.assert_allclose(times[0], times[1], rtol=0.0, atol=1e-9)
    turns = (angles_of(chain)[-1] - closed.trace.joint_position[-1]) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), rtol=0.0, atol=1e-9)
    for name in ("object_pose", "slip", "joint_velocity", "estimates", "kinetic_energy"):
        ours, theirs = (getattr(run.trace, name)[-1] for run in (chain, closed))
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)
    for name in ("joint_torque", "normal_force", "supplied_energy"):
        ours, theirs = (getattr(run.trace, name)[-1] for run in (chain, closed))
        np.testing.assert_allclose(ours, theirs, rtol=1e-8, atol=1e-8)
    assert np.abs(chain.trace.energy_residual).max() < 1e-6


def telescope_and_rail(law="composite", duration=1.0):
    """A left finger that turns and extends, a right one that slides below the object and turns."""
    mapping = load_scenario("composite-case-2").to_mapping()
    x, y, _ = mapping["trajectory"]["start"]
    rod = {"mass": 0.8, "centre": (0.4, 0.0), "unit_inertia": 0.05}
    telescope = {"kind": "prismatic", "mass": 0.5, "centre": (-0.3, 0.1), "unit_inertia": 0.02}
    rail = {"kind": "prismatic", "axis": (1.0, 0.0), "mass": 0.6}
    left, right = mapping["fingers"]
    left |= {
        "kind": "chain",
        "base": (x - 1.2, y + 0.7),
        "joints": [rod, telescope],
        "tip": (0.1, 0.0),
        "posture": (-0.5, 1.0),
    }
    right |= {
        "kind": "chain",
        "base": (x + 0.2, y - 0.5),
        "joints": [rail, rod],
        "tip": (0.9, 0.0),
        "posture": (0.4, 2.5),
    }
    mapping["estimates"] = [
        {"parameter": key, "initial": initial, "minimum": 0.05, "maximum": 10.0}
        for key, initial in (
            ("object.mass", 1.2),
            ("fingers.0.joints.1.mass", 0.6),
            ("fingers.1.joints.0.mass", 0.5),
        )
    ]
    values = {"controller.kind": law, "controller.grip_force": 40.0}
    values["simulation.duration"] = duration
    return with_values(scenario_from_mapping(mapping), values)


@pytest.mark.parametrize("law", ["theorem-3", "composite", "pd-gravity", "grip-reflex"])
def test_every_law_holds_an_object_with_a_telescope_and_a_rail(law, tmp_path):
    scenario = telescope_and_rail(law)
    run = simulate(scenario)
    assert run.outcome is Outcome.COMPLETED and run.metrics.held
    assert np.abs(run.trace.energy_residual).max() < 1e-6
    units = {column.name: column.unit for column in columns_of(run.trace)}
    assert [units[f"joint_position_0_{k}"] for k in range(2)] == ["rad", "m"]
    name = name_unknown(scenario, "fingers.1.joints.0.mass")
    assert name == "the mass of link 1 of the right finger"
    write_recording(run, tmp_path / "run.mcap")
    assert verify(open_recording(tmp_path / "run.mcap")).same


def test_chains_are_drawn_at_their_joints():
    run = simulate(telescope_and_rail(duration=0.02))
    poses = world_poses(frames_of(run.scenario), states_of(run.trace))
    angles = run.trace.joint_position.reshape(len(run.trace), 2, 2)
    entities = {entity.name: entity for entity in entities_of(run.scenario)}
    links = arrays_of(run, None, lay_out(run))["link"]
    for i, finger in enumerate(run.scenario.fingers):
        points, _ = chain_points(*finger.chain[1:], angles[:, i])
        points = points[:, :, :2] + finger.base
        names = [*(skeleton.link_frame(i, k) for k in range(2)), skeleton.tip_frame(i)]
        for k, name in enumerate(names):
            np.testing.assert_allclose(poses[name][0][:, [0, 2]], points[:, k], atol=1e-13)
        contact = poses[skeleton.contact_name(i)][0]
        np.testing.assert_allclose(contact[:, [0, 2]], points[:, 2], atol=1e-9)
        (rail,) = entities[f"finger_{i}/rail_{1 - i}"].shapes
        assert rail.start[0] < 0.0 and rail.end[0] > angles[0, i, 1 - i]
        along = points[:, 2] - points[:, 1]
        turned = np.arctan2(along[:, 1], along[:, 0]) - run.trace.object_pose[:, 2]
        np.testing.assert_allclose(np.cos(links[:, i] - turned), 1.0, atol=1e-6)


class Support:
    """Carries the links, and presses."""

    name = "support-the-links"

    def command(self, seen, memory, out):
        lift = np.array([0.0, seen.model.object_mass * seen.model.gravity / len(seen.slip)])
        force = 40.0 * seen.contact_normal + lift
        for i in range(len(seen.slip)):
            out.torque[i] = seen.jacobian[i].T @ force[i] + seen.weight_torque[i]


@pytest.mark.usefixtures("known_laws")
def test_a_custom_law_sees_limits_and_weights_and_holds_the_object_still():
    register_law(Support)
    limits = {"fingers.0.joints.1.torque_limit": 90.0, "fingers.1.joints.0.maximum": 5.0}
    plain = with_values(telescope_and_rail(duration=0.1), {"object.mass": 1.0, **limits})
    masses = {f"estimates.{k}.initial": true for k, true in enumerate((1.0, 0.5, 0.6))}
    at_rest = {"trajectory.acceleration": (0.0, 0.0, 0.0)}
    scenario = with_values(with_law(plain, Support.name), {**masses, **at_rest})
    run = simulate(scenario)
    assert run.outcome is Outcome.COMPLETED
    np.testing.assert_allclose(run.trace.object_pose[-1], run.trace.object_pose[0], atol=1e-9)
    model = next(Simulation(scenario).ticks()).seen.model
    inf = np.inf
    assert model.joint_torque_limit.tolist() == [[inf, 90.0], [inf, inf]]
    assert model.joint_maximum.tolist() == [[inf, inf], [5.0, inf]]
    assert (model.joint_minimum == -inf).all()


@each_case("index", range(2 * len(KINDS)))
def test_random_runs_have_true_outcomes(index):
    from benchmarks.outcome_checks import PLANAR

    scenario = with_chains(draw_scenario(KINDS[index % len(KINDS)], f"chains {index}"), index)
    assert PLANAR.judge(scenario, twice=index % 2 == 0).missed == {}


def test_what_can_be_estimated_is_named_for_every_kind_of_finger_in_the_hand():
    mapping = load_scenario("paper-case-1").to_mapping()
    first, *others = mapping["fingers"]
    chain = {**first, **chain_of(load_scenario("paper-case-1").fingers[0])}
    mapping = {**mapping, "fingers": [chain, *others]}
    with pytest.raises(ScenarioError) as refusal:
        scenario_from_mapping(mapping)
    told = "fingers.N.friction and fingers.N.joints.K.mass, fingers.N.link_masses.K can"
    assert told in str(refusal.value)
