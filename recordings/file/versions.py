"""Version of the file format that every recording carries."""

from __future__ import annotations

from slipgrasp.core.scenario.space import PLANAR, SPATIAL

PLANAR_FORMAT, SPATIAL_FORMAT, SOFT_FORMAT = 7, 8, 9
FORMATS = {PLANAR: PLANAR_FORMAT, SPATIAL: SPATIAL_FORMAT}
"""What is written of planar and of spatial hands, the least that holds it.

Of spatial hands with soft fingertips it is `SOFT_FORMAT`.
"""

SPATIAL_FORMATS = (6, SPATIAL_FORMAT, SOFT_FORMAT)
"""All formats of spatial hands."""

FORMAT_VERSION = SOFT_FORMAT
"""The newest that is read; raised when the reader before could not read a file correctly."""

FIRST_FORMAT_WITH_SHA256 = 3
"""Samples were hashed with BLAKE2b before, which takes longer where processors have SHA-256."""

FIRST_FORMAT_WITH_TICKS = 5
"""What the law answered at every tick was not recorded before."""

FIRST_FORMAT_WITH_STEP_METRICS = 7
"""Metrics were those of the samples before; they now count what happened between these too."""

FIRST_FORMAT_WITH = {
    "external_wrench": 4,
    "input_rank": 4,
    "controllability": 4,
    "commanded_torque": 5,
    "diagnostics": 5,
    "slip_path": 6,
    "spin": SOFT_FORMAT,
    "spin_velocity": SOFT_FORMAT,
    "torsional_moment": SOFT_FORMAT,
}
"""Signals and metrics that not every format holds, and since when.

In the trace of an older file such a signal is absent; such a metric is computed from the samples.
"""
