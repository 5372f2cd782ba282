"""Every parameter and every fact of a law is used by the kernel, or refused for its hands."""

import ast
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.normal_form import NormalForm, tree_of
from slipgrasp.core.kernel.compilation.records import make_unset_record
from slipgrasp.core.kernel.planar import run as planar_run
from slipgrasp.core.kernel.spatial import run as spatial_run
from slipgrasp.core.run.engine import PlanarEngine
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.space_engine import SpatialEngine
from slipgrasp.core.scenario import (
    CONTROL_LAWS,
    Change,
    ControlLaw,
    ControllerParameters,
    spatial_geometry,
)
from slipgrasp.core.scenario.chain import chain_start
from slipgrasp.core.scenario.field_errors import template_key, template_keys
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.laws import facts_read_for, read_for
from slipgrasp.core.scenario.loading import (
    load_scenario,
    preset_names,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.core.scenario.parameters import describe, hints_of, split_hint
from slipgrasp.core.scenario.space import HANDS, PLANAR, SPATIAL
from slipgrasp.core.scenario.validation import check_scenario
from slipgrasp.core.scenario.validation import space as validation_space
from tests.core.drawn_chains import with_chains
from tests.core.test_chains import trifinger, with_split_joints

pytestmark = pytest.mark.slow

STEPS = {PLANAR: PlanarEngine.advance, SPATIAL: SpatialEngine.advance}
DETECTED = {
    "sensing.true_phases": False,
    "sensing.true_accelerations": False,
    "controller.latency": 0.002,
    "controller.velocity_noise": 0.001,
    "sensing.acceleration_noise": 0.1,
}
ADDED = (
    *({"trajectory.kind": kind} for kind in ("circle", "rotation", "shake", "coast")),
    {"pulses.0.time": 0.1},
    {"fingers.0.kind": "slides"},
    *({"object.shape": shape} for shape in ("circle", "cylinder", "sphere")),
    DETECTED,
    {**DETECTED, "controller.prediction": True, "sensing.slip_detector": "cumulative-sum"},
    {"fingers.0.pad_radius": 0.01},
)
PRISM = [[0.1, -0.1], [0.12, 0.1], [-0.12, 0.1], [-0.1, -0.1]]


@cache
def trees(hand):
    """The code of the kernel that advances a run: what packs its constants is not part of it."""
    codes = NormalForm([STEPS[hand]], (call,)).reached
    return [tree for code in codes if (tree := tree_of(code)) and ".kernel" in code.__module__]


@cache
def names_read(hand):
    """Names of all fields that the kernel reads."""
    nodes = [node for tree in trees(hand) for node in ast.walk(tree)]
    loaded = {n.attr for n in nodes if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Load)}
    return loaded | {
        node.slice.value
        for node in nodes
        if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Constant)
    }


@pytest.mark.parametrize("hand", HANDS)
def test_the_facts_of_laws_that_a_kernel_reads_are_those_declared_for_it(hand):
    read = {
        node.attr
        for tree in trees(hand)
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and getattr(node.value, "attr", "") == "facts"
    }
    assert read == set(facts_read_for(hand))


@dataclass(frozen=True, slots=True, kw_only=True)
class DampingLaw(ControlLaw):
    """A law added as ARCHITECTURE.md says, with a fact that only one kernel knows."""

    damps_slip: bool = read_for(PLANAR)


@pytest.fixture
def _damping(monkeypatch):
    facts = {"kind": "slip-damping", "uses_friction": False, "damps_slip": True}
    law = DampingLaw(summary="A grip that grows with the speed of slips.", **facts)
    monkeypatch.setitem(CONTROL_LAWS, "slip-damping", law)


