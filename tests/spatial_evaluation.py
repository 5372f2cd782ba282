"""One state of a spatial hand, by the units of the kernel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import Floats, Record, make_record
from slipgrasp.core.kernel.loop.status import RUNNING
from slipgrasp.core.kernel.spatial.command import spatial_command
from slipgrasp.core.kernel.spatial.contact_problem import SELECTION_ROOM
from slipgrasp.core.kernel.spatial.contact_solution import SELECTED
from slipgrasp.core.kernel.spatial.flow import spatial_plant
from slipgrasp.core.kernel.spatial.learning import MEMORY, spatial_learn
from slipgrasp.core.kernel.spatial.model import pack_model
from slipgrasp.core.kernel.spatial.selection import spatial_select
from slipgrasp.core.kernel.spatial.sensing import SENSES
from slipgrasp.core.kernel.spatial.state import STATE, parts_of
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, SLIP, STICK, WORKSPACE
from slipgrasp.core.scenario.spatial import SpatialScenario
from tests.references.spatial_plant import Phase, State


class Motion(NamedTuple):
    """What the plant does, SI units."""

    acceleration: Floats  # (6 + 2n,), object and slips
    forces: Floats  # (n, 3)
    arms: Floats  # (n, 3)
    joint_rates: Floats  # (n, 3)
    determinant: float


class SpatialEvaluation:
    """The kernel at one state.

    Args:
        scenario: The hand.
        state: Its state.
        phase: Of the plant before any selection, and of the controller's belief.
        estimates: What the controller believes.
    """

    def __init__(
        self, scenario: SpatialScenario, state: State, phase: Phase, estimates: Floats
    ) -> None:
        self.n, self.p = len(scenario.fingers), len(scenario.estimates)
        self.model = pack_model(scenario, [0.0] * 6)
        self.discrete, self.work = make_record(DISCRETE), make_record(WORKSPACE)
        self.senses = make_record(SENSES)
        self.state: Record = make_record(STATE)
        parts = parts_of(self.state, self.n)
        parts.pose[:] = *state.position, *state.quaternion
        parts.velocity[:] = state.velocity
        parts.slip[:], parts.slip_velocity[:] = state.slip.ravel(), state.slip_velocity.ravel()
        # The law asks of a phase only whether it is stick.
        self.discrete.phases[: self.n] = np.where(phase.slipping, SLIP, STICK)
        self.discrete.directions[: self.n, :2] = phase.directions
        self.discrete.slips[: self.n] = ~phase.sticks
        self.discrete.estimates[: self.p] = estimates
        self.discrete.beliefs[: self.n] = self.discrete.phases[: self.n]
        self.senses.measured = self.state
        self.senses.slips[: self.n] = ~phase.sticks
        self.senses.gamma[: self.n, :2] = phase.directions

    def plant(self, torques: Floats) -> Motion:
        """Motion under torques ``(n, 3)`` [N m]."""
        self.discrete.torques[: self.n] = torques
        call(spatial_plant, self.model, self.discrete, self.state, self.work)
        return self._motion()

    def select(self, torques: Floats) -> tuple[Phase | None, Motion]:
        """The phases that agree with torques, and the motion in them."""
        self.discrete.torques[: self.n] = torques
        room = make_record(SELECTION_ROOM)
        call_status = call(spatial_select, self.model, self.discrete, self.state, self.work, room)
        phase = Phase(self.discrete.slips[: self.n] == 0.0, self.work.gamma[: self.n, :2].copy())
        return (phase if call_status == SELECTED else None), self._motion()

    def command(self, t: float = 0.0) -> Floats:
        """Torques that the law asks for, ``(n, 3)`` [N m]."""
        status = call(spatial_command, self.model, self.discrete, t, self.senses, self.work)
        assert status == RUNNING
        return self.discrete.commanded[: self.n].copy()

    def learn(self) -> Floats:
        """Rates of the estimates, after a command and a selection at this state, ``(p,)``."""
        memory = make_record(MEMORY)
        memory.trust, memory.contact_trust[:] = 1.0, 1.0
        memory.slips[:], memory.gamma[:] = self.discrete.slips, self.work.gamma
        call(spatial_learn, self.model, self.discrete, self.state, self.work, memory)
        return self.work.rates[: self.p].copy()

    def _motion(self) -> Motion:
        work, n = self.work, self.n
        return Motion(
            np.concatenate([work.acceleration, work.slip_acceleration[:n].ravel()]),
            work.forces[:n].copy(),
            work.kin.arms[:n].copy(),
            work.kin.rates[:n].copy(),
            float(work.system.determinant),
        )
