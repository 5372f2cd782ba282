"""What tests of benchmarks have in common."""

import pytest


@pytest.fixture(autouse=True)
def _known_laws(known_laws: None) -> None:
    """Several parts load the published laws."""
