"""A process that has loaded what most commands need, from which others are forked.

It is imported there alone: by the fork server of `tests.slipgrasp.forked`.
"""

import slipgrasp.cli.main
import slipgrasp.core.run.simulation
import slipgrasp.figures.drawings
import slipgrasp.recordings.store.store
import slipgrasp.web.app  # noqa: F401
from slipgrasp.core.run.simulator import prepare_kernel

prepare_kernel()
