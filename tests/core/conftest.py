"""Loads or compiles the kernel once, before the first test of the core."""

import pytest

from core.simulator import prepare_kernel


@pytest.fixture(scope="session", autouse=True)
def compiled_kernel():
    prepare_kernel()
