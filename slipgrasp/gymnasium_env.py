"""A run as a Gymnasium environment: the action is the torque of every joint.

from slipgrasp.gymnasium_env import GraspEnv

environment = GraspEnv(slipgrasp.load_scenario("composite-case-2"))
observation, _ = environment.reset(seed=1)
observation, reward, terminated, truncated, info = environment.step(action)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.stepping import Tick
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.trace.frames import MissingPackageError
from slipgrasp.core.trace.types import Outcome

try:
    import gymnasium
except ModuleNotFoundError as error:
    raise MissingPackageError("gymnasium") from error

OBSERVED = (
    *("pose_error", "velocity_error", "joint_position", "joint_velocity"),
    *("slip", "slip_velocity", "believed_phase"),
)
"""Components of an observation, in order; pose and velocity as desired minus measured values."""


def tracking_reward(tick: Tick) -> float:
    """Returns the negative squared tracking error, x² + y² + theta² [m², rad²]."""
    error = tick.seen.desired_pose - tick.seen.pose
    return -float(error @ error)


class GraspEnv(gymnasium.Env[np.ndarray, np.ndarray]):
    """A run of a planar hand with one control tick per step.

    An episode is truncated at the duration of the scenario, and terminated if the run ends early,
    for example because a fingertip separates; ``info["reason"]`` gives the reason.

    Attributes:
        simulation: The run of this episode; its `result` can be recorded.
        observation_space: `OBSERVED`, ``(6 + 7 n,)``, SI units.
        action_space: Commanded torque of every joint, ``(n, 2)`` [N m].
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        largest_torque: float = 20.0,
        reward: Callable[[Tick], float] = tracking_reward,
    ) -> None:
        """Creates an environment; `reset` starts the first episode.

        Args:
            scenario: Planar hand with sampled control; its law is not used.
            largest_torque: Bound of the actions [N m].
            reward: Returns the reward of a tick; at the end of an episode, of its last tick.
        """
        n = len(scenario.fingers)
        self._scenario, self._reward = scenario, reward
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (6 + 7 * n,), np.float64)
        self.action_space = gymnasium.spaces.Box(
            -largest_torque, largest_torque, (n, 2), np.float64
        )
        self.simulation: Simulation | None = None
        self._ticks: Iterator[Tick] = iter(())
        self._tick: Tick | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: Seed of the sensor noise; that of the scenario if None.
            options: Not used.

        Raises:
            ScenarioError: If control is not sampled.
        """
        super().reset(seed=seed)
        scenario = self._scenario
        if seed is not None:
            scenario = with_values(scenario, {"simulation.seed": seed})
        self.simulation = Simulation(scenario)
        self._ticks = self.simulation.ticks()
        self._tick = next(self._ticks)
        return _observe(self._tick), {"time": 0.0}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Applies a torque until the next tick.

        Args:
            action: Torque of every joint, ``(n, 2)`` [N m].

        Returns:
            Observation, reward, whether the run ended early, whether its duration is over, and
            ``time`` [s], with ``outcome`` and ``reason`` at the end.
        """
        tick, simulation = self._tick, self.simulation
        assert tick is not None and simulation is not None, "reset comes before the first step"
        tick.torque = action
        goes_on = next(self._ticks, None) is not None
        info: dict[str, Any] = {"time": simulation.time}
        outcome = simulation.outcome
        if not goes_on and outcome is not None:
            reason = simulation.summary().reason
            info |= {"outcome": outcome.value, "reason": reason and reason.message}
        completed = outcome is Outcome.COMPLETED
        terminated = not goes_on and not completed
        return _observe(tick), self._reward(tick), terminated, completed, info


def _observe(tick: Tick) -> np.ndarray:
    seen = tick.seen
    parts = (
        *(seen.desired_pose - seen.pose, seen.desired_velocity - seen.velocity),
        *(seen.joint_position, seen.joint_velocity),
        *(seen.slip, seen.slip_velocity, seen.believed_phase),
    )
    return np.concatenate([np.ravel(part) for part in parts], dtype=np.float64)
