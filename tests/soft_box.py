"""A box held off its centre of mass by two soft fingertips, whose joints or slides are springs."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from slipgrasp import LawParameter
from slipgrasp.core.scenario.law_loading import register_law
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.numerics import SpatialSimulation
from slipgrasp.core.scenario.spatial import (
    SpatialFinger,
    SpatialObject,
    SpatialScenario,
    SpatialTrajectory,
)

STIFFNESS, DAMPING = 3000.0, 60.0  # [N m/rad, N m s/rad]
SLIDE_STIFFNESS, JAW_MASS = 1e4, 0.1  # [N/m, kg]
GRIP = 20.0  # [N]
OFFSET = 0.02  # of the contacts from the centre of mass, along the box's y [m]


class JointSprings:
    """Presses and carries half of the box with each finger; its joints are drawn to their start."""

    name = "joint-springs"
    memory: ClassVar = {"start": (2, 3)}
    diagnostics: ClassVar = {
        "spin": ("rad", "Spin of the first fingertip."),
        "rate": ("rad/s", "Its rate."),
        "moment": ("N m", "Its moment on the object."),
        "reach": ("m", "Its eccentricity."),
    }

    def command(self, seen, memory, out):
        if seen.tick == 0:
            memory.start[:] = seen.joint_position
        model = seen.model
        out.spin[0], out.rate[0] = seen.spin[0], seen.spin_velocity[0]
        out.moment[0], out.reach[0] = seen.contact_moment[0], model.eccentricity[0]
        for i, side in enumerate((1.0, -1.0)):
            force = [side * GRIP, 0.0, 0.5 * model.object_mass * model.gravity]
            away = memory.start[i] - seen.joint_position[i]
            away[0] = (away[0] + np.pi) % (2.0 * np.pi) - np.pi
            out.torque[i] = seen.jacobian[i].T @ force + weight_of_links(seen, i)
            out.torque[i] += STIFFNESS * away - DAMPING * seen.joint_velocity[i]


def weight_of_links(seen, i):
    """Torques that carry the links of a finger [N m]."""
    model, yaw = seen.model, seen.joint_position[i, 0]
    outwards = seen.link_direction[i] @ [np.cos(yaw), np.sin(yaw), 0.0]
    mass, centre = model.link_masses[i], model.link_centres[i]
    outer = mass[1] * centre[1] * outwards[1]
    inner = (mass[0] * centre[0] + mass[1] * model.link_lengths[i, 0]) * outwards[0] + outer
    return model.gravity * np.array([0.0, inner, outer])


class SlideSprings:
    """The same for fingers on slides, which are free along x."""

    name = "slide-springs"
    parameters: ClassVar = {
        "stiffness": LawParameter(
            value=SLIDE_STIFFNESS, unit="N/m", minimum=0.0, maximum=1e6, text="Across the grip."
        )
    }
    memory: ClassVar = {"start": (2, 3)}

    def command(self, seen, memory, out):
        if seen.tick == 0:
            memory.start[:] = seen.joint_position
        model, stiffness = seen.model, seen.parameters.stiffness
        damping = 2.0 * np.sqrt(stiffness * JAW_MASS)
        for i, side in enumerate((1.0, -1.0)):
            away = memory.start[i] - seen.joint_position[i]
            out.torque[i] = stiffness * away - damping * seen.joint_velocity[i]
            out.torque[i, 0] = side * GRIP
            out.torque[i, 2] += (0.5 * model.object_mass + JAW_MASS) * model.gravity


def soft_box(
    eccentricity: float,
    period: float,
    duration: float,
    kind: str = "links",
    stiffness: float = SLIDE_STIFFNESS,
) -> SpatialScenario:
    """The scenario.

    Args:
        eccentricity: Of both pads [m].
        period: Of control [s].
        duration: Of the run [s].
        kind: Of the fingers.
        stiffness: Of slides across the grip [N/m].
    """
    law = JointSprings if kind == "links" else SlideSprings
    register_law(law)
    # On both faces +y of the box is along t_y of the one and against that of the other.
    places = ((-1.466, "side-3", -OFFSET), (1.466, "side-1", OFFSET))
    scenario = SpatialScenario(
        object=SpatialObject(
            mass=1.0, inertias=(0.0108, 0.0108, 0.0067), half_width=0.1, half_depth=0.1, height=0.3
        ),
        fingers=tuple(
            SpatialFinger(
                base=(x, 0.0, 0.0),
                friction=0.5,
                kind=kind,
                mass=JAW_MASS,
                pad_radius=1.5 * eccentricity,
                face=face,
                contact_offset=(0.0, along),
            )
            for x, face, along in places
        ),
        trajectory=SpatialTrajectory(
            start=(0.0, -OFFSET, 0.366, 1.0, 0.0, 0.0, 0.0), acceleration=(0.0,) * 6
        ),
        simulation=SpatialSimulation(
            duration=duration, relative_tolerance=1e-9, absolute_tolerance=1e-9
        ),
    )
    chosen = {"controller.kind": law.name, "controller.control_period": period}
    if kind == "slides":
        chosen["controller.parameters.stiffness"] = stiffness
    return with_values(scenario, chosen)
