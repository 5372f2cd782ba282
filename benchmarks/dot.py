"""`python -m benchmarks.dot`: the scenario of one run of docs/robustness.md, as TOML.

python -m benchmarks.dot "noise 3 mm/s" composite --number 17 --fingers 3 > dot.toml
python -m benchmarks.dot "latency 30 ms" "grip reflex" --number 3 --gains 25 10 --predicts
slipgrasp run dot.toml --serve
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import islice

from benchmarks.robustness import COUNT
from benchmarks.robustness_gains import GAINS, HANDS, Cell, scenarios_of
from benchmarks.robustness_worlds import LAWS, WORLDS, load_published_laws, random_objects
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_to_toml


def main(arguments: Sequence[str] | None = None) -> None:
    """Prints the scenario to standard output and its object to standard error.

    Args:
        arguments: Arguments of the command line; those of this process if None.
    """
    options = _parser().parse_args(arguments)
    number = options.number
    mass, *frictions = random_objects(COUNT, options.fingers)[number]
    cell = Cell(options.fingers, options.world, options.law, options.predicts)
    scenario = scenario_of(cell, number, tuple(options.gains))
    friction = ", ".join(f"{mu:.3f}" for mu in frictions)
    print(f"object {number}: {mass:.3f} kg, friction {friction}", file=sys.stderr)
    print(scenario_to_toml(scenario), end="")


def scenario_of(cell: Cell, number: int, gains: tuple[float, float] = GAINS[0]) -> Scenario:
    """The scenario of one of the runs of a cell.

    Args:
        cell: Hand, world and law.
        number: Number of the object.
        gains: K_p and K_v, as in the cell.
    """
    load_published_laws()
    return next(islice(scenarios_of(cell, gains, COUNT), number, None))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.dot", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("world", choices=tuple(WORLDS))
    parser.add_argument("law", choices=tuple(LAWS))
    parser.add_argument("--number", type=int, choices=range(COUNT), metavar="N", required=True)
    parser.add_argument("--fingers", type=int, choices=tuple(HANDS), default=2)
    parser.add_argument("--gains", type=float, nargs=2, metavar=("KP", "KV"), default=GAINS[0])
    parser.add_argument("--predicts", action="store_true", help="with prediction")
    return parser


if __name__ == "__main__":
    main()
