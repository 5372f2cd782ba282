"""What tests of benchmarks have in common."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from slipgrasp.core.scenario.own_laws import forget, own_laws


@pytest.fixture(autouse=True)
def _known_laws() -> Iterator[None]:
    """Forgets the published laws afterwards: lists of laws to choose from have them."""
    before = own_laws()
    yield
    for law in own_laws():
        if law not in before:
            forget(law.name)
