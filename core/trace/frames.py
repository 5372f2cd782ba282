"""Traces as pandas and xarray objects, if those packages are installed."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.scenario.space import Space
from slipgrasp.core.trace.columns import Column, columns_of, labels_of, units_of
from slipgrasp.core.trace.signals import SIGNALS, Samples, Signal, TraceShape
from slipgrasp.core.trace.types import ContactPhase

if TYPE_CHECKING:
    import pandas
    import xarray


class MissingPackageError(SlipgraspError, ImportError):
    """An optional package is not installed."""

    def __init__(self, package: str) -> None:
        super().__init__(f"{package} is not installed; 'pip install {package}' adds it")


def import_optional(package: str) -> Any:
    """Imports an optional package.

    Raises:
        MissingPackageError: If it is not installed.
    """
    try:
        return import_module(package)
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        raise MissingPackageError(package) from None


def trace_to_pandas(trace: Samples) -> pandas.DataFrame:
    """Converts a trace to a table; see `slipgrasp.core.trace.trace.Trace.to_pandas`."""
    pandas = import_optional("pandas")
    time, *columns = columns_of(trace)
    index = pandas.Index(time.values, name=time.name)
    frame = pandas.DataFrame(
        {c.name: _values(pandas, c, trace.shape.space) for c in columns}, index=index
    )
    frame.attrs["units"] = {column.name: column.unit for column in (time, *columns)}
    return frame


def trace_to_xarray(trace: Samples) -> xarray.Dataset:
    """Converts a trace to labelled arrays; see `slipgrasp.core.trace.trace.Trace.to_xarray`."""
    xarray = import_optional("xarray")
    there = (signal for signal in SIGNALS if trace.shape.has(signal))
    time, *signals = (signal for signal in there if signal.name not in trace.absent)
    return xarray.Dataset(
        {signal.name: _variable(trace, signal) for signal in signals},
        coords={"time": ("time", trace.times, _attributes(time, trace.shape)), **_labels(trace)},
    )


def _values(pandas: Any, column: Column, space: Space) -> Any:
    if not column.holds_phases:
        return column.values
    words = [phase.label for phase in ContactPhase.known(space)]
    return pandas.Categorical(column.phase_labels(), categories=words)


def _labels(trace: Samples) -> dict[str, list[str] | list[int]]:
    """Names of the coordinates along each dimension except time."""
    shape = trace.shape
    there = (s for s in SIGNALS if s.per and shape.has(s))
    labels = {_dimension(s, shape): list(labels_of(s, shape)) for s in there}
    return {**labels, "contact": list(range(trace.shape.num_contacts))}


def _dimension(signal: Signal, shape: TraceShape) -> str:
    """Dimension of the components of a signal; none if there is only one."""
    if signal.per in ("path", "pad") or (signal.per == "tangent" and shape.space.num_tangents == 1):
        return "contact"
    if signal.per == "pose" and shape.space.pose == shape.coordinates:
        return "coordinate"
    return signal.per


def _variable(trace: Samples, signal: Signal) -> tuple[Any, ...]:
    dimensions = ("time", _dimension(signal, trace.shape)) if signal.per else ("time",)
    return (dimensions, getattr(trace, signal.name), _attributes(signal, trace.shape))


def _attributes(signal: Signal, shape: TraceShape) -> dict[str, str]:
    units = units_of(signal, shape)
    unit = units[0] if len(set(units)) == 1 else ", ".join(units)
    return {"units": unit, "long_name": signal.text}
