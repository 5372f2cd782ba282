"""The formats of scenes, each with the expected motion in its engine."""

from __future__ import annotations

from typing import Any

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.engines import mjcf, sdf, usd
from slipgrasp.recordings.engines.bodies import contacts_of, friction_changes
from slipgrasp.recordings.engines.expected import expected_answer

# Drake needs half of MuJoCo's step for errors of the same size [s].
STEPS = {"mjcf": 1e-4, "drake": 5e-5, "usd": 1e-4}


def describe(result: RunResult, name: str) -> tuple[str, dict[str, Any]]:
    """The text of a scene, and the expected motion.

    Args:
        result: A run that starts from rest, densely stored.
        name: One of `STEPS`.
    """
    scenario, step, angles = result.scenario, STEPS[name], result.trace.joint_position[0]
    answer = expected_answer(result, step) | {"contacts": contacts_of(scenario)}
    answer["friction_changes"] = friction_changes(scenario)
    if name == "usd":
        del answer["tolerance"]  # No engine has simulated the stage.
        return usd.describe_scene(scenario, angles), answer
    if name == "drake":
        return sdf.describe_scene(scenario, angles, step), answer | sdf.settings(scenario, step)
    motors, contact = mjcf.motors(scenario), mjcf.describe_contact(step)
    return mjcf.describe_scene(scenario, angles, step, motors, contact), answer
