"""Bounded numbers that several parts of a scenario share."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Ge, Gt, Le
from pydantic import ConfigDict

__all__ = ["CONFIG", "Coordinate", "Gain", "PositiveGain"]

CONFIG = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

Coordinate = Annotated[float, Ge(-1e3), Le(1e3)]
Gain = Annotated[float, Ge(0.0), Le(1e6)]
PositiveGain = Annotated[float, Gt(0.0), Le(1e6)]
