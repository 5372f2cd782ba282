"""Simulation of grasping with slip: the public Python interface.

    import slipgrasp

    scenario = slipgrasp.load_scenario("paper-case-1")
    result = slipgrasp.simulate(slipgrasp.with_values(scenario, {"object.mass": 1.4}))
    slipgrasp.write_recording(result, Path("heavier.mcap"))

The names are those of `slipgrasp.interface`. They are imported on first use, so that ``import
slipgrasp`` is fast.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from slipgrasp.interface import *


def __getattr__(name: str) -> Any:
    """Returns a public name, or the list of them, on first use (PEP 562)."""
    if name == "__all__" or not name.startswith("_"):
        origin = vars(import_module("slipgrasp.interface"))
        public = {key: value for key, value in origin.items() if not key.startswith("_")}
        globals().update(public, __all__=sorted(public))
        if name in globals():
            return globals()[name]
    raise AttributeError(f"module 'slipgrasp' has no attribute '{name}'")


def __dir__() -> list[str]:
    return __getattr__("__all__")
