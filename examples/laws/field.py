"""Three published responses to slip, as laws for slipgrasp.

    slipgrasp run composite-case-2 --law examples/laws/field.py:ReactiveForce

Only the grip forces are those of the authors. Their grippers control finger positions, ours are
driven by torque: all three laws therefore carry the object like the built-in law pd-gravity, by
feedback and compensation of its weight and that of the links. Written from papers and published
parameters, without copied code; this file has the licence of slipgrasp. Choices of ours, where
details are unpublished or do not apply to a planar point contact, are marked [C].
"""

import numba
import numpy as np

from slipgrasp import LawParameter

SWEEPS = 500  # of the quadratic program
NO_ROOM = 1e-12  # squared length below which there is no internal force


@numba.njit
def wrench_of(arm, forces):
    """Force and moment (3 numbers) of forces ``(n, 2)`` at the contacts, inertial frame."""
    moment = 0.0
    for i in range(len(arm)):
        moment += arm[i, 0] * forces[i, 1] - arm[i, 1] * forces[i, 0]
    return forces[:, 0].sum(), forces[:, 1].sum(), moment


@numba.njit
def add_least_forces(arm, wrench, forces):
    """Adds the smallest forces with a given wrench, W^+ w."""
    n, middle_x, middle_y = len(arm), arm[:, 0].mean(), arm[:, 1].mean()
    ax, ay = wrench[0] / n, wrench[1] / n
    spread = ((arm[:, 0] - middle_x) ** 2).sum() + ((arm[:, 1] - middle_y) ** 2).sum()
    turn = (wrench[2] - n * (middle_x * ay - middle_y * ax)) / spread
    for i in range(n):
        forces[i, 0] += ax - turn * (arm[i, 1] - middle_y)
        forces[i, 1] += ay + turn * (arm[i, 0] - middle_x)


@numba.njit
def make_internal(arm, forces):
    """Projects forces into the null space of the grasp, where they do not move the object."""
    fx, fy, moment = wrench_of(arm, forces)
    add_least_forces(arm, (-fx, -fy, -moment), forces)


@numba.njit
def carry(seen, squeeze, out):
    """Torques that carry the object, with an internal force.

    Args:
        seen: Inputs of the law.
        squeeze: ``(n, 2)`` forces of which the internal part is used [N]; replaced by the commanded
            contact forces, inertial frame.
        out: Output of the torque.
    """
    model = seen.model
    masses = (model.object_mass, model.object_mass, model.object_inertia)
    wrench = np.empty(3)
    for k in range(3):
        spring = seen.position_gain[k] * (seen.desired_pose[k] - seen.pose[k])
        damper = seen.velocity_gain[k] * (seen.desired_velocity[k] - seen.velocity[k])
        wrench[k] = masses[k] * (spring + damper)
    wrench[1] += model.object_mass * model.gravity
    make_internal(seen.contact_arm, squeeze)
    add_least_forces(seen.contact_arm, wrench, squeeze)
    for i in range(len(squeeze)):
        first, second = model.link_masses[i]
        outer = model.gravity * second * model.link_centres[i, 1] * seen.link_direction[i, 1, 0]
        lever = first * model.link_centres[i, 0] + second * model.link_lengths[i, 0]
        inner = model.gravity * lever * seen.link_direction[i, 0, 0] + outer
        for joint in range(2):
            pushed = seen.jacobian[i, 0, joint] * squeeze[i, 0]
            pushed += seen.jacobian[i, 1, joint] * squeeze[i, 1]
            out.torque[i, joint] = pushed + (inner if joint == 0 else outer)


@numba.njit
def carry_with_grip(seen, grip, out):
    """As `carry`, with the same normal force at every contact."""
    squeeze = np.empty((len(seen.slip), 2))
    for i in range(len(squeeze)):
        for axis in range(2):
            squeeze[i, axis] = grip * seen.contact_normal[i, axis]
    carry(seen, squeeze, out)


