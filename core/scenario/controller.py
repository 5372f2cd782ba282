"""The control law and its unknown parameters."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, Literal

from annotated_types import Interval, Len
from pydantic import AfterValidator, BeforeValidator, StringConstraints, WithJsonSchema
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.custom_laws import LAW_NAME, PARAMETER_NAME, law_names
from slipgrasp.core.scenario.field_types import CONFIG, MAX_FINGERS, FrozenMapping
from slipgrasp.core.scenario.laws import CONTROL_LAWS, law_kind, law_label
from slipgrasp.core.scenario.parameters import Quantity, changeable
from slipgrasp.core.scenario.space import PLANAR

# The whole scenario is checked for valid names, because a recording may have a custom law.
LawKind = Annotated[
    str,
    BeforeValidator(law_kind),
    StringConstraints(pattern=LAW_NAME),
    WithJsonSchema({"type": "string", "pattern": LAW_NAME, "examples": [*CONTROL_LAWS]}),
]

Gain = Annotated[float, Interval(ge=0.0, le=1e6)]
# Nonzero values stay far enough from zero that other numbers do not overflow.
PositiveGain = Annotated[float, Interval(ge=1e-12, le=1e6)]
Weight = Annotated[float, Interval(ge=-1e6, le=1e6)]

_MAX_ROWS, _MOST_ROWS_SPATIAL = 2 * (3 + MAX_FINGERS), 2 * (6 + 2 * MAX_FINGERS)

_LAWS = CONTROL_LAWS.values()
_for_memory, _for_jaws, _for_friction = (
    partial(changeable, used_by=tuple(law.kind for law in _LAWS if getattr(law, fact)))
    for fact in ("has_memory", "holds_tips", "uses_friction")
)
_KIND = "Control law. " + " ".join(f"{law_label(law.kind)}: {law.summary}" for law in _LAWS)
# Coordinates of the velocity error.
_PLANAR = "x, y, theta and slip of each contact"
_SPATIAL = "x, y, z, rotation vector and the two slips of each contact"


def _position_gain(coordinates: str) -> Quantity:
    text = f"K_p: one number for the object, or one per coordinate {coordinates}."
    return changeable(text, "1/s²", typical=(10.0, 400.0))


def _slip_position_gain(count: str) -> Quantity:
    text = (
        "K_p of the slips, K_p2 of the appendix: pulls a slipping contact back to its initial "
        f"position, one number or {count} per contact; 0: only its velocity is damped."
    )
    return changeable(text, "1/s²", typical=(0.0, 400.0))


def _velocity_gain(coordinates: str) -> Quantity:
    text = f"K_v: one number, or one per coordinate {coordinates}."
    return changeable(text, "1/s", typical=(2.0, 50.0))


def _lyapunov_weight(coordinates: str) -> Quantity:
    text = (
        "Q: weight of the errors in the Lyapunov function, a number times the identity or one per "
        f"coordinate {coordinates}."
    )
    return changeable(text, "1", typical=(1.0, 100.0))


def _lyapunov_matrix(coordinates: str) -> Quantity:
    text = (
        "Full matrix Q, in place of lyapunov_weight: symmetric and positive definite, with a row "
        f"for each coordinate of the error ({coordinates}), then for its rate."
    )
    return Quantity(text, "1")


def _distribution(choices: str) -> Quantity:
    text = f"How the contact forces produce the desired wrench: {choices}."
    return _for_friction(text)


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Controller:
    """The parameters of the control law of any hand.

    The types without a description are those of its subclasses, which bound them.
    """

    kind: Annotated[LawKind, changeable(_KIND, choices=law_names)] = "theorem-4"
    # Parameters of a custom law, which declares them; missing ones have their declared defaults.
    parameters: Annotated[
        dict[Annotated[str, StringConstraints(pattern=PARAMETER_NAME)], float],
        Len(0, 64),
        AfterValidator(FrozenMapping),
    ] = FrozenMapping()
    control_period: Annotated[
        float,
        Interval(ge=0.0, le=0.1),
        changeable(
            "Time between control updates; 0 = continuous control, else at least 0.0001 s.",
            "s",
            typical=(0.0, 0.01),
        ),
    ] = 0.001
    recognition_time: Annotated[
        float,
        Interval(ge=1e-5, le=0.1),
        changeable(
            "Time for which continuous control keeps its assumed phase when no phase is "
            "consistent.",
            "s",
            typical=(0.0001, 0.01),
            hands=(PLANAR,),
        ),
    ] = 0.001
    latency: Annotated[
        float,
        Interval(ge=0.0, le=0.05),
        changeable(
            "Time from a measurement to the torque that follows from it (sampled control).",
            "s",
            typical=(0.0, 0.01),
        ),
    ] = 0.0
    prediction: Annotated[
        bool,
        changeable(
            "Whether the law computes its command for the state that its model predicts for the "
            "time at which the torque acts (after the latency), instead of for the measured "
            "state.",
            used_by=tuple(law.kind for law in _LAWS),
        ),
    ] = False
    link_mass_ratio: Annotated[
        float,
        Interval(ge=0.1, le=10.0),
        changeable(
            "Ratio of the link masses that the law assumes to the true ones; 1: no model error. "
            "Estimated link masses are not scaled.",
            "1",
            typical=(0.8, 1.2),
        ),
    ] = 1.0
    link_length_ratio: Annotated[
        float,
        Interval(ge=0.5, le=2.0),
        changeable(
            "Ratio of the link lengths that the law assumes to the true ones; 1: no model "
            "error. Joint angles are measured; Jacobians follow from the assumed lengths.",
            "1",
            typical=(0.8, 1.2),
            hands=(PLANAR,),
        ),
    ] = 1.0
    position_gain: float | tuple[float, ...]
    slip_position_gain: float | tuple[float, ...]
    velocity_gain: float | tuple[float, ...]
    adaptation_gain: Annotated[
        PositiveGain | tuple[PositiveGain, ...],
        changeable(
            "Gamma: speed of adaptation, one number or one per unknown. It enters every law's "
            "recorded Lyapunov function.",
            "1",
            typical=(0.05, 10.0),
            used_by=tuple(law.kind for law in _LAWS if law.follows_gradient),
        ),
    ] = 1.28
    lyapunov_weight: float | tuple[float, ...]
    grasp_force: Annotated[
        Literal["minimum", "none"],
        _for_friction(
            "Internal force: minimum inside the estimated friction cones, or none (y = 0)."
        ),
    ] = "minimum"
    distribution: Any
    grip_safety: Annotated[
        float,
        Interval(ge=1.0, le=10.0),
        _for_friction(
            "Factor by which the commanded force stays inside the estimated cones.",
            "1",
            typical=(1.0, 2.0),
        ),
    ] = 1.1
    minimum_normal_force: Annotated[
        float,
        Interval(ge=0.0, le=1e4),
        changeable(
            "Smallest normal force that the grasp force leaves at a contact.",
            "N",
            typical=(0.0, 20.0),
        ),
    ] = 1.0
    maximum_normal_force: Annotated[
        float | None,
        Interval(ge=1e-3, le=1e6),
        changeable(
            "Largest normal force that a law commands at a contact; no limit if omitted.",
            "N",
            typical=(10.0, 200.0),
        ),
    ] = None
    grip_force: Annotated[
        float,
        Interval(ge=0.0, le=1e4),
        changeable(
            "initial normal force of the grip.",
            "N",
            typical=(5.0, 100.0),
            used_by=tuple(law.kind for law in _LAWS if not law.uses_friction),
        ),
    ] = 30.0
    grip_rate: Annotated[
        float,
        Interval(ge=0.0, le=1e6),
        changeable(
            "rate at which the grip force grows while a contact slips.",
            "N/s",
            typical=(50.0, 2000.0),
            used_by=tuple(law.kind for law in _LAWS if law.reacts_to_slip),
        ),
    ] = 400.0
    jaw_stiffness: Annotated[
        float,
        Interval(ge=0.0, le=1e7),
        _for_jaws(
            "stiffness of a jaw's position relative to the arm, perpendicular to its closing "
            "direction; along it, stiffness of the common motion of the self-centring jaws.",
            "N/m",
            typical=(1000.0, 50000.0),
        ),
    ] = 10000.0
    jaw_damping: Annotated[
        float,
        Interval(ge=0.0, le=1e5),
        _for_jaws(
            "damping of the motions that jaw_stiffness resists.", "N s/m", typical=(10.0, 300.0)
        ),
    ] = 60.0
    force_rate: Annotated[
        float,
        Interval(ge=0.0, le=1e6),
        _for_jaws("largest rate of change of the closing force.", "N/s", typical=(20.0, 1000.0)),
    ] = 500.0
    force_bandwidth: Annotated[
        float,
        Interval(ge=0.01, le=1e4),
        _for_jaws(
            "bandwidth of the closing force, which follows the grip force as a first-order lag.",
            "Hz",
            typical=(1.0, 50.0),
        ),
    ] = 20.0
    slip_stop: Annotated[
        float,
        Interval(ge=0.0, le=100.0),
        _for_memory(
            "K_f, commanded deceleration of a slipping contact in addition to K_v, which ends its "
            "slip.",
            "m/s²",
            typical=(0.0, 2.0),
        ),
    ] = 1.0
    forgetting: Annotated[
        float,
        Interval(ge=0.5, le=1.0),
        _for_memory(
            "forgetting factor of the estimator per 1 ms; 1: no forgetting.",
            "1",
            typical=(0.9, 1.0),
        ),
    ] = 0.98
    probing: Annotated[
        float,
        Interval(ge=0.0, le=10.0),
        _for_memory(
            "relative growth per second of the estimated friction of a contact that has not "
            "slipped yet, which reduces an excessive grip force; 0: no growth.",
            "1/s",
            typical=(0.0, 4.0),
        ),
    ] = 0.0
    force_noise: Annotated[
        float,
        Interval(ge=1e-9, le=100.0),
        _for_memory(
            "assumed standard deviation of the errors of contact forces.", "N", typical=(0.01, 1.0)
        ),
    ] = 0.1
    velocity_noise: Annotated[
        float,
        Interval(ge=0.0, le=10.0),
        _for_memory(
            "assumed standard deviation of the noise of measured velocities (of angles in "
            "rad/s); twice the true value costs little, half of it can lose the object.",
            "m/s",
            typical=(0.0, 0.01),
        ),
    ] = 0.0
    initial_deviation: Annotated[
        PositiveGain | tuple[PositiveGain, ...] | None,
        _for_memory(
            "assumed standard deviation of the errors of the initial estimates, one number or "
            "one per unknown (default: 3 for masses and friction, 0.1 for the inertia).",
            "",
        ),
    ] = None
    estimate_norm_bound: Annotated[
        float,
        Interval(ge=1e-6, le=1e6),
        changeable(
            "phi_0: norm of the estimates above which theorem-4 pulls them back.",
            "1",
            typical=(0.5, 5.0),
        ),
    ] = 2.036
    lyapunov_matrix: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ControllerParameters(Controller):
    """The control law of a planar hand, its gains, and its sampling and latency."""

    position_gain: Annotated[
        Gain | Annotated[tuple[Gain, ...], Len(3, 3)], _position_gain("x, y, theta")
    ] = 100.0
    slip_position_gain: Annotated[Gain | tuple[Gain, ...], _slip_position_gain("one")] = 0.0
    velocity_gain: Annotated[PositiveGain | tuple[PositiveGain, ...], _velocity_gain(_PLANAR)] = (
        10.0
    )
    lyapunov_weight: Annotated[Gain | tuple[Gain, ...], _lyapunov_weight(_PLANAR)] = 20.0
    distribution: Annotated[
        Literal["exact", "hold"],
        _distribution(
            "exact (forces of slipping contacts lie on their friction cones, so that slip is "
            "controlled too) or hold (every force lies inside its cone, so that changes of the "
            "assumed phase do not change the command)"
        ),
    ] = "exact"
    lyapunov_matrix: Annotated[
        tuple[Annotated[tuple[Weight, ...], Len(1, _MAX_ROWS)], ...],
        Len(0, _MAX_ROWS),
        _lyapunov_matrix(_PLANAR),
    ] = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialController(Controller):
    """The control law of a spatial hand, its gains, and its sampling and latency."""

    position_gain: Annotated[
        Gain | Annotated[tuple[Gain, ...], Len(6, 6)], _position_gain("x, y, z and rotation vector")
    ] = 100.0
    slip_position_gain: Annotated[Gain | tuple[Gain, ...], _slip_position_gain("two")] = 0.0
    velocity_gain: Annotated[PositiveGain | tuple[PositiveGain, ...], _velocity_gain(_SPATIAL)] = (
        10.0
    )
    lyapunov_weight: Annotated[Gain | tuple[Gain, ...], _lyapunov_weight(_SPATIAL)] = 20.0
    distribution: Annotated[
        Literal["exact", "hold", "softened"],
        _distribution(
            "hold (every force lies inside its cone, slipping or not), exact (forces of slipping "
            "contacts lie on their cones, as in the paper) or softened (exact, except for "
            "components that would need very large forces)"
        ),
    ] = "hold"
    lyapunov_matrix: Annotated[
        tuple[Annotated[tuple[Weight, ...], Len(1, _MOST_ROWS_SPATIAL)], ...],
        Len(0, _MOST_ROWS_SPATIAL),
        _lyapunov_matrix(_SPATIAL),
    ] = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Estimate:
    """A parameter that the controller does not know."""

    parameter: Annotated[str, Len(1, 80), Quantity("Dotted key of the unknown parameter.")]
    initial: Annotated[
        float,
        Interval(ge=-1e3, le=1e3),
        changeable("Initial estimate, in the unit of the parameter.", ""),
    ]
    minimum: Annotated[
        float | None,
        Interval(ge=-1e3, le=1e3),
        changeable("Smallest allowed estimate; no bound if omitted.", ""),
    ] = None
    maximum: Annotated[
        float | None,
        Interval(ge=-1e3, le=1e3),
        changeable("Largest allowed estimate; no bound if omitted.", ""),
    ] = None
