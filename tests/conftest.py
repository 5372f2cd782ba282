"""What all tests share: the compiled kernel, which is made once per session."""

from __future__ import annotations

import pytest

from core.simulator import prepare_kernel


@pytest.fixture(scope="session", autouse=True)
def compiled_kernel() -> None:
    """Compiles or loads the kernel first, so that no single test waits for it."""
    prepare_kernel()
