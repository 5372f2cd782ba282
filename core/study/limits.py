"""Limits of metrics in a study: a completed run past one of them counts as not held."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.run.metrics import METRICS, single_metrics
from slipgrasp.core.scenario import SPATIAL, Scenario
from slipgrasp.core.scenario.field_errors import nearest

MetricValue = float | int | bool | None


def is_past(metrics: Mapping[str, MetricValue], limits: Mapping[str, float]) -> bool:
    """Whether the magnitude of any metric exceeds its limit.

    Args:
        metrics: Metrics by name, as in tables.
        limits: Limits by name of a metric or of a component.
    """
    return any(
        abs(metrics[one] or 0.0) > limit
        for name, limit in limits.items()
        for one in components(name, metrics)
    )


def components(name: str, known: Mapping[str, object]) -> list[str]:
    """Names of the components of a metric: ``slip_path`` has ``slip_path_0``, ``slip_path_1``."""
    return [one for one in known if one == name or one.rpartition("_")[0] == name]


def check_limits(limits: Mapping[str, float], base: Scenario) -> Iterator[FieldError]:
    """Yields an error for every limit whose name is not that of a numeric metric.

    Args:
        limits: Limits by name of a metric or of a component.
        base: The base of the study.
    """
    # A study may vary the radius of the pads.
    singles = single_metrics(len(base.fingers), base.space, soft=base.space is SPATIAL)
    known = {metric.name: None for metric in singles if metric.kind != "boolean"}
    whole = [m.name for m in METRICS if m.kind != "boolean" and components(m.name, known)]
    for name, limit in limits.items():
        if name not in known and name not in whole:
            near = nearest(name, [*whole, *known])
            message = f"limits.{name}: there is no such metric{near}; metrics: {', '.join(whole)}"
            yield FieldError(
                field=f"limits.{name}", value=limit, limit=", ".join(known), message=message
            )
