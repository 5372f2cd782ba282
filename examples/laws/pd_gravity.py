"""The built-in law pd-gravity written again, as a Python class and as a compiled function.

    slipgrasp run composite-case-2 --law examples/laws/pd_gravity.py:PdGravity
    slipgrasp run composite-case-2 --law examples/laws/pd_gravity.py:CompiledPdGravity

PD control of the object, its weight, the weight of the links, and a fixed grip: the fingertips
exert the wrench with the smallest forces in addition to the grip.
"""

import numba


def command(seen, memory, out):
    """Torque of PD control with a grip; see docs/model.md, Controllers."""
    n = len(seen.slip)
    position, velocity, grip = seen.position_gain, seen.velocity_gain, seen.grip_force
    masses = (seen.model.object_mass, seen.model.object_mass, seen.model.object_inertia)
    fx, fy, moment = [
        masses[k]
        * (
            position[k] * (seen.desired_pose[k] - seen.pose[k])
            + velocity[k] * (seen.desired_velocity[k] - seen.velocity[k])
        )
        for k in range(3)
    ]
    fy += seen.model.object_mass * seen.model.gravity
    share, mean_x, mean_y = 1.0 / n, 0.0, 0.0
    for i in range(n):
        along, across = grip * seen.contact_normal[i, 0], grip * seen.contact_normal[i, 1]
        x, y = seen.contact_arm[i]
        fx, fy, moment = fx - along, fy - across, moment - (x * across - y * along)
        mean_x, mean_y = mean_x + share * x, mean_y + share * y
    spread = 0.0
    for i in range(n):
        spread += (seen.contact_arm[i, 0] - mean_x) ** 2 + (seen.contact_arm[i, 1] - mean_y) ** 2
    ax, ay = share * fx, share * fy
    b = (moment - n * (mean_x * ay - mean_y * ax)) / spread
    for i in range(n):
        tx = ax - b * (seen.contact_arm[i, 1] - mean_y) + grip * seen.contact_normal[i, 0]
        ty = ay + b * (seen.contact_arm[i, 0] - mean_x) + grip * seen.contact_normal[i, 1]
        first, second = seen.model.link_masses[i]
        inner, outer = seen.link_direction[i, 0, 0], seen.link_direction[i, 1, 0]
        elbow = seen.model.gravity * second * seen.model.link_centres[i, 1] * outer
        lever = first * seen.model.link_centres[i, 0] + second * seen.model.link_lengths[i, 0]
        jacobian = seen.jacobian[i]
        base = seen.model.gravity * lever * inner + elbow
        out.torque[i, 0] = jacobian[0, 0] * tx + jacobian[1, 0] * ty + base
        out.torque[i, 1] = jacobian[0, 1] * tx + jacobian[1, 1] * ty + elbow


class PdGravity:
    """PD control, the assumed weight, and a fixed grip, in Python."""

    name = "my-pd"
    version = "1"

    def command(self, seen, memory, out):
        """As `command`."""
        command(seen, memory, out)


class CompiledPdGravity:
    """PD control, the assumed weight, and a fixed grip, compiled."""

    name = "my-compiled-pd"
    version = "1"
    command = staticmethod(numba.njit(command))
