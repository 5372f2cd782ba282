"""The control law and its unknown parameters."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Le, Len
from pydantic import AfterValidator, BeforeValidator, StringConstraints, WithJsonSchema
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.custom_laws import LAW_NAME, PARAMETER_NAME, law_names
from slipgrasp.core.scenario.field_types import CONFIG, MAX_FINGERS, FrozenMapping
from slipgrasp.core.scenario.laws import CONTROL_LAWS, law_kind, law_label
from slipgrasp.core.scenario.parameters import Quantity
from slipgrasp.core.scenario.space import PLANAR

# The whole scenario is checked for valid names, because a recording may have a custom law.
LawKind = Annotated[
    str,
    BeforeValidator(law_kind),
    StringConstraints(pattern=LAW_NAME),
    WithJsonSchema({"type": "string", "pattern": LAW_NAME, "examples": [*CONTROL_LAWS]}),
]

Gain = Annotated[float, Ge(0.0), Le(1e6)]
# Nonzero values stay far enough from zero that other numbers do not overflow.
PositiveGain = Annotated[float, Ge(1e-12), Le(1e6)]
Weight = Annotated[float, Ge(-1e6), Le(1e6)]

_MAX_ROWS, _MOST_ROWS_SPATIAL = 2 * (3 + MAX_FINGERS), 2 * (6 + 2 * MAX_FINGERS)

_LAWS = CONTROL_LAWS.values()


Kind = Annotated[
    LawKind,
    Quantity(
        "Control law. " + " ".join(f"{law_label(law.kind)}: {law.summary}" for law in _LAWS),
        changeable=True,
        choices=law_names,
    ),
]
# Parameters of a custom law, which declares them; missing ones have their declared defaults.
LawParameters = Annotated[
    dict[Annotated[str, StringConstraints(pattern=PARAMETER_NAME)], float],
    Len(0, 64),
    AfterValidator(FrozenMapping),
]
ControlPeriod = Annotated[
    float,
    Ge(0.0),
    Le(0.1),
    Quantity(
        "Time between control updates; 0 = continuous control, else at least 0.0001 s.",
        "s",
        typical=(0.0, 0.01),
        changeable=True,
    ),
]
RecognitionTime = Annotated[
    float,
    Ge(1e-5),
    Le(0.1),
    Quantity(
        "Time for which continuous control keeps its assumed phase when no phase is consistent.",
        "s",
        typical=(0.0001, 0.01),
        changeable=True,
        hands=(PLANAR,),
    ),
]
Latency = Annotated[
    float,
    Ge(0.0),
    Le(0.05),
    Quantity(
        "Time from a measurement to the torque that follows from it (sampled control).",
        "s",
        typical=(0.0, 0.01),
        changeable=True,
    ),
]
Prediction = Annotated[
    bool,
    Quantity(
        "Whether the law computes its command for the state that its model predicts for the time "
        "at which the torque acts (after the latency), instead of for the measured state.",
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS),
    ),
]
LinkMassRatio = Annotated[
    float,
    Ge(0.1),
    Le(10.0),
    Quantity(
        "Ratio of the link masses that the law assumes to the true ones; 1: no model error. "
        "Estimated link masses are not scaled.",
        "1",
        typical=(0.8, 1.2),
        changeable=True,
    ),
]
LinkLengthRatio = Annotated[
    float,
    Ge(0.5),
    Le(2.0),
    Quantity(
        "Ratio of the link lengths that the law assumes to the true ones; 1: no model error. "
        "Joint angles are measured; Jacobians follow from the assumed lengths.",
        "1",
        typical=(0.8, 1.2),
        changeable=True,
        hands=(PLANAR,),
    ),
]
PlanarPositionGain = Annotated[
    Gain | Annotated[tuple[Gain, ...], Len(3, 3)],
    Quantity(
        "K_p: one number for the object, or one per coordinate x, y, theta.",
        "1/s²",
        typical=(10.0, 400.0),
        changeable=True,
    ),
]
SpatialPositionGain = Annotated[
    Gain | Annotated[tuple[Gain, ...], Len(6, 6)],
    Quantity(
        "K_p: one number for the object, or one per coordinate x, y, z and rotation vector.",
        "1/s²",
        typical=(10.0, 400.0),
        changeable=True,
    ),
]
PlanarSlipPositionGain = Annotated[
    Gain | tuple[Gain, ...],
    Quantity(
        "K_p of the slips, K_p2 of the appendix: pulls a slipping contact back to its initial "
        "position, one number or one per contact; 0: only its velocity is damped.",
        "1/s²",
        typical=(0.0, 400.0),
        changeable=True,
    ),
]
SpatialSlipPositionGain = Annotated[
    Gain | tuple[Gain, ...],
    Quantity(
        "K_p of the slips, K_p2 of the appendix: pulls a slipping contact back to its initial "
        "position, one number or two per contact; 0: only its velocity is damped.",
        "1/s²",
        typical=(0.0, 400.0),
        changeable=True,
    ),
]
PlanarVelocityGain = Annotated[
    PositiveGain | tuple[PositiveGain, ...],
    Quantity(
        "K_v: one number, or one per coordinate x, y, theta and slip of each contact.",
        "1/s",
        typical=(2.0, 50.0),
        changeable=True,
    ),
]
SpatialVelocityGain = Annotated[
    PositiveGain | tuple[PositiveGain, ...],
    Quantity(
        "K_v: one number, or one per coordinate x, y, z, rotation vector and the two slips of "
        "each contact.",
        "1/s",
        typical=(2.0, 50.0),
        changeable=True,
    ),
]
AdaptationGain = Annotated[
    PositiveGain | tuple[PositiveGain, ...],
    Quantity(
        "Gamma: speed of adaptation, one number or one per unknown. It enters every law's recorded "
        "Lyapunov function.",
        "1",
        typical=(0.05, 10.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.follows_gradient),
    ),
]
PlanarLyapunovWeight = Annotated[
    Gain | tuple[Gain, ...],
    Quantity(
        "Q: weight of the errors in the Lyapunov function, a number times the identity or one "
        "per coordinate x, y, theta and slip of each contact.",
        "1",
        typical=(1.0, 100.0),
        changeable=True,
    ),
]
SpatialLyapunovWeight = Annotated[
    Gain | tuple[Gain, ...],
    Quantity(
        "Q: weight of the errors in the Lyapunov function, a number times the identity or one "
        "per coordinate x, y, z, rotation vector and the two slips of each contact.",
        "1",
        typical=(1.0, 100.0),
        changeable=True,
    ),
]
GraspForce = Annotated[
    Literal["minimum", "none"],
    Quantity(
        "Internal force: minimum inside the estimated friction cones, or none (y = 0).",
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.uses_friction),
    ),
]
PlanarDistribution = Annotated[
    Literal["exact", "hold"],
    Quantity(
        "How the contact forces produce the desired wrench: exact (forces of slipping contacts lie "
        "on their friction cones, so that slip is controlled too) or hold (every force lies inside "
        "its cone, so that changes of the assumed phase do not change the command).",
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.uses_friction),
    ),
]
SpatialDistribution = Annotated[
    Literal["exact", "hold", "softened"],
    Quantity(
        "How the contact forces produce the desired wrench: hold (every force lies inside its "
        "cone, slipping or not), exact (forces of slipping contacts lie on their cones, as in the "
        "paper) or softened (exact, except for components that would need very large forces).",
        changeable=True,
        used_by=tuple(law.kind for law in CONTROL_LAWS.values() if law.uses_friction),
    ),
]
GripSafety = Annotated[
    float,
    Ge(1.0),
    Le(10.0),
    Quantity(
        "Factor by which the commanded force stays inside the estimated cones.",
        "1",
        typical=(1.0, 2.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.uses_friction),
    ),
]
MinimumNormalForce = Annotated[
    float,
    Ge(0.0),
    Le(1e4),
    Quantity(
        "Smallest normal force that the grasp force leaves at a contact.",
        "N",
        typical=(0.0, 20.0),
        changeable=True,
    ),
]
MaximumNormalForce = Annotated[
    float | None,
    Ge(1e-3),
    Le(1e6),
    Quantity(
        "Largest normal force that a law commands at a contact; no limit if omitted.",
        "N",
        typical=(10.0, 200.0),
        changeable=True,
    ),
]
GripForce = Annotated[
    float,
    Ge(0.0),
    Le(1e4),
    Quantity(
        "initial normal force of the grip.",
        "N",
        typical=(5.0, 100.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if not law.uses_friction),
    ),
]
GripRate = Annotated[
    float,
    Ge(0.0),
    Le(1e6),
    Quantity(
        "rate at which the grip force grows while a contact slips.",
        "N/s",
        typical=(50.0, 2000.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.reacts_to_slip),
    ),
]
JawStiffness = Annotated[
    float,
    Ge(0.0),
    Le(1e7),
    Quantity(
        "stiffness of a jaw's position relative to the arm, perpendicular to its closing "
        "direction; along it, stiffness of the common motion of the self-centring jaws.",
        "N/m",
        typical=(1000.0, 50000.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.holds_tips),
    ),
]
JawDamping = Annotated[
    float,
    Ge(0.0),
    Le(1e5),
    Quantity(
        "damping of the motions that jaw_stiffness resists.",
        "N s/m",
        typical=(10.0, 300.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.holds_tips),
    ),
]
ForceRate = Annotated[
    float,
    Ge(0.0),
    Le(1e6),
    Quantity(
        "largest rate of change of the closing force.",
        "N/s",
        typical=(20.0, 1000.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.holds_tips),
    ),
]
ForceBandwidth = Annotated[
    float,
    Ge(0.01),
    Le(1e4),
    Quantity(
        "bandwidth of the closing force, which follows the grip force as a first-order lag.",
        "Hz",
        typical=(1.0, 50.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.holds_tips),
    ),
]
SlipStop = Annotated[
    float,
    Ge(0.0),
    Le(100.0),
    Quantity(
        "K_f, commanded deceleration of a slipping contact in addition to K_v, which ends its "
        "slip.",
        "m/s²",
        typical=(0.0, 2.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.has_memory),
    ),
]
Forgetting = Annotated[
    float,
    Ge(0.5),
    Le(1.0),
    Quantity(
        "forgetting factor of the estimator per 1 ms; 1: no forgetting.",
        "1",
        typical=(0.9, 1.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.has_memory),
    ),
]
Probing = Annotated[
    float,
    Ge(0.0),
    Le(10.0),
    Quantity(
        "relative growth per second of the estimated friction of a contact that has not slipped "
        "yet, which reduces an excessive grip force; 0: no growth.",
        "1/s",
        typical=(0.0, 4.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.has_memory),
    ),
]
ForceNoise = Annotated[
    float,
    Ge(1e-9),
    Le(100.0),
    Quantity(
        "assumed standard deviation of the errors of contact forces.",
        "N",
        typical=(0.01, 1.0),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.has_memory),
    ),
]
VelocityNoise = Annotated[
    float,
    Ge(0.0),
    Le(10.0),
    Quantity(
        "assumed standard deviation of the noise of measured velocities (of angles in rad/s); "
        "twice the true value costs little, half of it can lose the object.",
        "m/s",
        typical=(0.0, 0.01),
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.has_memory),
    ),
]
InitialDeviation = Annotated[
    PositiveGain | tuple[PositiveGain, ...] | None,
    Quantity(
        "assumed standard deviation of the errors of the initial estimates, one number or one per "
        "unknown (default: 3 for masses and friction, 0.1 for the inertia).",
        "",
        changeable=True,
        used_by=tuple(law.kind for law in _LAWS if law.has_memory),
    ),
]
EstimateNormBound = Annotated[
    float,
    Ge(1e-6),
    Le(1e6),
    Quantity(
        "phi_0: norm of the estimates above which theorem-4 pulls them back.",
        "1",
        typical=(0.5, 5.0),
        changeable=True,
    ),
]
PlanarLyapunovMatrix = Annotated[
    tuple[Annotated[tuple[Weight, ...], Len(1, _MAX_ROWS)], ...],
    Len(0, _MAX_ROWS),
    Quantity(
        "Full matrix Q, in place of lyapunov_weight: symmetric and positive definite, with a row "
        "for each coordinate of the error (x, y, theta and slip of each contact), then for its "
        "rate.",
        "1",
    ),
]
SpatialLyapunovMatrix = Annotated[
    tuple[Annotated[tuple[Weight, ...], Len(1, _MOST_ROWS_SPATIAL)], ...],
    Len(0, _MOST_ROWS_SPATIAL),
    Quantity(
        "Full matrix Q, in place of lyapunov_weight: symmetric and positive definite, with a row "
        "for each coordinate of the error (x, y, z, rotation vector and the two slips of each "
        "contact), then for its rate.",
        "1",
    ),
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ControllerParameters:
    """The control law of a planar hand, its gains, and its sampling and latency."""

    kind: Kind = "theorem-4"
    parameters: LawParameters = FrozenMapping()
    control_period: ControlPeriod = 0.001
    recognition_time: RecognitionTime = 0.001
    latency: Latency = 0.0
    prediction: Prediction = False
    link_mass_ratio: LinkMassRatio = 1.0
    link_length_ratio: LinkLengthRatio = 1.0
    position_gain: PlanarPositionGain = 100.0
    slip_position_gain: PlanarSlipPositionGain = 0.0
    velocity_gain: PlanarVelocityGain = 10.0
    adaptation_gain: AdaptationGain = 1.28
    lyapunov_weight: PlanarLyapunovWeight = 20.0
    grasp_force: GraspForce = "minimum"
    distribution: PlanarDistribution = "exact"
    grip_safety: GripSafety = 1.1
    minimum_normal_force: MinimumNormalForce = 1.0
    maximum_normal_force: MaximumNormalForce = None
    grip_force: GripForce = 30.0
    grip_rate: GripRate = 400.0
    jaw_stiffness: JawStiffness = 10000.0
    jaw_damping: JawDamping = 60.0
    force_rate: ForceRate = 500.0
    force_bandwidth: ForceBandwidth = 20.0
    slip_stop: SlipStop = 1.0
    forgetting: Forgetting = 0.98
    probing: Probing = 0.0
    force_noise: ForceNoise = 0.1
    velocity_noise: VelocityNoise = 0.0
    initial_deviation: InitialDeviation = None
    estimate_norm_bound: EstimateNormBound = 2.036
    lyapunov_matrix: PlanarLyapunovMatrix = ()


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialController:
    """The control law of a spatial hand, its gains, and its sampling and latency."""

    kind: Kind = "theorem-4"
    parameters: LawParameters = FrozenMapping()
    control_period: ControlPeriod = 0.001
    recognition_time: RecognitionTime = 0.001
    latency: Latency = 0.0
    prediction: Prediction = False
    link_mass_ratio: LinkMassRatio = 1.0
    link_length_ratio: LinkLengthRatio = 1.0
    position_gain: SpatialPositionGain = 100.0
    slip_position_gain: SpatialSlipPositionGain = 0.0
    velocity_gain: SpatialVelocityGain = 10.0
    adaptation_gain: AdaptationGain = 1.28
    lyapunov_weight: SpatialLyapunovWeight = 20.0
    grasp_force: GraspForce = "minimum"
    distribution: SpatialDistribution = "hold"
    grip_safety: GripSafety = 1.1
    minimum_normal_force: MinimumNormalForce = 1.0
    maximum_normal_force: MaximumNormalForce = None
    grip_force: GripForce = 30.0
    grip_rate: GripRate = 400.0
    jaw_stiffness: JawStiffness = 10000.0
    jaw_damping: JawDamping = 60.0
    force_rate: ForceRate = 500.0
    force_bandwidth: ForceBandwidth = 20.0
    slip_stop: SlipStop = 1.0
    forgetting: Forgetting = 0.98
    probing: Probing = 0.0
    force_noise: ForceNoise = 0.1
    velocity_noise: VelocityNoise = 0.0
    initial_deviation: InitialDeviation = None
    estimate_norm_bound: EstimateNormBound = 2.036
    lyapunov_matrix: SpatialLyapunovMatrix = ()


Controller = ControllerParameters | SpatialController


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Estimate:
    """A parameter that the controller does not know."""

    parameter: Annotated[str, Len(1, 80), Quantity("Dotted key of the unknown parameter.")]
    initial: Annotated[
        float,
        Ge(-1e3),
        Le(1e3),
        Quantity(
            "Initial estimate, in the unit of the parameter.",
            "",
            changeable=True,
        ),
    ]
    minimum: Annotated[
        float | None,
        Ge(-1e3),
        Le(1e3),
        Quantity("Smallest allowed estimate; no bound if omitted.", "", changeable=True),
    ] = None
    maximum: Annotated[
        float | None,
        Ge(-1e3),
        Le(1e3),
        Quantity("Largest allowed estimate; no bound if omitted.", "", changeable=True),
    ] = None
