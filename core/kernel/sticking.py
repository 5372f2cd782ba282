"""The plant under held torques while all contacts stick: the object's coordinates alone (Eq. 17).

The equations of `slipgrasp.core.kernel.flow` from the same kinematics and dynamics of a finger,
without what only a law or a slipping contact asks for: no parts per link, no rows of slip.
"""

from __future__ import annotations

from slipgrasp.core.kernel.compiler import compiled
from slipgrasp.core.kernel.dynamics import joint_space, seen_at_tip
from slipgrasp.core.kernel.elementary import sincos
from slipgrasp.core.kernel.kinematics import place_contact, solve_finger, to_contact_frame
from slipgrasp.core.kernel.linear import invert_symmetric
from slipgrasp.core.kernel.records import Record
from slipgrasp.core.kernel.reduced import add_finger, inertial_force
from slipgrasp.core.kernel.state import ANGLE, X, Y, slip_at, supplied_at, velocity_at


@compiled
def all_stick(model: Record, discrete: Record) -> bool:
    """Whether no contact slips."""
    for i in range(model.num_fingers):
        if discrete.phases[i] != 0:
            return False
    return True


@compiled
def sticking_flow(
    model: Record, discrete: Record, state: Record, derivative: Record, work: Record
) -> None:
    """Derivative of the state: of pose, velocity and supplied energy, 0 for the rest.

    Of ``work`` it leaves what the guards of sticking contacts watch: forces and extensions.
    """
    n, hand, body, kin = model.num_fingers, model.hand, model.truth.object_inertia, work.kin
    sine, cosine = sincos(state.x[ANGLE])
    vx, vy, omega = state.x[velocity_at(X)], state.x[velocity_at(Y)], state.x[velocity_at(ANGLE)]
    fx, fy, moment = model.load[0], model.load[1] - body[1] * hand.gravity, model.load[2]
    power = model.load[0] * vx + model.load[1] * vy + model.load[2] * omega
    inertia = (body[0], 0.0, 0.0, body[1], 0.0, body[2])
    for i in range(n):
        tx, ty, rx, ry = place_contact(hand, i, state.x[slip_at(i)], cosine, sine)
        dx, dy = state.x[X] + rx - hand.bases[i, 0], state.x[Y] + ry - hand.bases[i, 1]
        finger = solve_finger(hand, i, dx, dy, vx - omega * ry, vy + omega * rx)
        bx, by = finger.bias_x - omega * omega * rx, finger.bias_y - omega * omega * ry
        m11, m12, m22, h1, h2 = joint_space(hand, model.truth.link_masses, i, finger)
        # With h - tau for h the bias f_0 becomes f_0 - u.
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
    _, (i00, i01, i02, i11, i12, i22) = invert_symmetric(inertia)
    work.acceleration[0] = i00 * fx + i01 * fy + i02 * moment
    work.acceleration[1] = i01 * fx + i11 * fy + i12 * moment
    work.acceleration[2] = i02 * fx + i12 * fy + i22 * moment
    for i in range(n):
        work.acceleration[3 + i] = 0.0
        ox, oy = inertial_force(kin, work.dynamics, i, work.acceleration)
        work.forces[i, 0], work.forces[i, 1] = to_contact_frame(kin, i, -ox, -oy)
    for j in range(model.num_states):
        derivative.x[j] = 0.0
    for k in range(3):
        derivative.x[k] = state.x[velocity_at(k)]
        derivative.x[velocity_at(k)] = work.acceleration[k]
    derivative.x[supplied_at(model)] = power
