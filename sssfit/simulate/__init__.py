"""Material to profile: one method, one file, one signature ``simulate_x(material, ...)``."""

from sssfit._jit import compiled_before
from sssfit.simulate._checkpoint import EVERY_SECONDS, Checkpoint
from sssfit.simulate._finished import is_complete, is_finished
from sssfit.simulate._run import Progress
from sssfit.simulate.montecarlo import (
    shared_walks,
    simulate_montecarlo,
    simulate_montecarlo_many,
)

__all__ = [
    "EVERY_SECONDS",
    "Checkpoint",
    "Progress",
    "compiled_before",
    "is_complete",
    "is_finished",
    "shared_walks",
    "simulate_montecarlo",
    "simulate_montecarlo_many",
]
