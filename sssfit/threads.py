"""How many threads there is room for."""

import os


def available_cores() -> int:
    """Cores this process may use (containers and ``taskset`` grant fewer than there are)."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
