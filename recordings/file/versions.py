"""Versions of the file format."""

from __future__ import annotations

from slipgrasp.core.scenario.space import PLANAR, SPATIAL

PLANAR_FORMAT, SPATIAL_FORMAT, SOFT_FORMAT = 7, 8, 9
FORMATS = {PLANAR: PLANAR_FORMAT, SPATIAL: SPATIAL_FORMAT}
"""Written format of planar and spatial hands: the oldest sufficient one.

Spatial hands with soft fingertips use `SOFT_FORMAT`.
"""

SPATIAL_FORMATS = (6, SPATIAL_FORMAT, SOFT_FORMAT)
"""All formats of spatial hands."""

FORMAT_VERSION = SOFT_FORMAT
"""Newest readable format; raised when older readers cannot read a file correctly."""

FIRST_FORMAT_WITH_SHA256 = 3
"""Earlier formats hashed samples with BLAKE2b, which is slower on processors with SHA-256."""

FIRST_FORMAT_WITH_TICKS = 5
"""Earlier formats did not include the commands of the law."""

FIRST_FORMAT_WITH_STEP_METRICS = 7
"""Earlier formats computed metrics from samples; now they include events between samples."""

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
"""Signals and metrics that older formats lack, and their first format.

In the trace of an older file such a signal is absent; such a metric is computed from samples.
"""