@numba.njit
def least_internal_step(arm, rows, bounds, step):
    """The smallest internal force with ``rows . step >= bounds``, by Hildreth's method (1957).

    Args:
        arm: ``(n, 2)`` from the centre of mass to the contacts [m].
        rows: ``(k, n, 2)``, overwritten by their internal parts.
        bounds: ``(k,)``.
        step: ``(n, 2)``, output of the force, inertial frame [N].

    Returns:
        Whether it exists: False if the bounds contradict each other.
    """
    squares, multipliers = np.empty(len(rows)), np.zeros(len(rows))
    step[:] = 0.0
    for k in range(len(rows)):
        make_internal(arm, rows[k])
        squares[k] = (rows[k] ** 2).sum()
        if squares[k] < NO_ROOM and bounds[k] > 0.0:
            return False
    for _ in range(SWEEPS):
        largest = 0.0
        for k in range(len(rows)):
            if squares[k] < NO_ROOM:
                continue
            lacking = (bounds[k] - (rows[k] * step).sum()) / squares[k]
            change = max(lacking, -multipliers[k])
            multipliers[k] += change
            step += change * rows[k]
            largest = max(largest, abs(change) * np.sqrt(squares[k]))
        if largest < 1e-9:
            return True
    return False


@numba.njit
def _ask_for_step(seen, growth, force):
    """Rows and bounds of one step: larger normal forces in slip, no smaller ones elsewhere."""
    n, limit = len(seen.slip), seen.model.torque_limit
    count = n if np.isinf(limit) else 5 * n
    rows, bounds = np.zeros((count, n, 2)), np.zeros(count)
    # Number by number, because assignment to a slice takes seconds to compile.
    for i in range(n):
        for axis in range(2):
            rows[i, i, axis] = seen.contact_normal[i, axis]
        if seen.believed_phase[i] != 0:
            bounds[i] = growth * (force[i] * seen.contact_normal[i]).sum()
    for k in range(n, count):
        i, joint, sign = (k - n) // 4, (k - n) // 2 % 2, 1.0 - 2.0 * ((k - n) % 2)
        for axis in range(2):
            rows[k, i, axis] = -sign * seen.jacobian[i, axis, joint]
        bounds[k] = sign * seen.joint_torque[i, joint] - limit
    return rows, bounds


@numba.njit
def _react(seen, memory, out):
    """Command of `ReactiveForce`."""
    n = len(seen.slip)
    if seen.tick == 0:
        memory.internal[:n, 1] = seen.grip_force
    squeeze = np.empty((n, 2))
    for i in range(n):
        for axis in range(2):
            squeeze[i, axis] = (
                memory.internal[i, 0] * seen.contact_tangent[i, axis]
                + memory.internal[i, 1] * seen.contact_normal[i, axis]
            )
    if seen.believed_phase.any() and seen.time >= memory.next_step[0]:
        rows, bounds = _ask_for_step(seen, seen.parameters.growth, memory.force[:n])
        step = np.empty((n, 2))
        if least_internal_step(seen.contact_arm, rows, bounds, step):
            squeeze += step
            memory.steps[0] += 1.0
            for i in range(n):
                memory.internal[i, 0] += (step[i] * seen.contact_tangent[i]).sum()
                memory.internal[i, 1] += (step[i] * seen.contact_normal[i]).sum()
        memory.next_step[0] = seen.time + seen.parameters.pause
    carry(seen, squeeze, out)
    out.steps[0] = memory.steps[0]
    for i in range(n):
        for axis in range(2):
            memory.force[i, axis] = squeeze[i, axis]
        normal = (squeeze[i] * seen.contact_normal[i]).sum()
        out.grip[0] = normal if i == 0 else max(out.grip[0], normal)


class ReactiveForce:
    """Steps of internal force upon slip, by a quadratic program without measured force or friction.

    T. Ayral, S. Aloui, M. Grossard, *Reactive Slip Control*, arXiv 2602.16127 (ICRA 2026). From the
    paper: binary slip per finger, the null space of the grasp matrix, a program that keeps the
    wrench within the limits of the joints. [C]: the smallest step that increases the normal forces
    of slipping contacts by ``growth`` and decreases none; then a ``pause`` of their loop, 40 ms; no
    release. With two opposed fingers the null space has one dimension: both forces grow by
    ``growth``. Their delays are settings of the scenario: slip is detected after 20.4 ms on
    average, with a deviation of 6 ms, and the torque acts 17 ms later.
    """

    name = "reactive-force"
    version = "1"
    parameters = {
        "growth": LawParameter(
            value=0.25,
            unit="1",
            minimum=0.0,
            maximum=4.0,
            text="Share by which the normal force of a slipping contact grows in a step.",
        ),
        "pause": LawParameter(
            value=0.04, unit="s", minimum=0.0, maximum=1.0, text="From one step to the next."
        ),
    }
    diagnostics = {
        "grip": ("N", "Largest normal force asked for."),
        "steps": ("1", "Steps taken so far."),
    }
    memory = {"internal": (6, 2), "force": (6, 2), "next_step": 1, "steps": 1}
    command = staticmethod(_react)


