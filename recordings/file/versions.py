"""Versions of the file format."""

from __future__ import annotations

from slipgrasp.core.scenario.space import PLANAR, RAIL, SPATIAL, SUPPORT

PLANAR_FORMATS, SPATIAL_FORMATS, SOFT_FORMATS = (1, 2, 3, 4, 5, 7), (6, 8), (9,)
SUPPORT_FORMATS, RAIL_FORMATS = (10,), (11,)
"""Formats of planar hands, spatial hands, those with soft fingertips, supports, and rails.

The oldest is first. A kind gets a new format if older readers would not read its files correctly.
"""

PLANAR_FORMAT, SPATIAL_FORMAT, SOFT_FORMAT = (
    formats[-1] for formats in (PLANAR_FORMATS, SPATIAL_FORMATS, SOFT_FORMATS)
)
SUPPORT_FORMAT, RAIL_FORMAT = SUPPORT_FORMATS[-1], RAIL_FORMATS[-1]
"""The formats of new files."""

FORMATS = {
    PLANAR: PLANAR_FORMAT,
    SPATIAL: SPATIAL_FORMAT,
    SUPPORT: SUPPORT_FORMAT,
    RAIL: RAIL_FORMAT,
}

FORMAT_VERSION = max(SOFT_FORMAT, *FORMATS.values())
"""The newest format that can be read."""

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
}
"""Signals and metrics that older formats lack, and their first format.

In the trace of an older file such a signal is absent; such a metric is computed from samples.
"""
