"""The regressor U of Eq. 21: how the reduced equations depend on the unknowns."""

from __future__ import annotations

from slipgrasp.core.kernel.compiler import compiled
from slipgrasp.core.kernel.kinematics import to_contact_frame
from slipgrasp.core.kernel.model import FRICTION, OBJECT_INERTIA, OBJECT_MASS
from slipgrasp.core.kernel.records import Floats, Record
from slipgrasp.core.kernel.reduced import cone_normal, inertial_force, tip_acceleration


@compiled
def multiply_regressor(
    model: Record, discrete: Record, work: Record, weights: Floats, products: Floats
) -> None:
    """Writes U^T times ``weights``, U of Eq. 21 at the measured x'', to ``products`` ``(p,)``."""
    kin, acceleration, unknowns = work.kin, work.acceleration, model.unknowns
    for k in range(unknowns.count):
        kind, i, link = unknowns.kinds[k], unknowns.fingers[k], unknowns.links[k]
        if kind == OBJECT_MASS:
            lift = acceleration[1] + model.hand.gravity
            products[k] = weights[0] * acceleration[0] + weights[1] * lift
        elif kind == OBJECT_INERTIA:
            products[k] = weights[2] * acceleration[2]
        elif kind == FRICTION:
            fx, fy = inertial_force(kin, work.believed_dynamics, i, acceleration)
            _, normal = to_contact_frame(kin, i, fx, fy)
            products[k] = -discrete.beliefs[i] * normal * weights[3 + i]
        else:
            fx, fy = unit_force(kin, work.unit, i, link, acceleration)
            dx, dy = cone_normal(kin, i, discrete.beliefs[i], work.believed.friction[i])
            wx = weights[0] - kin.arms[i, 1] * weights[2] - dx * weights[3 + i]
            wy = weights[1] + kin.arms[i, 0] * weights[2] - dy * weights[3 + i]
            products[k] = wx * fx + wy * fy


@compiled
def unit_force(
    kin: Record, unit: Record, i: int, link: int, acceleration: Floats
) -> tuple[float, float]:
    """What 1 kg of a link takes of the inertial force of its finger."""
    ax, ay = tip_acceleration(kin, i, acceleration)
    xx, xy, yy = unit.inertia[i, link, 0], unit.inertia[i, link, 1], unit.inertia[i, link, 2]
    return (
        unit.bias[i, link, 0] + xx * ax + xy * ay,
        unit.bias[i, link, 1] + xy * ax + yy * ay,
    )