@numba.njit
def _grip_as_learnt(seen, memory, out):
    """Command of `LearntFriction`."""
    parameters, most, least = seen.parameters, 0.0, np.inf
    for i in range(len(seen.slip)):
        speed = abs(seen.slip_velocity[i])
        along, normal = abs(seen.contact_force[i, 0]), seen.contact_force[i, 1]
        if speed >= parameters.least_speed and normal >= 1.0:
            memory.samples[i] += 1.0
            memory.friction[i] += (along / normal - memory.friction[i]) / memory.samples[i]
        friction = parameters.first_friction
        if memory.samples[i] > 0.0:
            friction = max(memory.friction[i], 0.01)
        wanted = parameters.margin * max(along / friction, 2.0) + parameters.damping * speed
        most, least = max(most, wanted), min(least, friction)
    if seen.tick == 0:
        memory.grip[0] = seen.grip_force  # nothing is measured yet
    elif most > memory.grip[0]:
        memory.grip[0] = most
    else:
        memory.grip[0] = 0.95 * memory.grip[0] + 0.05 * most
    carry_with_grip(seen, memory.grip[0], out)
    out.grip[0], out.friction[0] = memory.grip[0], least


class LearntFriction:
    """A grip of twice the force that the measured load requires, with friction learnt during slip.

    G. Waltersson, Y. Karayiannidis, *Slip-aware object manipulation with parallel grippers*, arXiv
    2410.19660 (IJRR); parameters as in their repository Gabrieleenx/Slip-Aware-Object-
    Manipulation-with-Parallel-Grippers (GPL-3; no code is copied). From the paper: the grip
    max(|f_t|/mu, 2 N) times 2 plus 100 N s/m times the slip velocity, which increases immediately
    and decreases by 5 % per sample; friction from samples above 2 mm/s and 1 N. They learn it in a
    previous slide, as a line over the speed; [C]: during the run, as the mean ratio, because
    friction here does not depend on speed; ``first_friction`` until then; the finger with the
    largest required force determines the grip. Noise of the slip velocity above ``least_speed``
    gives false samples of sticking contacts. Made for two opposed fingers.
    """

    name = "learnt-friction"
    version = "1"
    parameters = {
        "first_friction": LawParameter(
            value=0.3,
            unit="1",
            minimum=0.01,
            maximum=10.0,
            text="Friction believed of a contact that has not slipped yet.",
        ),
        "margin": LawParameter(
            value=2.0, unit="1", minimum=1.0, maximum=10.0, text="Grip over what is needed."
        ),
        "damping": LawParameter(
            value=100.0, unit="N s/m", minimum=0.0, maximum=1e4, text="Grip per slip velocity."
        ),
        "least_speed": LawParameter(
            value=2e-3, unit="m/s", minimum=0.0, maximum=1.0, text="From which friction is learnt."
        ),
    }
    diagnostics = {
        "grip": ("N", "Normal force asked for."),
        "friction": ("1", "Least friction believed."),
    }
    memory = {"grip": 1, "friction": 6, "samples": 6}
    command = staticmethod(_grip_as_learnt)


STIFFNESS, BRISTLE_DAMPING = 1e4, 4.0  # sigma_0 [N/m], sigma_1 [N s/m]


@numba.njit
def observe_slip(state, covariance, force, most, mass, period, noise, drift):
    """One step of an extended Kalman filter on the LuGre model of one contact.

    v' = (f - sigma_0 z - sigma_1 v) / m and z' = v - sigma_0 |v| z / f_max, where the friction
    sigma_0 z + sigma_1 v is measured as f.

    Args:
        state: ``(2,)`` slip velocity v [m/s] and bristle deflection z [m], updated.
        covariance: ``(2, 2)``, updated.
        force: Tangential force f, measured [N].
        most: f_max, friction times normal force [N].
        mass: m, the part of the object's mass [kg].
        period: Time since the previous step [s].
        noise: Standard deviation of the measured force [N].
        drift: Standard deviation of unmodelled velocity, per second [m/s^2].
    """
    v, z = state
    a00, a01 = 1.0 - period * BRISTLE_DAMPING / mass, -period * STIFFNESS / mass
    v_next = v + period * (force - STIFFNESS * z - BRISTLE_DAMPING * v) / mass
    decay = STIFFNESS * abs(v_next) / most
    by_speed = 1.0 - STIFFNESS * z * np.sign(v_next) / most
    z_next = (z + period * v_next) / (1.0 + period * decay)
    a10, a11 = period * by_speed * a00, 1.0 / (1.0 + period * decay) + period * by_speed * a01
    p00, p01, p11 = covariance[0, 0], covariance[0, 1], covariance[1, 1]
    q00 = a00 * a00 * p00 + 2.0 * a00 * a01 * p01 + a01 * a01 * p11 + (period * drift) ** 2
    q01 = a00 * a10 * p00 + (a00 * a11 + a01 * a10) * p01 + a01 * a11 * p11
    q11 = a10 * a10 * p00 + 2.0 * a10 * a11 * p01 + a11 * a11 * p11
    q11 += (period * period * drift) ** 2
    s0 = BRISTLE_DAMPING * q00 + STIFFNESS * q01
    s1 = BRISTLE_DAMPING * q01 + STIFFNESS * q11
    total = BRISTLE_DAMPING * s0 + STIFFNESS * s1 + noise * noise
    gain0, gain1 = s0 / total, s1 / total
    surprise = force - STIFFNESS * z_next - BRISTLE_DAMPING * v_next
    state[0], state[1] = v_next + gain0 * surprise, z_next + gain1 * surprise
    covariance[0, 0], covariance[1, 1] = q00 - gain0 * s0, q11 - gain1 * s1
    covariance[0, 1] = covariance[1, 0] = q01 - gain0 * s1


