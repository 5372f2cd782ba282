"""A study counts its runs before it makes them, makes each from its index, says what is wrong."""

from __future__ import annotations

import itertools
import math
import pickle
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import qmc

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_choice import choose_law, describe_settings
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.study.checks import find_bare_laws, find_mixed_limits, find_overruled
from slipgrasp.core.study.cost import estimate_cost
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import (
    check_members,
    load_study,
    study_from_mapping,
    study_to_mapping,
)

FRICTIONS = ("fingers.0.friction", "fingers.1.friction")


def make_study(**mapping) -> Study:
    return study_from_mapping({"base": "paper-case-2", **mapping}, load_scenario)


def errors_of(**mapping) -> dict[str, str]:
    with pytest.raises(ScenarioError) as raised:
        check_members(make_study(**mapping))
    return {error.field: error.message for error in raised.value.errors}


def test_a_grid_crosses_everything_with_the_last_key_fastest() -> None:
    study = make_study(
        vary={
            "object.mass": {"min": 0.5, "max": 2.0, "count": 4},
            "controller.lyapunov_weight": {"values": [1.0, 20.0]},
        }
    )
    found = [tuple(study.values_of(i).values()) for i in range(study.num_runs)]
    assert found == [(mass, q) for mass in (0.5, 1.0, 1.5, 2.0) for q in (1.0, 20.0)]
    assert study.num_samples == 1


def test_values_are_crossed_with_samples_so_that_controllers_meet_the_same_objects() -> None:
    study = make_study(
        sampling={"method": "random", "runs": 5, "seed": 1},
        vary={
            "controller.lyapunov_weight": {"values": [1.0, 20.0]},
            "object.mass": {"min": 0.5, "max": 2.0},
        },
    )
    assert (study.num_runs, study.num_samples, study.num_combinations) == (10, 5, 2)
    runs = [study.values_of(i) for i in range(10)]
    assert [run["controller.lyapunov_weight"] for run in runs] == [1.0, 20.0] * 5
    masses = [run["object.mass"] for run in runs]
    assert masses[::2] == masses[1::2]
    assert len(set(masses)) == 5


def test_samples_are_those_of_numpy_and_scipy_for_the_seed() -> None:
    vary = {key: {"min": 0.1, "max": 0.5} for key in FRICTIONS}
    random = make_study(sampling={"method": "random", "runs": 8, "seed": 7}, vary=vary)
    shares = np.random.default_rng(7).random((8, 2))
    assert [list(random.values_of(i).values()) for i in range(8)] == [
        [0.1 + x * 0.4 for x in row] for row in shares.tolist()
    ]
    latin = make_study(sampling={"method": "latin-hypercube", "runs": 8, "seed": 7}, vary=vary)
    expected = qmc.LatinHypercube(2, rng=np.random.default_rng(7)).random(8)
    values = np.array([list(latin.values_of(i).values()) for i in range(8)])
    np.testing.assert_allclose(values, 0.1 + 0.4 * expected, rtol=1e-15)
    for column in values.T:
        assert sorted(np.floor((column - 0.1) / 0.05).astype(int)) == list(range(8))


def test_a_log_scale_has_equal_ratios_and_exact_bounds() -> None:
    axis = {"min": 0.1, "max": 10.0, "count": 5, "scale": "log"}
    study = make_study(vary={"controller.adaptation_gain": axis})
    values = [study.values_of(i)["controller.adaptation_gain"] for i in range(5)]
    assert values[0] == 0.1
    assert values[-1] == 10.0
    np.testing.assert_allclose(np.diff(np.log(values)), math.log(10.0) / 2.0)


def test_whole_numbers_are_sampled_evenly_and_never_beyond_their_bounds() -> None:
    study = make_study(
        sampling={"method": "random", "runs": 600, "seed": 2},
        vary={"simulation.chatter_changes": {"min": 5, "max": 7}},
    )
    values = [study.values_of(i)["simulation.chatter_changes"] for i in range(600)]
    assert {type(value) for value in values} == {int}
    assert all(150 < values.count(value) < 250 for value in (5, 6, 7))


