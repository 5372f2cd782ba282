"""A fit compared with MuJoCo's `sysid` toolbox, on one noisy recording of a sliding contact.

The recording is ours: case I with other mass and friction. Both fit the pose of the object. Our fit
simulates the controller of the scenario; MuJoCo has no controller, and uses the torques of the
recording without noise. It needs ``pip install 'mujoco[sysid]'``.
"""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stdout
from dataclasses import replace
from typing import Any, NamedTuple

import mujoco
import numpy as np
from mujoco import sysid

from benchmarks.report import Table
from slipgrasp.core.fit.fit import fit
from slipgrasp.core.fit.problem import FitProblem, Observations
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.recordings.engines.expected import mean_torques
from slipgrasp.recordings.engines.mjcf import (
    describe_contact,
    describe_scene,
    motors,
    start_coordinates,
)

SEED = 1
PRESET = "paper-case-1"
TRUTH = {"object.mass": 1.13, "fingers.0.friction": 0.27}
RECORDINGS = 10
STEP = 2.5e-4  # [s]
SIGMA = 2e-4  # [m, rad]
VALUES = {"simulation.duration": 0.3, "controller.control_period": 0.0}
POSE = ("x", "y", "theta")


class Estimate(NamedTuple):
    """A parameter and its 95 % interval; None if unbounded."""

    value: float | None
    low: float | None
    high: float | None

    def holds(self, true: float) -> bool:
        """Whether the interval contains a value."""
        low = -np.inf if self.low is None else self.low
        return low <= true <= (np.inf if self.high is None else self.high)


Fit = Callable[[Any, RunResult, Observations], dict[str, Estimate]]


def run(seed: int = SEED) -> list[Table]:
    """The table ``sysid``."""
    base = with_values(load_scenario(PRESET), VALUES)
    recorded = simulate(with_values(base, TRUTH))
    data = [_measure(recorded, seed + k) for k in range(RECORDINGS)]
    fits: dict[str, Fit] = {"slipgrasp": _ours, "mujoco.sysid": _theirs}
    rows = [
        row for name, fitted in fits.items() for row in _rows(name, fitted, base, recorded, data)
    ]
    heads = (
        "",
        "value",
        "95 % from",
        "to",
        f"intervals with the true value, of {RECORDINGS}",
        "CPU time",
    )
    truth = ", ".join(f"{key} {value}" for key, value in TRUTH.items())
    notes = (f"Truth: {truth}. Values and intervals of the first recording, CPU time per fit.",)
    return [Table("sysid", heads, tuple(rows), notes, page="fit.md")]


def _rows(
    name: str, fitted: Fit, base: Any, recorded: RunResult, data: Sequence[Observations]
) -> Iterator[tuple[str, ...]]:
    start = time.process_time()
    found = [fitted(base, recorded, each) for each in data]
    seconds = (time.process_time() - start) / len(data)
    for key, true in TRUTH.items():
        numbers = ("–" if n is None else f"{n:.4f}" for n in found[0][key])
        held = sum(each[key].holds(true) for each in found)
        yield (f"{name}: {key}", *numbers, str(held), f"{seconds:.1f} s")


def _measure(recorded: RunResult, seed: int) -> Observations:
    """The pose of the object with noise."""
    columns = {c.name: (c.unit, c.values) for c in columns_of(recorded.trace) if c.name in POSE}
    data = Observations.choose(recorded.trace.times, columns, dict.fromkeys(POSE, SIGMA))
    noise = SIGMA * np.random.default_rng(seed).standard_normal(data.values.shape)
    return replace(data, values=data.values + noise)


def _ours(base: Any, _recorded: RunResult, data: Observations) -> dict[str, Estimate]:
    report = fit(FitProblem.make(base, [*TRUTH], data))
    return {key: Estimate(p.value, p.low, p.high) for key, p in report.parameters.items()}


def _theirs(base: Any, recorded: RunResult, data: Observations) -> dict[str, Estimate]:
    spec, controls, state = _scene(base, recorded)
    steps = np.arange(len(controls)) * STEP
    measured = sysid.TimeSeries.from_names(data.times, data.values, spec.compile())
    sequence = sysid.ModelSequences(
        "hand", spec, "recording", state, sysid.TimeSeries(steps, controls), measured
    )
    residual = sysid.build_residual_fn(models_sequences=[sequence])
    with redirect_stdout(io.StringIO()):
        parameters, result = sysid.optimize(_parameters(base), residual, verbose=False)
    residuals = residual(result.x, parameters)[0]
    _, reach = sysid.calculate_intervals(residuals, result.jac)
    return {
        key: Estimate(value, value - width, value + width)
        for key, value, width in zip(TRUTH, map(float, result.x), map(float, reach), strict=True)
    }


def _scene(base: Any, recorded: RunResult) -> tuple[mujoco.MjSpec, Any, Any]:
    """MuJoCo's scene with sensors of the pose, the torques of the recording, and the start."""
    angles = recorded.trace.joint_position[0]
    contact = describe_contact(STEP)
    spec = mujoco.MjSpec.from_string(describe_scene(base, angles, STEP, motors(base), contact))
    for joint, name in zip(_object(spec).joints, POSE, strict=False):
        joint.name = f"object_{name}"
        spec.add_sensor(
            name=name,
            type=mujoco.mjtSensor.mjSENS_JOINTPOS,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            objname=joint.name,
        )
    model = spec.compile()
    start = start_coordinates(base, angles)
    state = sysid.create_initial_state(model, start, np.zeros(model.nv), np.zeros(model.na))
    return spec, mean_torques(recorded, STEP), state


def _parameters(base: Any) -> sysid.ParameterDict:
    """The same parameters with the same ranges, from the values of the scenario."""
    setters: dict[str, Callable[[Any, Any], None]] = {
        "object.mass": lambda spec, p: setattr(_object(spec), "mass", p.value[0]),
        "fingers.0.friction": lambda spec, p: _tip(spec).friction.__setitem__(0, p.value[0]),
    }
    found = sysid.ParameterDict()
    definitions = parameter_definitions(base)
    for key, setter in setters.items():
        low, high = definitions[key].typical or (0.0, 1.0)
        value = float(definitions[key].value or 0.0)  # pyright: ignore[reportArgumentType]
        found.add(sysid.Parameter(key, value, low, high, modifier=setter))
    return found


def _object(spec: Any) -> Any:
    boxes = (g for g in spec.geoms if g.type == mujoco.mjtGeom.mjGEOM_BOX)
    return next(boxes).parent


def _tip(spec: Any) -> Any:
    return next(g for g in spec.geoms if g.type == mujoco.mjtGeom.mjGEOM_SPHERE)
