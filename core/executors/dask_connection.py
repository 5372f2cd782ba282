"""The way to a Dask cluster: one on this machine, or that of a scheduler."""

from __future__ import annotations

import logging
import platform
import time
import warnings
from typing import TYPE_CHECKING, cast

from slipgrasp.core.executors.executor import ExecutorError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

_PATIENCE = 10.0  # [s] until a scheduler that does not answer is given up
_WORKERS_PATIENCE = 10.0  # [s] until one that has no workers is given up
_POLL = 0.1
_HOST = "127.0.0.1"


class DaskConnection:
    """A client of a scheduler whose workers can do what this program asks.

    Attributes:
        client: To submit tasks with.
    """

    def __init__(self, address: str | None, workers: int) -> None:
        """Connects, and waits until every worker is warm.

        Args:
            address: Of the scheduler; None starts a cluster on this machine.
            workers: How many workers to start.

        Raises:
            ExecutorError: If there is no scheduler, no worker, or one of another version.
        """
        self._cluster = _start_cluster(workers) if address is None else None
        self._num_started = workers
        self._name = address or "on this machine"
        self.client = self._connect(address)
        try:
            self._wait_for_workers()
            self._check_workers()
        except ExecutorError:
            self.close()
            raise

    @property
    def is_lost(self) -> bool:
        """Whether the scheduler is gone."""
        stream = self.client.scheduler_comm
        alive = stream is not None and stream.comm is not None and not stream.comm.closed()
        return self.client.status != "running" or not alive

    def lost_error(self) -> ExecutorError:
        """What to raise when it is."""
        return ExecutorError(f"the Dask scheduler {self._name} is gone; start it and go on")

    def count_threads(self) -> int:
        """How many tasks the cluster does at a time."""
        return sum(self._threads_by_worker().values())

    def replace_lost_workers(self) -> None:
        """Starts workers again that a cluster on this machine has given up.

        Dask does so by itself where one dies at work, but not where it dies while it starts.
        """
        if self._cluster is not None:
            self._cluster.scale(self._num_started)

    def close(self) -> None:
        """Leaves the cluster, and ends it if it was started here."""
        self.client.close(timeout=2)
        if self._cluster is not None:
            self._cluster.close(timeout=5)

    def _connect(self, address: str | None) -> Client:
        from distributed import Client
        from distributed.versions import VersionMismatchWarning

        try:
            with warnings.catch_warnings():
                # The relevant part is checked and reported below.
                warnings.simplefilter("ignore", VersionMismatchWarning)
                return Client(self._cluster or address, timeout=_PATIENCE, set_as_default=False)
        except OSError as error:
            raise ExecutorError(
                f"no Dask scheduler answers at {address}; start one with 'dask scheduler'"
            ) from error

    def _wait_for_workers(self) -> None:
        # Dask's own wait goes by the wall clock, and ends when that is set forward.
        deadline = time.monotonic() + _WORKERS_PATIENCE
        while not self._threads_by_worker():
            if time.monotonic() > deadline:
                raise ExecutorError(
                    f"the Dask scheduler {self._name} has no workers; "
                    f"start some with 'dask worker {self._name} --nthreads 1'"
                )
            time.sleep(_POLL)

    def _threads_by_worker(self) -> dict[str, int]:
        return cast("dict[str, int]", self.client.nthreads())

    def _check_workers(self) -> None:
        """Every worker loads the kernel and says what it is."""
        ours = describe_installation()
        asked = {
            worker: self.client.submit(
                describe_installation, workers=[worker], allow_other_workers=False, pure=False
            )
            for worker in self._threads_by_worker()
        }
        for worker, future in asked.items():
            error = future.exception()
            if error is not None:
                raise ExecutorError(
                    f"the Dask worker {worker} cannot run this program ({error}); "
                    "install the same version of slipgrasp where it runs"
                )
            for what, theirs in future.result().items():
                if theirs != ours[what]:
                    raise ExecutorError(
                        f"the Dask worker {worker} has another {what} ({theirs}) than this "
                        f"program ({ours[what]}); install the same there"
                    )


def describe_installation() -> dict[str, str]:
    """What must be the same here and on a worker; loads the kernel."""
    from slipgrasp.core.run.provenance import present_provenance
    from slipgrasp.core.run.simulator import prepare_kernel

    prepare_kernel()
    present = present_provenance()
    return {
        "version of slipgrasp": present.program,
        "simulation kernel": present.kernel,
        "version of Python": ".".join(platform.python_version_tuple()[:2]),
    }


def _start_cluster(workers: int) -> LocalCluster:
    from dask import config
    from distributed import LocalCluster

    from slipgrasp.core.kernel.compilation.cache import ROOT_VARIABLE, cache_root

    settings = {
        # When a worker dies, its running task is distinguished from waiting ones.
        "distributed.scheduler.allowed-failures": 0,
        "distributed.scheduler.worker-saturation": 1.0,
    }
    try:
        with config.set(settings):
            return LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host=_HOST,
                # Dask serves this address in any case: nothing on it, and any free port.
                dashboard_address=f"{_HOST}:0",
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,
                env={ROOT_VARIABLE: str(cache_root())},
                # Ctrl-C is handled by the process that started them.
                preload="import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)",
            )
    except RuntimeError as error:
        raise ExecutorError(
            "the Dask workers cannot be started; a script that starts them must do so under "
            f"'if __name__ == \"__main__\":' ({error})"
        ) from error
