"""A law that breaks its process, or never answers, at the tenth tick if its parameter says so."""

from typing import ClassVar

import numpy as np

from slipgrasp import LawParameter

NOTHING, SEGMENTATION_FAULT, NO_ANSWER = range(3)


class Rough:
    """Carries the object as the page on laws does, until then."""

    parameters: ClassVar = {
        "fault": LawParameter(value=0.0, unit="1", minimum=0.0, maximum=2.0, text="Which.")
    }

    def command(self, seen, memory, out):
        pull = seen.velocity_gain * (seen.desired_velocity - seen.velocity)
        pull += seen.position_gain * (seen.desired_pose - seen.pose) + [0, seen.model.gravity, 0]
        force = 40.0 * seen.contact_normal + seen.model.object_mass * pull[:2] / len(seen.slip)
        out.torque[:] = np.einsum("nij,ni->nj", seen.jacobian, force)
        while seen.tick == 10 and seen.parameters.fault == NO_ANSWER:
            pass
        if seen.tick == 10 and seen.parameters.fault == SEGMENTATION_FAULT:
            import ctypes

            ctypes.string_at(0)