def test_a_grid_of_whole_numbers_has_both_bounds_and_is_even_between_them() -> None:
    study = make_study(vary={"simulation.chatter_changes": {"min": 5, "max": 13, "count": 5}})
    values = [study.values_of(i)["simulation.chatter_changes"] for i in range(5)]
    assert values == [5, 7, 9, 11, 13]


@pytest.mark.parametrize("seed", [0, 2**53 - 1])
def test_every_seed_from_0_to_2_53_gives_samples_of_its_own(seed: int) -> None:
    sampling = {"method": "random", "runs": 1, "seed": seed}
    vary = {"object.mass": {"min": 0.5, "max": 2.0}}
    assert make_study(sampling=sampling, vary=vary).sampling.seed == seed
    wrong = sampling | {"seed": -1 if seed == 0 else seed + 1}
    assert "sampling.seed" in errors_of(sampling=wrong, vary=vary)
    usual = make_study(sampling={"method": "random", "runs": 1}, vary=vary)
    assert usual.sampling.seed == 0


def test_the_check_of_a_study_tells_how_far_it_is() -> None:
    study = make_study(vary={"object.mass": {"min": 0.5, "max": 2.0, "count": 600}})
    shares: list[float] = []
    check_members(study, shares.append)
    assert shares == [0.0, 256 / 600, 512 / 600]


def test_a_star_sets_all_fingers_alike() -> None:
    study = make_study(vary={"fingers.*.friction": {"values": [0.3]}})
    assert {finger.friction for finger in study.scenario_of(0).fingers} == {0.3}
    assert study.keys == ("fingers.*.friction",)


def test_a_list_is_run_as_it_stands_and_crossed_with_values() -> None:
    study = make_study(
        sampling={"method": "list"},
        runs=[{"object.mass": 1.5}, {"fingers.0.friction": 0.4}],
        vary={"controller.kind": {"values": ["theorem-3", "theorem-4"]}},
    )
    assert study.keys == ("object.mass", "fingers.0.friction", "controller.kind")
    assert study.values_of(3) == {"fingers.0.friction": 0.4, "controller.kind": "theorem-4"}
    assert study.scenario_of(0).object.mass == 1.5


def test_every_run_is_the_base_with_its_values() -> None:
    study = make_study(
        set={"simulation.duration": 2.0},
        sampling={"method": "latin-hypercube", "runs": 20, "seed": 3},
        vary={
            "object.mass": {"min": 0.5, "max": 2.0},
            "estimates.0.initial": {"min": 0.5, "max": 1.5},
            "controller.velocity_gain": {"values": [10.0, [5.0, 5.0, 5.0, 20.0, 20.0]]},
        },
    )
    assert study.base.simulation.duration == 2.0
    for index in range(study.num_runs):
        mapping = study.base.to_mapping()
        values = study.values_of(index)
        mapping["object"]["mass"] = values["object.mass"]
        mapping["estimates"][0]["initial"] = values["estimates.0.initial"]
        mapping["controller"]["velocity_gain"] = values["controller.velocity_gain"]
        assert study.scenario_of(index) == scenario_from_mapping(mapping)


def test_a_study_survives_plain_values_and_pickling() -> None:
    study = make_study(
        title="two grips",
        sampling={"method": "random", "runs": 5, "seed": 1},
        vary={
            "object.mass": {"min": 0.5, "max": 2.0},
            "controller.kind": {"values": ["theorem-3"]},
        },
    )
    again = study_from_mapping(study_to_mapping(study), scenario_from_mapping)
    assert [again.values_of(i) for i in range(5)] == [study.values_of(i) for i in range(5)]
    assert study_to_mapping(again) == study_to_mapping(study)
    assert pickle.loads(pickle.dumps(study)) == study


