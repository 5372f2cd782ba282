"""`python -m benchmarks.dot`: the scenario behind a dot or a cell of docs/robustness.md, as TOML.

python -m benchmarks.dot picture ideal theorem-4 --near 0.25 0.3 > dot.toml
python -m benchmarks.dot table "noise 3 mm/s" composite --number 17 --fingers 3 > dot.toml
slipgrasp run dot.toml --serve
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import islice

import numpy as np

from benchmarks import robustness, robustness_hands, robustness_worlds
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, scenario_to_toml

FINGERS = (2, 3, *robustness_hands.MORE_FINGERS)


def main(arguments: Sequence[str] | None = None) -> None:
    """Prints the scenario asked for, and on the other channel which object it is.

    Args:
        arguments: Of the command line; those of this process if left out.
    """
    options = _parser().parse_args(arguments)
    fingers = getattr(options, "fingers", 2)
    number = options.number if options.near is None else find_object(options.near)
    mass, *frictions = robustness.random_objects(robustness.COUNT, fingers)[number]
    if options.figure == "picture":
        scenario = scenario_of_dot(options.world, options.law, number)
    else:
        scenario = scenario_of_cell(options.world, options.law, number, fingers)
    friction = ", ".join(f"{mu:.3f}" for mu in frictions)
    print(f"object {number}: {mass:.3f} kg, friction {friction}", file=sys.stderr)
    print(scenario_to_toml(scenario), end="")


def scenario_of_dot(world: str, law: str, number: int) -> Scenario:
    """The run behind a dot of the picture.

    Args:
        world: One of `robustness.WORLDS`.
        law: One of `robustness.LAWS`.
        number: Of the object.
    """
    base = load_scenario(robustness.WORLDS[world])
    objects = robustness.random_objects(robustness.COUNT)
    return next(islice(robustness.vary_objects(base, law, objects), number, None))


def scenario_of_cell(world: str, law: str, number: int, fingers: int) -> Scenario:
    """One of the runs behind a cell of the tables of all worlds.

    Args:
        world: One of `robustness_worlds.WORLDS`.
        law: One of `robustness_worlds.LAWS`.
        number: Of the object.
        fingers: Of the hand.
    """
    robustness_worlds.load_field_laws()
    hand, values = robustness_hands.hand_of(fingers), robustness_worlds.WORLDS[world]
    objects = robustness_worlds.vary_objects(hand, law, values, robustness.COUNT)
    return next(islice(objects, number, None))


def find_object(near: Sequence[float]) -> int:
    """Number of the object of two fingers whose friction, left and right, is nearest."""
    friction = robustness.random_objects(robustness.COUNT)[:, 1:]
    return int(np.argmin(np.linalg.norm(friction - near, axis=1)))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.dot", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    figures = parser.add_subparsers(dest="figure", required=True)
    for figure, worlds, laws in (
        ("picture", robustness.WORLDS, robustness.LAWS),
        ("table", robustness_worlds.WORLDS, robustness_worlds.LAWS),
    ):
        each = figures.add_parser(figure)
        each.add_argument("world", choices=tuple(worlds))
        each.add_argument("law", choices=tuple(laws))
        which = each.add_mutually_exclusive_group(required=True)
        which.add_argument("--number", type=int, choices=range(robustness.COUNT), metavar="N")
        which.add_argument("--near", type=float, nargs=2, metavar=("LEFT", "RIGHT"))
        if figure == "table":
            each.add_argument("--fingers", type=int, choices=FINGERS, default=2)
    return parser


if __name__ == "__main__":
    main()
