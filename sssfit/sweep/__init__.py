"""Sweeps: thousands of profiles over axes of coefficients, in one store, on one machine or many.

`load_plan` reads what is to be simulated, `sweep_to_store` does it and `estimate` says what it
would take. The store is a Zarr folder, which xarray opens. Zarr comes with the extra ``sweep``,
Dask with ``cluster``.
"""

from sssfit.sweep.axes import Axis
from sssfit.sweep.dry_run import Estimate, estimate
from sssfit.sweep.plan import MOST_POINTS, Plan
from sssfit.sweep.plan_file import load_plan
from sssfit.sweep.record import SweepResults
from sssfit.sweep.runner import sweep_to_store
from sssfit.sweep.store import Store, is_store

__all__ = [
    "MOST_POINTS",
    "Axis",
    "Estimate",
    "Plan",
    "Store",
    "SweepResults",
    "estimate",
    "is_store",
    "load_plan",
    "sweep_to_store",
]
