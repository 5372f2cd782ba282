"""What all tests share: the compiled kernel, which is made before the first of them."""

from __future__ import annotations

from core.simulator import prepare_kernel


def pytest_sessionstart() -> None:
    """Compiles or loads the kernel, so that neither a test nor two processes at once do it."""
    prepare_kernel()
