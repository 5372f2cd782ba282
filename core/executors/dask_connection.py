"""Connection to a Dask cluster, on this machine or of an existing scheduler."""

from __future__ import annotations

import logging
import platform
import time
import warnings
from typing import TYPE_CHECKING, cast

from slipgrasp.core.executors.executor import ExecutorError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

_PATIENCE = 10.0  # [s] timeout of a scheduler that does not respond
_WORKERS_PATIENCE = 10.0  # [s] timeout of a scheduler without workers
_POLL = 0.1
_HOST = "127.0.0.1"


class DaskConnection:
    """A client of a scheduler with compatible workers.

    Attributes:
        client: Dask client for submitting tasks.
    """

    def __init__(self, address: str | None, workers: int) -> None:
        """Connects and waits until every worker has loaded the kernel.

        Args:
            address: Address of the scheduler; None starts a cluster on this machine.
            workers: Number of workers to start.

        Raises:
            ExecutorError: If there is no scheduler, no worker, or a worker with another version.
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
        """Whether the scheduler is lost."""
        stream = self.client.scheduler_comm
        alive = stream is not None and stream.comm is not None and not stream.comm.closed()
        return self.client.status != "running" or not alive

    def lost_error(self) -> ExecutorError:
        """The error for a lost scheduler."""
        return ExecutorError(
            f"the connection to the Dask scheduler {self._name} is lost; restart the scheduler, "
            "then continue"
        )

    def count_threads(self) -> int:
        """Number of tasks that the cluster executes at a time."""
        return sum(self._threads_by_worker().values())

    def replace_lost_workers(self) -> None:
        """Restarts workers that a cluster on this machine no longer restarts.

        Dask restarts workers that die at work, but not those that die while starting.
        """
        if self._cluster is not None:
            self._cluster.scale(self._num_started)

    def close(self) -> None:
        """Disconnects from the cluster, and stops it if it was started here."""
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
                f"no Dask scheduler responds at {address}; start one with 'dask scheduler'"
            ) from error

    def _wait_for_workers(self) -> None:
        # Dask's wait uses the wall clock, and ends early if that is set forward.
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
        """Loads the kernel in every worker and compares versions."""
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
                    "install the same version of slipgrasp on its machine"
                )
            for what, theirs in future.result().items():
                if theirs != ours[what]:
                    raise ExecutorError(
                        f"the Dask worker {worker} has another {what} ({theirs}) than this "
                        f"program ({ours[what]}); install the same version there"
                    )


def describe_installation() -> dict[str, str]:
    """Versions that must be equal here and on a worker; loads the kernel."""
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
        # The death of a worker counts against its running task only, not against waiting ones.
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
                # Dask always opens this HTTP server; here it has no pages, on any free port.
                dashboard_address=f"{_HOST}:0",
                scheduler_kwargs={"dashboard": False},
                silence_logs=logging.CRITICAL,
                env={ROOT_VARIABLE: str(cache_root())},
                # The process that started the workers handles Ctrl-C.
                preload="import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)",
            )
    except RuntimeError as error:
        raise ExecutorError(
            "the Dask workers cannot be started; a script must start them within "
            f"'if __name__ == \"__main__\":' ({error})"
        ) from error
