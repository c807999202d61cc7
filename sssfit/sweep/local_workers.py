"""The scheduler and the workers of local:N, which are Dask's without what watches them.

As they stand, each of these processes looks at itself up to a hundred times a second for Dask's
pages and logs, which are not shown here: 6 s of processors in a sweep of 50 s on two workers.
"""

import logging
from typing import Any

from sssfit.sweep.needed import needed

_LIGHT = {
    "distributed.worker.profile.enabled": False,  # looks every 10 ms
    "distributed.admin.tick.interval": "1s",  # 20 ms
    "distributed.admin.system-monitor.interval": "10s",  # .5 s
    "distributed.admin.system-monitor.disk": False,
    "distributed.worker.memory.monitor-interval": "2s",  # .1 s
    "distributed.scheduler.active-memory-manager.start": False,  # no result is kept on workers
    "distributed.diagnostics.nvml": False,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}


def local_workers(count: int) -> Any:
    """Start a scheduler in this process and processes that work for it.

    Parameters
    ----------
    count : int
        Number of worker processes, each of one thread.

    Returns
    -------
    distributed.LocalCluster
        A context, at whose end they have ended.

    Raises
    ------
    SweepError
        Dask is not installed.
    """
    distributed, config = needed("distributed", "cluster"), needed("dask.config", "cluster")
    with config.set(_LIGHT):  # which the workers take along
        return distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": "127.0.0.1:0"},  # else 8787, or a warning
            host="127.0.0.1",
            silence_logs=logging.CRITICAL,
        )