def test_toml_with_and_without_quotes_means_the_same(tmp_path: Path) -> None:
    quoted = tmp_path / "quoted.toml"
    quoted.write_text(
        'base = "paper-case-1"\n[vary]\n"object.mass" = {min = 0.5, max = 1.0, count = 2}\n'
        '"fingers.0.friction" = {values = [0.2, 0.3]}\n'
    )
    bare = tmp_path / "bare.toml"
    bare.write_text(
        'base = "paper-case-1"\n[vary]\nobject.mass = {min = 0.5, max = 1.0, count = 2}\n'
        "fingers.0.friction = {values = [0.2, 0.3]}\n"
    )
    assert load_study(quoted) == load_study(bare)
    assert load_study(quoted).num_runs == 4


def test_a_base_file_is_found_from_the_folder_of_the_study(tmp_path: Path) -> None:
    from slipgrasp.core.scenario.loading import scenario_to_toml

    heavier = with_values(load_scenario("paper-case-1"), {"object.mass": 1.3})
    (tmp_path / "heavier.toml").write_text(scenario_to_toml(heavier))
    study = tmp_path / "study.toml"
    study.write_text(
        'base = "heavier.toml"\nsampling.method = "list"\n[[runs]]\nfingers.0.friction = 0.3\n'
    )
    assert load_study(study).base == heavier
    assert load_study(study).base_name == ""


def test_a_scenario_in_place_of_a_study_is_refused_with_the_way_out(tmp_path: Path) -> None:
    scenario = tmp_path / "mine.toml"
    scenario.write_text("[object]\nmass = 1.0\n[[fingers]]\nfriction = 0.3\n")
    with pytest.raises(ScenarioError, match=r'is a scenario; write a study .* base = "mine.toml"'):
        load_study(scenario)


def test_recordings_are_kept_of_up_to_a_thousand_runs() -> None:
    def kept(count: int) -> str:
        return make_study(vary={"object.mass": {"min": 1, "max": 2, "count": count}}).recordings

    assert (kept(1000), kept(1001)) == ("all", "none")


def test_a_grid_of_a_million_million_runs_is_refused_with_its_count() -> None:
    axis = {"min": 0.5, "max": 2.0, "count": 10**6}
    message = errors_of(vary={key: axis for key in FRICTIONS})["vary"]
    assert "1000000000000 runs" in message
    assert "1000000 are allowed" in message
    huge = {"min": 0.5, "max": 2.0, "count": 10**15}
    assert "1" + "0" * 30 in errors_of(vary={key: huge for key in FRICTIONS})["vary"]


def test_one_bad_run_is_named_by_its_index() -> None:
    runs = [{"object.mass": 1.0}] * 12 + [{"object.mass": -1.0}] + [{"object.mass": 1.0}]
    ((field, message),) = errors_of(sampling={"method": "list"}, runs=runs).items()
    assert field == "runs.12.object.mass"
    assert message.startswith("run 12: object.mass is -1")


def test_runs_that_do_not_fit_together_are_named_by_index() -> None:
    found = errors_of(vary={"trajectory.start.1": {"values": [0.366, 1.9]}})
    assert set(found) == {"runs.1.fingers.0.base", "runs.1.fingers.1.base"}