@numba.njit
def _grip_as_observed(seen, memory, out):
    """Command of `ObservedSlip`."""
    n, parameters, static, fastest = len(seen.slip), seen.parameters, 1.0, 0.0
    for i in range(n):
        along, normal = seen.contact_force[i]
        friction = max(seen.model.friction[i], 0.01)
        static = max(static, parameters.margin * abs(along) / friction)
        most, mass = friction * max(normal, 0.1), seen.model.object_mass / n
        observe_slip(
            *(memory.state[i], memory.covariance[i], along, most, mass, seen.period),
            *(parameters.force_noise, parameters.drift),
        )
        if abs(memory.state[i, 0]) > fastest:
            fastest = abs(memory.state[i, 0])
    turning = fastest / parameters.radius
    leak = 50.0 / 35.0
    memory.integral[0] += seen.period * (50.0 * turning - leak * memory.integral[0])
    dynamic = min(13.0 * turning + memory.integral[0], 10.0)
    grip = seen.grip_force if seen.tick == 0 else static + dynamic
    carry_with_grip(seen, grip, out)
    out.static_grip[0], out.dynamic_grip[0], out.speed[0] = static, dynamic, fastest


class ObservedSlip:
    """A static grip from the measured force, and a dynamic grip from observed slip.

    A. Cavallo, G. De Maria, C. Natale, S. Pirozzi, *Slipping detection and avoidance based on
    Kalman filter*, Mechatronics (2014); M. Costanzo, G. De Maria, C. Natale, Applied Sciences
    13(2) 921 (2023); parameters as published at marcocostanzo/slipping_control. From the papers:
    1.1 |f_t|/mu with a given friction, at least 1 N; in addition the slip velocity times 13, and
    its leaky integral of gain 50 and static gain 35, at most 10 N; a Kalman filter on the LuGre
    model. [C]: one filter per finger with its part of the mass; translation instead of rotation, by
    a ``radius`` of 1 cm, with the stiffness 10 kN/m and the same ratio of damping to stiffness;
    semi-implicit steps at the control period (theirs: 2 kHz); noises. Friction here is rigid
    Coulomb friction without bristles: a slip with a force below the assumed friction is not
    observed. Made for two opposed fingers: with more, the grip itself loads the contacts along
    their faces, and the static grip may grow without bound.
    """

    name = "observed-slip"
    version = "1"
    parameters = {
        "margin": LawParameter(
            value=1.1, unit="1", minimum=1.0, maximum=10.0, text="Static grip over what is needed."
        ),
        "radius": LawParameter(
            value=0.01, unit="m", minimum=1e-4, maximum=1.0, text="Slip for one radian of theirs."
        ),
        "force_noise": LawParameter(
            value=0.1, unit="N", minimum=1e-3, maximum=10.0, text="Expected of measured forces."
        ),
        "drift": LawParameter(
            value=1.0, unit="m/s^2", minimum=0.0, maximum=100.0, text="Expected of the model."
        ),
    }
    diagnostics = {
        "static_grip": ("N", "Normal force against the load."),
        "dynamic_grip": ("N", "Normal force against slip."),
        "speed": ("m/s", "Largest slip velocity observed."),
    }
    memory = {"state": (6, 2), "covariance": (6, 2, 2), "integral": 1}
    command = staticmethod(_grip_as_observed)
