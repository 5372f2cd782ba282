"""Checks gains against the hand, control settings against the law, and the unknown parameters."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import numpy as np

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import HandScenario, Scenario
from slipgrasp.core.scenario.chosen_laws import kinds_in
from slipgrasp.core.scenario.custom_laws import LAW, custom_law, law_names, law_of
from slipgrasp.core.scenario.field_errors import nearest, shortened
from slipgrasp.core.scenario.laws import CONTROL_LAWS
from slipgrasp.core.scenario.scenario import of_hand
from slipgrasp.core.scenario.unknowns import mass_keys, parse_unknown

MIN_CONTROL_PERIOD = 1e-4
MIN_POSITION_GAIN = 1e-3
LEAST_EIGENVALUE = 1e-9  # as a fraction of the largest
MAX_LATENCY_PERIODS = 100
ROUNDING = 1e-12


def check_gains(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that a list of gains has one number per coordinate, or per unknown."""
    n = len(scenario.fingers)
    num_coordinates = scenario.space.num_coordinates(n)
    sizes = {
        "velocity_gain": num_coordinates,
        "slip_position_gain": scenario.space.num_tangents * n,
        "lyapunov_weight": num_coordinates,
        "adaptation_gain": len(scenario.estimates),
        "initial_deviation": len(scenario.estimates),
    }
    for name, size in sizes.items():
        value = getattr(scenario.controller, name)
        if isinstance(value, tuple) and len(value) != size:
            words = f"has {len(value)} numbers; give one number, or {size}"
            yield FieldError.at(f"controller.{name}", len(value), f"{size} numbers", words)


def check_least_gain(scenario: Scenario) -> Iterator[FieldError]:
    """Checks K_p: tiny values make P12 = Q / (2 K_p) of Eq. 25, and so the adaptation, huge."""
    for name in ("position_gain", "slip_position_gain"):
        gain = getattr(scenario.controller, name)
        for value in gain if isinstance(gain, tuple) else (gain,):
            if 0.0 < value < MIN_POSITION_GAIN:
                words = (
                    f"is {value:g} 1/s²; 0 means no position feedback, otherwise at least "
                    f"{MIN_POSITION_GAIN:g} 1/s²"
                )
                limit = f"0 or at least {MIN_POSITION_GAIN:g} 1/s²"
                yield FieldError.at(f"controller.{name}", value, limit, words)