@pytest.mark.parametrize(
    ("mapping", "field", "words"),
    [
        ({"vary": {}}, "vary", "needs parameters that vary"),
        ({"vary": {"object.mas": {"values": [1.0]}}}, "vary.object.mas", "'object.mass'?"),
        ({"vary": {"object.mass": {"min": 1.0, "max": 2.0}}}, "vary.object.mass.count", "missing"),
        ({"vary": {"object.mass": {"min": 1.0}}}, "vary.object.mass", "both 'min' and 'max'"),
        (
            {"vary": {"object.mass": {"min": 2.0, "max": 1.0, "count": 2}}},
            "vary.object.mass",
            "above max",
        ),
        (
            {"vary": {"object.mass": {"min": 0.0, "max": 1.0, "count": 2}}},
            "vary.object.mass.min",
            "0.001 … 1000 kg",
        ),
        (
            {"vary": {"object.mass": {"min": 1.0, "max": 2.0, "count": 2, "values": [1.0]}}},
            "vary.object.mass",
            "as well as a range",
        ),
        (
            {"vary": {"controller.kind": {"min": 1, "max": 2, "count": 2}}},
            "vary.controller.kind",
            "give its 'values'",
        ),
        (
            {"vary": {"object.mass": {"values": []}}},
            "vary.object.mass.values",
            "give at least one",
        ),
        (
            {"vary": {"object.mass": {"values": [math.nan]}}},
            "vary.object.mass.values.0",
            "finite number",
        ),
        (
            {"sampling": {"method": "random"}, "vary": {"object.mass": {"min": 1, "max": 2}}},
            "sampling.runs",
            "random needs their number",
        ),
        (
            {"sampling": {"method": "random", "runs": 3}, "vary": {"object.mass": {"values": [1]}}},
            "vary",
            "no range to sample",
        ),
        ({"sampling": {"method": "list"}}, "runs", "[[runs]]"),
        (
            {"runs": [{"object.mass": 1.0}], "vary": {"object.mass": {"values": [1.0]}}},
            "runs",
            "'grid'",
        ),
        (
            {"vary": {"object.mass": {"values": [1.0, 2.0]}}, "sampling": {"runs": 3}},
            "sampling.runs",
            "the grid has 2",
        ),
        ({"vary": {"object.mass": {"values": [1.0]}}, "extra": 1}, "extra", "not known"),
        ({"vary": 3}, "vary", "should be a table"),
        ({"vary": {"object": {"mass": {"mim": 1.0}}}}, "vary.object.mass.mim", "'min'?"),
        ({"sampels": 1}, "sampels", "'sampling'?"),
        ({"base": 1}, "base", "name of a preset"),
        ({"vary": {"changes.*.value": {"values": [1.0]}}}, "vary.changes.*.value", "unknown"),
        ({"set": {"changes.*.value": 1.0}}, "changes.*.value", "unknown parameter"),
        ({"limits": {"slip_pth": 0.1}}, "limits.slip_pth", "did you mean 'slip_path'"),
        ({"limits": {"held": 1.0}}, "limits.held", "no such metric"),
        ({"limits": {"slip_path": -1.0}}, "limits.slip_path", "0"),
        (
            {"sampling": {"method": "list"}, "runs": [{"changes.*.value": 3.0}]},
            "runs.0.changes.*.value",
            "unknown parameter",
        ),
        (
            {
                "vary": {
                    key: {"values": [0.2]} for key in ("fingers.0.friction", "fingers.*.friction")
                }
            },
            "vary.fingers.*.friction",
            "sets fingers.0.friction, as vary.fingers.0.friction does",
        ),
        (
            {
                "vary": {"fingers.*.friction": {"values": [0.2]}},
                "sampling": {"method": "list"},
                "runs": [{"fingers.1.friction": 0.3}],
            },
            "vary.fingers.*.friction",
            "as the listed runs do",
        ),
        (
            {
                "sampling": {"method": "list"},
                "runs": [
                    {"controller.velocity_gain": [1, 1, 1, 1, 1], "controller.velocity_gain.0": 2}
                ],
            },
            "runs.0.controller.velocity_gain.0",
            "remove one of them",
        ),
        (
            {"vary": {"object.mass": {"values": [1]}, "object": {"mass": {"values": [2]}}}},
            "vary.object.mass",
            "twice",
        ),
        ({"vary": {"object.mass": {"values": [{}]}}}, "vary.object.mass.values.0", "a number, a"),
    ],
)
def test_what_is_wrong_is_named_with_the_way_out(mapping: dict, field: str, words: str) -> None:
    found = errors_of(**mapping)
    assert field in found
    assert words in found[field]


@pytest.mark.parametrize("document", [None, [], "x", 3, {"base": 7}, {"base": None, "vary": []}])
def test_what_is_no_study_at_all_is_refused(document: object) -> None:
    with pytest.raises(ScenarioError):
        study_from_mapping(document, load_scenario)


