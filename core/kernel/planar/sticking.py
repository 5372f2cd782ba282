"""Plant under constant torques while all contacts stick, in the object's coordinates (Eq. 17).

The equations of `slipgrasp.core.kernel.planar.flow` without the parts that only laws and slipping
contacts need: the unit dynamics of links and the rows of slip.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compilation.compiler import compiled
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.numerics.elementary import sincos
from slipgrasp.core.kernel.numerics.linear import Triple, invert_symmetric, multiply_symmetric
from slipgrasp.core.kernel.planar.dynamics import joint_space, seen_at_tip
from slipgrasp.core.kernel.planar.kinematics import place_contact, solve_finger, to_contact_frame
from slipgrasp.core.kernel.planar.reduced import add_finger
from slipgrasp.core.kernel.planar.state import slip_at


@compiled
def moves_object_alone(model: Record, discrete: Record) -> bool:
    """True if the shorter equations hold: constant torques, stick, and no joint friction."""
    if model.law.period == 0.0 or model.hand.joints_rub:
        return False
    for i in range(model.num_fingers):
        if discrete.phases[i] != 0:
            return False
    return True


@compiled
def sticking_acceleration(
    model: Record, discrete: Record, state: Record, pose: Triple, velocity: Triple, work: Record
) -> tuple[Triple, float]:
    """Acceleration of the object under constant torques, and their power.

    Args:
        model: Constants of the run.
        discrete: Discrete state, with the torques; every contact sticks.
        state: State, with the slip.
        pose: Of the object [m, m, rad].
        velocity: Of the object [m/s, m/s, rad/s].
        work: Workspace; forces and extensions, needed by the guards, are written to it.

    Returns:
        Acceleration [m/s^2, m/s^2, rad/s^2], power of torques and pulses [W].
    """
    hand, body, load, kin = model.hand, model.truth.object_inertia, model.load, work.kin
    x, y, angle = pose
    vx, vy, omega = velocity
    sine, cosine = sincos(angle)
    fx, fy, moment = load[0], load[1] - body[1] * hand.gravity, load[2]
    power = load[0] * vx + load[1] * vy + load[2] * omega
    inertia = (body[0], 0.0, 0.0, body[1], 0.0, body[2])
    for i in range(model.num_fingers):
        tx, ty, rx, ry = place_contact(hand, i, state.x[slip_at(i)], cosine, sine)
        dx, dy = x + rx - hand.bases[i, 0], y + ry - hand.bases[i, 1]
        finger = solve_finger(hand, i, dx, dy, vx - omega * ry, vy + omega * rx)
        bx, by = finger.bias_x - omega * omega * rx, finger.bias_y - omega * omega * ry
        m11, m12, m22, h1, h2 = joint_space(hand, model.truth.link_masses, i, finger)
        # With h - tau in place of h, f_0 becomes f_0 - u.
        first, second = discrete.torques[i, 0], discrete.torques[i, 1]
        xx, xy, yy, ox, oy = seen_at_tip(finger, m11, m12, m22, h1 - first, h2 - second, bx, by)
        inertia = add_finger(inertia, xx, xy, yy, rx, ry)
        fx, fy, moment = fx - ox, fy - oy, moment - (rx * oy - ry * ox)
        power += first * finger.rate1 + second * finger.rate2
        kin.tangents[i, 0], kin.tangents[i, 1] = tx, ty
        kin.arms[i, 0], kin.arms[i, 1] = rx, ry
        kin.extension[i] = finger.extension
        work.dynamics.bias[i, 0], work.dynamics.bias[i, 1] = ox, oy
        work.dynamics.inertia[i, 0], work.dynamics.inertia[i, 1] = xx, xy
        work.dynamics.inertia[i, 2] = yy
    _, inverse = invert_symmetric(inertia)
    acceleration = multiply_symmetric(inverse, (fx, fy, moment))
    _keep_forces(model.num_fingers, acceleration, work)
    return acceleration, power


@compiled
def _keep_forces(n: int, acceleration: Triple, work: Record) -> None:
    """Computes the contact forces u - f_0 - Lambda a."""
    ax, ay, turn = acceleration
    kin, dynamics = work.kin, work.dynamics
    for i in range(n):
        rx, ry = kin.arms[i, 0], kin.arms[i, 1]
        sx, sy = ax - turn * ry, ay + turn * rx
        xx, xy, yy = dynamics.inertia[i, 0], dynamics.inertia[i, 1], dynamics.inertia[i, 2]
        fx = -dynamics.bias[i, 0] - xx * sx - xy * sy
        fy = -dynamics.bias[i, 1] - xy * sx - yy * sy
        work.forces[i, 0], work.forces[i, 1] = to_contact_frame(kin, i, fx, fy)
