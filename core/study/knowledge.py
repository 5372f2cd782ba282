"""Knowledge of the controllers in a study, and whether the study compares adaptation."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from typing import Any

from slipgrasp.core.scenario.knowledge import Knowledge, knowledge_of
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.core.study.definition import Study, expand_key
from slipgrasp.core.words.knowledge_words import describe_comparison, given_words


def knowledge_in(study: Study) -> Knowledge:
    """Parameters that are unknown in at least one run of a study."""
    return knowledge_of(study.base, _values_in(study))


def describe_knowledge_in(study: Study) -> str:
    """Describes the knowledge of the controllers, and whether the study compares adaptation."""
    return describe_comparison(study.base, knowledge_in(study), "study")


def find_nothing_to_adapt(study: Study) -> Iterator[str]:
    """Yields a warning if no law in the study has anything to adapt."""
    known = knowledge_in(study)
    if study.base.space.has_hand and not known.estimated:
        yield (
            f"the controllers are given {given_words(known)} at every instant and have no "
            "estimates: the study compares no adaptation"
        )


def _values_in(study: Study) -> dict[str, Collection[Any]]:
    """The distinct values of each varied parameter; for a range, both bounds."""
    found: dict[str, dict[Any, None]] = {}
    for axis in study.axes:
        values = axis.values if axis.values is not None else (axis.minimum, axis.maximum)
        found |= {key: dict.fromkeys(values) for key in expand_key(study.base, axis.key)}
    runs: Counter[str] = Counter()
    for run in study.listed:
        for key, value in run.items():
            for one in expand_key(study.base, key):
                found.setdefault(one, {})[value] = None
                runs[one] += 1
    # A listed run that does not set a parameter uses that of the base.
    lacking = [key for key, count in runs.items() if count < len(study.listed)]
    base = parameter_definitions(study.base) if lacking else {}
    for key in lacking:
        found[key] |= {base[key].value: None} if key in base else {}
    return dict(found)