def check_lyapunov_matrix(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that a full Q of Eq. 25 has the size of (e, e') and is symmetric positive definite."""
    rows, key = of_hand(scenario).controller.lyapunov_matrix, "controller.lyapunov_matrix"
    if not rows:
        return
    size = 2 * scenario.space.num_coordinates(len(scenario.fingers))
    sizes = [len(rows), *map(len, rows)]
    if wrong := next((given for given in sizes if given != size), None):
        what = "rows" if len(rows) != size else "numbers in a row"
        words = (
            f"{key}: {wrong} instead of {size} {what}; give {size} rows of {size} numbers, or none"
        )
        yield FieldError(key, wrong, f"{size} rows of {size} numbers", words)
        return
    matrix = np.array(rows)
    if len(uneven := np.argwhere(matrix != matrix.T)):
        j, k = map(int, uneven[0])
        words = (
            f"is {rows[j][k]:g} and {key}.{k}.{j} is {rows[k][j]:g}; Q is symmetric, give both the "
            "same value"
        )
        yield FieldError.at(f"{key}.{j}.{k}", rows[j][k], f"{rows[k][j]:g}", words)
        return
    least, *_, greatest = np.linalg.eigvalsh(matrix)
    if not least > LEAST_EIGENVALUE * greatest:
        words = (
            f"has the eigenvalue {least:g} next to {greatest:g}; Q must be positive definite: "
            "raise its diagonal or lower the elements next to it"
        )
        limit = f"eigenvalues above {LEAST_EIGENVALUE:g} of the greatest"
        yield FieldError.at(key, float(least), limit, words)


def check_law(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that every law is known."""
    names = law_names()
    asked = {LAW: scenario.controller.kind} | {
        f"changes.{i}.value": str(change.value)
        for i, change in enumerate(scenario.changes)
        if change.parameter == LAW
    }
    for key, kind in asked.items():
        if kind not in names:
            near = nearest(kind, names)
            words = (
                f"{key}: '{shortened(kind)}' is not a known control law{near}; laws: "
                f"{', '.join(names)}"
            )
            yield FieldError(key, shortened(kind), f"one of {', '.join(names)}", words)


def check_law_parameters(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that a run has at most one custom law, with parameters that it declares."""
    own = [kind for kind in kinds_in(scenario) if kind not in CONTROL_LAWS]
    if len(own) > 1:
        words = (
            f"controller.kind: '{own[1]}' would follow '{own[0]}' in one run, but a run can use "
            "only one custom law; choose one of them"
        )
        yield FieldError("controller.kind", own[1], "one custom law", words)
    law = custom_law(own[0]) if own else None
    for name, value in scenario.controller.parameters.items() if law is not None else ():
        declared = law.parameters.get(name) if law is not None else None
        key = f"controller.parameters.{name}"
        if declared is None:
            near = nearest(name, law.parameters if law else ())
            message = f"{key}: the law '{own[0]}' has no such parameter{near}"
            yield FieldError(key, value, None, message)
        elif not declared.minimum <= value <= declared.maximum:
            limit = f"{declared.minimum:g} … {declared.maximum:g} {declared.unit}"
            message = f"{key} is {value:g}; allowed: {limit}"
            yield FieldError(key, value, limit, message)


def check_control(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that the control period is 0 or long enough."""
    period = scenario.controller.control_period
    if 0.0 < period < MIN_CONTROL_PERIOD:
        words = (
            f"is {period:g} s; 0 means continuous control, otherwise at least "
            f"{MIN_CONTROL_PERIOD:g} s"
        )
        limit = f"0 or at least {MIN_CONTROL_PERIOD:g} s"
        yield FieldError.at("controller.control_period", period, limit, words)


def check_normal_forces(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that no commanded force exceeds the allowed normal force."""
    controller = of_hand(scenario).controller
    most = controller.maximum_normal_force
    names = ["minimum_normal_force"]
    if not law_of(controller.kind).uses_friction:
        names.append("grip_force")
    for name in names:
        force = getattr(controller, name)
        if most is not None and force > most:
            words = (
                f"is {force:g} N, more than controller.maximum_normal_force, {most:g} N; lower it, "
                "or raise or omit the maximum"
            )
            yield FieldError.at(f"controller.{name}", force, f"at most {most:g} N", words)


def check_sampled(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that continuous control is not combined with features of sampled control."""
    if scenario.controller.control_period > 0.0:
        return
    for key, value in _needs_ticks(of_hand(scenario)):
        shown = f"'{value}'" if isinstance(value, str) else str(value).lower()
        words = (
            f"is {shown}, which needs sampled control; set controller.control_period, for example "
            "to 0.001 s"
        )
        yield FieldError.at(key, value, "sampled control", words)


def _needs_ticks(scenario: HandScenario) -> Iterator[tuple[str, float | bool | str]]:
    """Keys and values of all settings that need sampled control."""
    controller, sensing = scenario.controller, scenario.sensing
    if law_of(controller.kind).sampled:
        yield "controller.kind", controller.kind
    if controller.latency > 0.0:
        yield "controller.latency", controller.latency
    if controller.link_length_ratio != 1.0:
        yield "controller.link_length_ratio", controller.link_length_ratio
    for name in ("position_noise", "velocity_noise", "acceleration_noise"):
        if value := getattr(sensing, name):
            yield f"sensing.{name}", value
    for name in ("true_accelerations", "true_phases"):
        if not getattr(sensing, name):
            yield f"sensing.{name}", False
    limits = dict(scenario.torque_limits)
    limits["actuation.torque_rate_limit"] = scenario.actuation.torque_rate_limit
    for key, limit in limits.items():
        if limit is not None:
            yield key, limit


def check_latency(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that the latency fits into the command queue."""
    controller = of_hand(scenario).controller
    latency, longest = controller.latency, MAX_LATENCY_PERIODS * controller.control_period
    if 0.0 < longest < latency * (1.0 - ROUNDING):
        words = (
            f"is {latency:g} s, more than {MAX_LATENCY_PERIODS} control periods "
            f"({longest:g} s); lower it or raise controller.control_period"
        )
        yield FieldError.at("controller.latency", latency, f"at most {longest:g} s", words)


def check_estimates(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that the unknowns exist, are distinct, and start within their bounds."""
    seen: set[str] = set()
    kinds: set[str] = set()
    inertia = re.sub(r"\d$", "K", scenario.space.inertias[0])
    masses = ", ".join(_forms_of_masses(scenario))
    for i, estimate in enumerate(scenario.estimates):
        key, name = f"estimates.{i}.parameter", estimate.parameter[:80]
        unknown = parse_unknown(scenario, estimate.parameter)
        if unknown is None:
            known = f"object.mass, {inertia}, fingers.N.friction"
            words = f"'{name}' cannot be estimated; {known} and {masses} can"
            yield FieldError.at(key, name, f"{known}, {masses}", words)
            continue
        if estimate.parameter in seen:
            yield FieldError.at(key, name, "each parameter once", f"'{name}' is estimated twice")
        seen.add(estimate.parameter)
        kinds.add(unknown.kind)
        low = -math.inf if estimate.minimum is None else estimate.minimum
        high = math.inf if estimate.maximum is None else estimate.maximum
        if not low <= estimate.initial <= high or low >= high:
            limit = f"{low:g} … {high:g}"
            words = f"is {estimate.initial:g}, outside its bounds {limit}"
            yield FieldError.at(f"estimates.{i}.initial", estimate.initial, limit, words)
    if {"link_mass", "friction"} <= kinds:
        words = (
            "estimates: link masses and friction cannot be estimated together, because their "
            "product makes the regression bilinear; estimate one kind and set the other"
        )
        yield FieldError("estimates", None, "link masses or friction, not both", words)


def _forms_of_masses(scenario: Scenario) -> list[str]:
    """Keys of the masses of fingers of every kind in the hand, with N and K for numbers."""
    keys = (key for i in range(len(scenario.fingers)) for key in mass_keys(scenario, i))
    forms = (re.sub(r"^fingers\.\d+", "fingers.N", key) for key in keys)
    return list(dict.fromkeys(re.sub(r"\.\d+", ".K", form) for form in forms))
