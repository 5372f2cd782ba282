"""Version of the file format that every recording carries."""

from __future__ import annotations

from slipgrasp.core.scenario.space import PLANAR, SPATIAL

PLANAR_FORMATS, SPATIAL_FORMATS, SOFT_FORMATS = (1, 2, 3, 4, 5, 7), (6, 8), (9,)
"""Of planar hands, spatial hands, and spatial hands with soft fingertips, in the order of time.

A kind of hand gets a new format when the reader before could not read a file correctly.
"""

PLANAR_FORMAT, SPATIAL_FORMAT, SOFT_FORMAT = (
    formats[-1] for formats in (PLANAR_FORMATS, SPATIAL_FORMATS, SOFT_FORMATS)
)
"""The formats that are written."""

FORMATS = {PLANAR: PLANAR_FORMAT, SPATIAL: SPATIAL_FORMAT}

FORMAT_VERSION = max(PLANAR_FORMAT, SPATIAL_FORMAT, SOFT_FORMAT)
"""The newest that is read."""

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
}
"""Signals and metrics that not every format holds, and since when.

In the trace of an older file such a signal is absent; such a metric is computed from the samples.
"""