@pytest.mark.usefixtures("_damping")
def test_a_law_with_a_fact_that_a_kernel_does_not_read_is_refused_there():
    check_scenario(
        with_values(load_scenario("composite-case-2"), {"controller.kind": "slip-damping"})
    )
    told = (
        "controller.kind is 'slip-damping', which is not computed for spatial hands yet; "
        "choose one of theorem-3, theorem-4, certainty-equivalence, pd-gravity, grip-reflex, "
        "gripper, composite"
    )
    scenario = load_scenario("spatial-composite")
    with pytest.raises(ScenarioError) as refusal:
        with_values(scenario, {"controller.kind": "slip-damping"})
    assert [error.message for error in refusal.value.errors] == [told]
    with pytest.raises(ScenarioError) as refusal:
        with_law(scenario, "slip-damping")
    assert told in str(refusal.value)
    change = Change(time=0.1, parameter="controller.kind", value="slip-damping")
    with pytest.raises(ScenarioError, match=r"changes\.0\.value: controller\.kind is 'slip-damp"):
        with_values(replace(scenario, changes=(change,)), {"object.mass": 1.0})


@pytest.mark.parametrize("key", ["controller.recognition_time", "controller.link_length_ratio"])
def test_a_parameter_that_a_kernel_does_not_use_is_refused_there(key):
    value, usual = 1.05 * describe(load_scenario("spatial-box"))[key].value, ControllerParameters()
    told = f"{key} is {value:g}, which is not computed for spatial hands yet; set it to "
    with pytest.raises(ScenarioError) as refusal:
        with_values(load_scenario("spatial-box"), {key: value})
    (error,) = refusal.value.errors
    assert error.message == f"{told}{getattr(usual, key.rpartition('.')[2]):g}"
    assert (error.field, error.value) == (key, f"{value:g}")


@cache
def bytes_read(layout, hand):
    """Which bytes of a record belong to fields that the kernel reads."""
    read = np.zeros(layout.itemsize, bool)
    for name in names_read(hand).intersection(layout.names):
        field, start = layout.fields[name][:2]
        base, shape = field.subdtype or (field, ())
        one = bytes_read(base, hand) if base.names else np.ones(base.itemsize, bool)
        read[start : start + field.itemsize] = np.tile(one, int(np.prod(shape)))
    return read


def part_read(record, hand):
    """The bytes of a record that the kernel reads."""
    return np.frombuffer(record.tobytes(), np.uint8)[bytes_read(record.dtype, hand)].tobytes()


def consumed(scenario):
    """All that the kernel is given for a run and reads: constants of all stretches, the start."""
    hand, simulation = scenario.space, Simulation(scenario)
    engine, timetable = simulation._engine, simulation._timetable
    given = [timetable._ends.copy(), part_read(engine.run.step.start, hand)]
    given.append(part_read(engine.run.discrete, hand))
    given += [engine.estimates.tobytes(), engine.outlet.history.tobytes()]
    given.append(part_read(simulation._model, hand))
    while not timetable.is_last:
        engine.pass_instant()
        given.append(part_read(simulation._pack(), hand))
    return given


def other_values(parameter, scenario):
    """What a parameter may be instead."""
    value, kind = parameter.value, parameter.kind
    if kind == "boolean":
        yield not value
    elif kind == "choice":
        yield from (choice for choice in parameter.choices if choice != value)
    elif kind == "text":
        yield from ("object.mass", "object.inertia", "object.inertias.0", "fingers.1.friction")
    elif value is None:
        low = parameter.minimum or 0.0
        yield from (low + 0.01, 1.0, 3.0, 30.0)
    elif kind == "integer":
        yield from (value + 1, value - 1)
    elif kind in ("number", "number-or-list") and not isinstance(value, tuple):
        yield from (1.001 * value, 0.999 * value, value + 0.001, value - 0.001, 0.5 * value, -value)