def test_what_is_wrong_with_many_runs_is_said_once() -> None:
    found = errors_of(
        vary={
            "object.mass": {"min": 0.5, "max": 2.0, "count": 5},
            "controller.kind": {"values": ["theorem-4", "composite", "grip-reflex"]},
        }
    )
    assert [*found] == ["runs.1.controller.kind", "runs.2.controller.kind"]
    assert all("sampled control" in message for message in found.values())


def test_what_a_timed_change_sets_in_every_run_is_told() -> None:
    mapping = load_scenario("paper-case-2").to_mapping()
    mapping["changes"] = [{"time": 0.5, "parameter": "fingers.1.friction", "value": 0.3}]
    changed = scenario_from_mapping(mapping)
    vary = {
        "object.mass": {"min": 0.5, "max": 2.0, "count": 3},
        "fingers.*.friction": {"min": 0.2, "max": 0.4, "count": 3},
    }
    study = study_from_mapping({"base": "", "vary": vary}, lambda _: changed)
    (told,) = find_overruled(study)
    assert told.startswith("fingers.*.friction varies only until 0.5 s")
    assert [*find_overruled(make_study(vary=vary))] == []


def test_varied_laws_without_their_recommended_settings_are_named() -> None:
    laws = {"controller.kind": {"values": ["theorem-4", "composite"]}}
    base = {"controller.control_period": 1e-3}
    (told,) = find_bare_laws(make_study(vary=laws, set=base))
    found = choose_law(with_values(load_scenario("paper-case-2"), base), "composite")
    assert f"(composite: {describe_settings(found.settings)});" in told

    listed = {setting.key: setting.new for setting in found.settings}
    runs = [{"controller.kind": "composite", **listed}, {"controller.kind": "theorem-4"}]
    lists = {"sampling": {"method": "list"}, "vary": {}, "runs": runs}
    assert [*find_bare_laws(make_study(set=base, **lists))] == []


def test_a_limit_of_metres_and_radians_alike_is_named_with_its_components() -> None:
    vary = {"object.mass": {"min": 0.5, "max": 2.0, "count": 5}}
    limits = {"final_tracking_error": 0.001, "slip_path": 0.002, "rms_tracking_error_theta": 0.1}
    (told,) = find_mixed_limits(make_study(vary=vary, limits=limits))
    assert told.startswith("limits.final_tracking_error is 0.001 m and rad: ")
    assert told.endswith("final_tracking_error_x or final_tracking_error_theta")


def test_the_cost_is_that_of_the_laws_that_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    timed: list[str] = []

    def note(scenario: Scenario) -> Simulation:
        timed.append(scenario.controller.kind)
        return Simulation(scenario)

    monkeypatch.setattr("slipgrasp.core.study.cost.Simulation", note)
    estimate_cost(
        make_study(
            set={"simulation.duration": 0.05, "controller.control_period": 0.001},
            vary={
                "object.mass": {"min": 0.5, "max": 2.0, "count": 50},
                "controller.kind": {"values": ["theorem-4", "composite"]},
            },
        ),
        1,
    )
    assert {"theorem-4", "composite"} <= set(timed)


def test_the_cost_grows_with_runs_and_recordings_and_shrinks_with_workers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # On this clock every run of the base takes equally long.
    clock = SimpleNamespace(perf_counter=itertools.count(step=0.001).__next__)
    monkeypatch.setattr("slipgrasp.core.study.cost.time", clock)
    axis = {"min": 0.5, "max": 2.0, "count": 500}
    short = {"simulation.duration": 0.2}
    study = make_study(set=short, vary={"object.mass": axis}, recordings="none")
    kept = make_study(set=short, vary={"object.mass": axis}, recordings="all")
    cost = estimate_cost(study, 1)
    assert cost.runs == 500
    assert cost.seconds > 0.0
    assert estimate_cost(study, 1000).seconds < cost.seconds
    assert estimate_cost(kept, 1).bytes > 10 * cost.bytes
