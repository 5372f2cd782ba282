"""The environment of Gymnasium, checked by Gymnasium's own checker and against the simulator."""

import warnings

import numpy as np
import pytest

from slipgrasp import load_scenario, with_law, with_values

pytest.importorskip("gymnasium")

from gymnasium.utils.env_checker import check_env

from slipgrasp.gymnasium_env import OBSERVED, GraspEnv

SCENARIO = with_values(
    with_law(load_scenario("composite-case-2"), "pd-gravity"),
    {"simulation.duration": 0.05, "sensing.velocity_noise": 1e-4},
)


def holding_torque(environment):
    tick = environment._tick
    force = 40.0 * tick.seen.contact_normal
    force[:, 1] += 0.5 * tick.seen.model.object_mass * tick.seen.model.gravity
    return np.einsum("nij,ni->nj", tick.seen.jacobian, force)


def test_gymnasiums_own_checker_finds_nothing_wrong():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Torques are in newton metres, and nobody knows bounds of what is observed.
        warnings.filterwarnings("ignore", message=".*(normalized|infinity|symmetric|unbounded).*")
        check_env(GraspEnv(SCENARIO), skip_render_check=True)


def test_an_episode_is_the_run_that_the_simulator_makes_of_it():
    environment = GraspEnv(SCENARIO)
    observation, _ = environment.reset(seed=4)
    assert observation.shape == environment.observation_space.shape == (20,)
    assert len(OBSERVED) == 7
    truncated, steps = False, 0
    while not truncated:
        observation, reward, terminated, truncated, info = environment.step(
            holding_torque(environment)
        )
        assert not terminated
        assert reward == pytest.approx(-np.sum(observation[:3] ** 2))
        steps += 1
    result = environment.simulation.result()
    assert (info["outcome"], steps) == ("completed", len(result.ticks))
    assert result.scenario.simulation.seed == 4


def test_the_same_seed_gives_the_same_episode_and_another_seed_another():
    ends = []
    for seed in (1, 1, 2):
        environment = GraspEnv(SCENARIO)
        environment.reset(seed=seed)
        for _ in range(10):
            observation, *_ = environment.step(holding_torque(environment))
        ends.append(observation.tobytes())
    assert ends[0] == ends[1] != ends[2]


def test_a_run_that_ends_early_terminates_its_episode_and_says_why():
    environment = GraspEnv(SCENARIO)
    environment.reset()
    _, _, terminated, truncated, info = environment.step(np.zeros((2, 2)))
    assert (terminated, truncated, info["outcome"]) == (True, False, "separated")
    assert "separated" in info["reason"]