def bases(hand):
    """Scenarios that together have an entry in every list and use every part."""
    names = preset_names(hand)
    if hand is PLANAR:
        hold = with_law(load_scenario("composite-case-2"), "pd-gravity")
        yield from (with_chains(hold, seed, 1.0) for seed in range(4))
    if hand is SPATIAL:
        # No other base allows both kinds of a first joint; begun with, it keeps the search short.
        yield with_values(trifinger(), {"fingers.0.kind": "slides"})
        yield trifinger()
        yield with_split_joints(load_scenario("spatial-prism"))
        # A finger of links.
        yield with_law(load_scenario("spatial-box"), "composite")
        # A finger that also reaches its contact with a prismatic joint.
        wide = with_lists(load_scenario("trifinger"), {"object.corners": PRISM})
        yield with_law(wide, "composite")
    for preset in map(load_scenario, names):
        yield preset
        composite = with_law(preset, "composite")
        for set_values, each in [(with_values, ADDED), (with_lists, lists_for(preset))]:
            for values in each:
                with suppress(ScenarioError):
                    yield set_values(composite, values)
        for law in CONTROL_LAWS:
            with suppress(ScenarioError):  # soft fingertips refuse some
                yield with_law(preset, law)


def lists_for(scenario):
    """Lists that most scenarios lack."""
    size = 2 * scenario.space.num_coordinates(len(scenario.fingers))
    yield {"controller.lyapunov_matrix": (20.0 * np.eye(size)).tolist()}
    yield {"object.corners": PRISM}
    yield {"changes": [{"time": 0.2, "parameter": "object.mass", "value": 1.1}]}
    yield {"patches": [{"face": scenario.fingers[0].face, "start_time": 0.5}]}
    pose = [*scenario.trajectory.start[:3], *[0.0] * (len(scenario.space.coordinates) - 3)]
    move = {"time": 0.1, "duration": 1.0, "pose": [each + 0.01 for each in pose]}
    yield {"trajectory.kind": "set-points", "trajectory.set_points": [move]}
    rows = [[t, *(each + 0.01 * t for each in pose)] for t in (0.0, 1.0, 2.0)]
    yield {"trajectory.kind": "table", "trajectory.table": rows}


def with_lists(scenario, values):
    """The scenario with some of its parameters or whole lists set."""
    mapping = scenario.to_mapping()
    for key, value in values.items():
        part, _, name = key.partition(".")
        if name:
            mapping[part] = {**mapping.get(part, {}), name: value}
        else:
            mapping[part] = value
    return scenario_from_mapping(mapping)


def uses(scenario, before, key, parameter):
    """Whether the kernel is given anything else where a parameter is another; None: who knows."""
    tried = False
    for value in other_values(parameter, scenario):
        try:
            changed = with_values(scenario, {key: value})
            if consumed(changed) != before:
                return True
            tried = True
        except ScenarioError:
            continue
    return False if tried else None


@pytest.fixture
def _no_chance(monkeypatch):
    """Memory that a run does not set is zero, else what was there before seems to be used."""

    def make_outlet(layout):
        outlet = make_unset_record(layout)
        outlet["history"] = 0.0  # all of it that `consumed` looks at
        return outlet

    for made in (planar_run, spatial_run):
        monkeypatch.setattr(made, "make_unset_record", make_outlet)


@pytest.fixture
def _quick(monkeypatch):
    """Starts of equal chains are found once: most values leave all of them as they were."""
    start = cache(chain_start)
    for module in (spatial_geometry, validation_space):
        monkeypatch.setattr(module, "chain_start", start)


def declared(part, prefix):
    return {
        f"{prefix}{name}": quantity.hands
        for name, hint in hints_of(part).items()
        if (quantity := split_hint(hint)[0]) is not None
    }


@pytest.mark.usefixtures("_no_chance", "_quick")
@pytest.mark.parametrize("hand", HANDS)
def test_every_parameter_that_is_not_declared_for_other_hands_alone_is_read_by_the_kernel(hand):
    controller = type(next(bases(hand)).controller)
    others = {k for k, hands in declared(controller, "controller.").items() if hand not in hands}
    left, known = set(template_keys(hand)) - {"title"}, {}
    for base in bases(hand):
        before = consumed(base)
        for key, parameter in describe(base).items():
            template = template_key(key, hand)
            if template in left and not known.get(template):
                known[template] = uses(base, before, key, parameter)
        left -= {key for key, is_used in known.items() if is_used}
        if left <= others:
            break
    assert left == others
