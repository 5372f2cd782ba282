"""Hundreds of short cases of a property as one test: pytest takes longer for a test than these."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any


def each_case(names: str, cases: Iterable[Any]) -> Callable[[Callable[..., None]], Any]:
    """Calls a test for each case, as `pytest.mark.parametrize`, but all are one test.

    It fails with every case that fails, each named. Fixtures are those of all cases together.

    Args:
        names: Parameters of the test, separated by commas.
        cases: Their values: tuples if there are several.
    """
    keys = names.split(",")
    known = [case if len(keys) > 1 else (case,) for case in cases]

    def decorate(test: Callable[..., None]) -> Any:
        def run(**others: Any) -> None:
            failures = []
            for case in known:
                values = dict(zip(keys, case, strict=True))
                try:
                    test(**values, **others)
                except Exception as failure:
                    failure.add_note(f"case: {values}")
                    failures.append(failure)
            if failures:
                raise ExceptionGroup(f"{len(failures)} of {len(known)} cases", failures)

        functools.update_wrapper(run, test)
        signature = inspect.signature(test)
        left = [each for each in signature.parameters.values() if each.name not in keys]
        run.__signature__ = signature.replace(parameters=left)  # pyright: ignore[reportFunctionMemberAccess]
        return run

    return decorate
