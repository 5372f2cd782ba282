"""A random scenario with given levels: its numbers, and what of it must fit together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from random import Random
from typing import Any

from slipgrasp.core.scenario.unknowns import PHYSICAL_BOUNDS
from tests.core import drawn_hands_in_space as spatial
from tests.core import drawn_scenarios as planar
from tests.core.drawn_levels import Factor, Level, Where, all_factors

DURATION = (0.2, 0.3)
MAX_STEPS = {False: 20_000, True: 200_000}  # in the plane, in space
MOVED = 0.01  # how far an object is moved, or turned, from where it starts [m], [rad]
CLOSE = (0.0, 1e-13, 1e-12, 1e-10, 1e-9, 1e-7)  # between instants that are nearly one [s]

FINGERS, OUTLINE, GEOMETRY = "number of fingers", "outline", "geometry"
UNKNOWNS, BOUNDS, START = "unknowns", "bounds of the estimates", "start of the estimates"
PULSES, PATCHES, LIFE = "number of pulses", "number of patches", "life of the patches"
CHANGED, CHANGED_TO, FURTHER = "changed", "changed to", "further changes at most"
INSTANTS, MATRIX, NOTHING = "instants", "Lyapunov matrix", "nothing"

# The first level of each goes with every other one: without an estimate, none can change.
STRUCTURE = (
    Factor(FINGERS, (2, 3, 4, 5, 6)),
    Factor(OUTLINE, ("plain", "corners")),
    Factor(GEOMETRY, ("anywhere", "at ends")),
    Factor(UNKNOWNS, ("object", "friction", "masses", NOTHING)),
    Factor(BOUNDS, ("both", "one", "at the start", "none")),
    Factor(START, (Where.INSIDE, Where.LOW, Where.HIGH)),
    Factor(PULSES, (1, 0, 2)),
    Factor(PATCHES, (1, 0, 2)),
    Factor(LIFE, ("throughout", "comes", "goes", "comes and goes")),
    Factor(CHANGED_TO, (Where.INSIDE, Where.LOW, Where.HIGH, Where.ZERO, Where.LIST)),
    Factor(FURTHER, (0, 1, 2)),
    Factor(INSTANTS, ("apart", "equal", "on ticks", "close")),
    Factor(MATRIX, ("weights", "full")),
)
SCALES = {"object_mass": 1.0, "link_mass": 1.0, "object_inertia": 0.01, "friction": 0.5}
ESTIMATES = ("estimates.*.initial", "estimates.*.minimum", "estimates.*.maximum")
# Lengths of a list with one gain for each of something, by the name of the parameter.
PER_COORDINATE = ("controller.position_gain",)
PER_TANGENT = ("controller.slip_position_gain",)
PER_UNKNOWN = ("controller.adaptation_gain", "controller.initial_deviation")


def changeable(in_space: bool) -> tuple[str, ...]:
    """Names of all that a timed change may set."""
    return (*(f.name for f in all_factors(in_space) if f.is_changeable), *ESTIMATES)


class Draft:
    """A scenario as plain values, valid unless its levels exclude each other.

    Args:
        in_space: Whether the hand stands in space.
        levels: By the names of the factors.
        rng: Where all numbers come from.

    Attributes:
        mapping: The values.
        further_changes: Timed changes that may follow, of which validation may refuse some.
    """

    def __init__(self, in_space: bool, levels: Mapping[str, Level], rng: Random) -> None:
        self._in_space, self._levels, self._rng = in_space, levels, rng
        self._ends = planar.AtEnds(rng.random()) if levels[GEOMETRY] == "at ends" else rng
        self._n = int(levels[FINGERS])
        self._duration = self._ends.uniform(*DURATION)
        self._parameters = {factor.name: factor for factor in all_factors(in_space)}
        self.mapping: dict[str, Any] = {
            **(self._spatial_hand() if in_space else self._planar_hand()),
            "pulses": [{} for _ in range(int(levels[PULSES]))],
            "patches": [{} for _ in range(int(levels[PATCHES]))],
            "simulation": {
                "duration": self._duration,
                "max_steps": MAX_STEPS[in_space],
                "seed": rng.randrange(1000),
            },
        }
        self.mapping["estimates"] = list(self._estimates())
        for factor in self._parameters.values():
            self._set(factor)
        self._fit()
        self._place_events()
        if levels[MATRIX] == "full":
            self.mapping["controller"]["lyapunov_matrix"] = self._matrix()
        further = rng.choices(changeable(in_space), k=int(levels[FURTHER]))
        self.mapping["changes"] = list(self._changes([str(levels[CHANGED])]))
        self.further_changes = list(self._changes(further))

    # The hand

    def _planar_hand(self) -> dict[str, Any]:
        rng, has_corners = self._ends, self._levels[OUTLINE] == "corners"
        body, faces = planar.draw_body(rng, has_corners=has_corners)
        angle = rng.uniform(-0.2, 0.2)
        fingers = [planar.draw_finger(rng, i, body, faces[i], angle) for i in range(self._n)]
        start = (*planar.POSITION, angle)
        return {"object": body, "fingers": fingers, "trajectory": {"start": start}}

    def _spatial_hand(self) -> dict[str, Any]:
        rng, has_corners = self._ends, self._levels[OUTLINE] == "corners"
        body, faces = spatial.draw_body(rng, self._n, has_corners=has_corners)
        start = spatial.draw_start(rng)
        fingers = [spatial.draw_finger(rng, i, body, faces, start) for i in range(self._n)]
        return {"object": body, "fingers": fingers, "trajectory": {"start": start}}

    # Parameters one by one

    def _set(self, factor: Factor) -> None:
        """Gives a parameter its value at every place that it has."""
        *parents, last = factor.name.removesuffix(".*").split(".")
        nodes = [self.mapping]
        for part in parents:
            nodes = [
                each
                for node in nodes
                for each in (node if part == "*" else [node.setdefault(part, {})])
            ]
        for node in nodes:
            node[last] = self._value(factor, self._levels[factor.name])
            if node[last] is None:
                del node[last]

    def _value(self, factor: Factor, level: Level) -> Any:
        if level != Where.LIST:
            return factor.value(level, self._rng)
        return tuple(
            factor.single_value(Where.INSIDE, self._rng) for _ in range(self._length(factor))
        )

    def _length(self, factor: Factor) -> int:
        tangents = (2 if self._in_space else 1) * self._n
        coordinates = 6 if self._in_space else 3
        if factor.name in PER_UNKNOWN:
            return len(self.mapping["estimates"])
        if factor.name in PER_COORDINATE:
            return coordinates
        return tangents if factor.name in PER_TANGENT else coordinates + tangents

    def _fit(self) -> None:
        """Static friction is no less than that of slip, and no force is asked beyond its limit."""
        for finger in self.mapping["fingers"]:
            if (ratio := finger.get("static_friction")) is not None:
                finger["static_friction"] = ratio * finger["friction"]
        controller = self.mapping["controller"]
        for key in ("minimum_normal_force", "grip_force"):
            most = controller.get("maximum_normal_force", controller[key])
            controller[key] = min(controller[key], most)

    def _matrix(self) -> tuple[tuple[float, ...], ...]:
        """Q in full: symmetric, and positive definite because its diagonal dominates."""
        size = 2 * ((6 if self._in_space else 3) + (2 if self._in_space else 1) * self._n)
        rows = [[0.0] * size for _ in range(size)]
        for i in range(size):
            rows[i][i] = self._rng.uniform(1.0, 100.0)
            for j in range(i):
                rows[i][j] = rows[j][i] = self._rng.uniform(-0.5, 0.5) / size
        return tuple(map(tuple, rows))

    # Events

    def _place_events(self) -> None:
        faces = [finger["face"] for finger in self.mapping["fingers"]]
        for pulse in self.mapping["pulses"]:
            pulse["time"] = self._instant()
        for patch in self.mapping["patches"]:
            patch["face"] = self._rng.choice(faces)
            patch |= self._life()
        self.mapping["trajectory"] |= self._motion()

    @cached_property
    def _two_instants(self) -> tuple[float, float]:
        """When all happens that happens at once; on a tick or not."""
        drawn = [self._rng.uniform(0.05, 0.9) * self._duration for _ in range(2)]
        on_ticks = [self._nearest_tick(time) for time in drawn]
        first, second = sorted(self._rng.choice((drawn, on_ticks)))
        return first, second

    def _instant(self) -> float:
        """A time at which something happens [s]."""
        time = self._rng.uniform(0.02, 0.9) * self._duration
        if self._levels[INSTANTS] == "apart":
            return time
        if self._levels[INSTANTS] == "on ticks":
            return self._nearest_tick(time)
        together = self._rng.choice(self._two_instants)
        if self._levels[INSTANTS] == "equal":
            return together
        return together + self._rng.choice((-1.0, 1.0)) * self._rng.choice(CLOSE)

    def _nearest_tick(self, time: float) -> float:
        period = self.mapping["controller"]["control_period"] or 0.01
        return max(1, round(time / period)) * period

    def _life(self) -> dict[str, float]:
        life, (first, second) = self._levels[LIFE], sorted((self._instant(), self._instant()))
        begin = {} if life == "goes" else {"start_time": first}
        end = {} if life == "comes" else {"end_time": max(second, first + 1e-3)}
        return {} if life == "throughout" else begin | end

    def _motion(self) -> dict[str, Any]:
        """Moves and a table that begin and end at such instants."""
        start = self.mapping["trajectory"]["start"]
        home = (*start[:3], 0.0, 0.0, 0.0) if self._in_space else start
        poses = [tuple(x + self._ends.uniform(-MOVED, MOVED) for x in home) for _ in range(2)]
        first, second = sorted((self._instant(), self._instant()))
        length = max(0.02, min(0.1, second - first))
        times = first, max(second, first + length)
        moves = zip(times, poses, strict=True)
        later = max(0.02, first), max(second, first + 0.04)
        rows = zip(later, poses, strict=True)
        return {
            "set_points": [{"time": t, "duration": length, "pose": pose} for t, pose in moves],
            "table": [(0.0, *home), *((t, *pose) for t, pose in rows)],
        }

    # What the controller does not know

    def _estimates(self) -> Iterator[dict[str, Any]]:
        axes = [f"object.inertias.{k}" for k in range(3)] if self._in_space else ["object.inertia"]
        body = [("object.mass", "object_mass"), *((key, "object_inertia") for key in axes)]
        on_slides = self._levels["fingers.*.kind"] == "slides"
        names = ("mass",) if on_slides else ("link_masses.0", "link_masses.1")
        links = [(f"fingers.{i}.{name}", "link_mass") for i in range(self._n) for name in names]
        friction = [(f"fingers.{i}.friction", "friction") for i in range(self._n)]
        chosen = {"object": body, "friction": [*friction, *body], "masses": [*links, body[0]]}
        for key, kind in chosen.get(str(self._levels[UNKNOWNS]), []):
            initial = self._first_estimate(kind)
            yield {"parameter": key, "initial": initial, **self._bounds(initial, kind)}

    def _first_estimate(self, kind: str) -> float:
        factor = {Where.INSIDE: self._rng.uniform(0.5, 1.5), Where.LOW: 0.5, Where.HIGH: 1.5}
        return SCALES[kind] * factor[self._levels[START]]

    def _bounds(self, initial: float, kind: str) -> dict[str, float]:
        low, high = PHYSICAL_BOUNDS[kind]
        bounds = {"minimum": low, "maximum": high}
        if self._levels[BOUNDS] == "one":
            return dict([self._rng.choice(list(bounds.items()))])
        if self._levels[BOUNDS] == "at the start":
            return bounds | dict([(self._rng.choice(list(bounds)), initial)])
        return bounds if self._levels[BOUNDS] == "both" else {}

    # What changes on the way

    def _changes(self, names: Iterable[str]) -> Iterator[dict[str, Any]]:
        for name in names:
            if name != NOTHING:
                key, value = self._changed(name)
                yield {"time": self._instant(), "parameter": key, "value": value}

    def _changed(self, name: str) -> tuple[str, Any]:
        """The key of one of the places of a parameter, and a value for it."""
        *parents, last = name.removesuffix(".*").split(".")
        node: Any = self.mapping
        path = []
        for part in parents:
            if part == "*" and not node:
                return name.replace("*", "0"), 1.0  # which is refused
            index = self._rng.randrange(len(node)) if part == "*" else part
            node = node[index]
            path.append(str(index))
        factor = self._parameters.get(name)
        if factor is None:
            return ".".join((*path, last)), self._changed_estimate(node, last)
        component = [] if factor.size is None else [str(self._rng.randrange(factor.size))]
        return ".".join((*path, last, *component)), self._changed_value(factor, node)

    def _changed_value(self, factor: Factor, node: dict[str, Any]) -> Any:
        levels = [level for level in factor.levels if level not in (Where.NONE, Where.DEFAULT)]
        wanted = self._levels[CHANGED_TO]
        level = wanted if wanted in levels else self._rng.choice(levels)
        if level == Where.LIST:
            return self._value(factor, level)
        value = factor.single_value(level, self._rng)
        if factor.name == "fingers.*.friction":
            return min(value, node.get("static_friction", value))
        if factor.name == "fingers.*.static_friction":
            return value * node["friction"]
        if factor.name == "controller.maximum_normal_force":
            return max(value, node["minimum_normal_force"], node["grip_force"])
        if factor.name in ("controller.minimum_normal_force", "controller.grip_force"):
            return min(value, node.get("maximum_normal_force", value))
        return value

    def _changed_estimate(self, estimate: dict[str, Any], part: str) -> float:
        initial = estimate["initial"]
        low, high = estimate.get("minimum", 0.0), estimate.get("maximum", 2.0 * initial)
        ends = {"initial": (low, high), "minimum": (0.0, initial), "maximum": (initial, high)}
        return self._rng.uniform(*ends[part])
