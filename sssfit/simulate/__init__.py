"""Material to profile: one method, one file, one signature ``simulate_x(material, ...)``."""

from sssfit._jit import compiled_before
from sssfit.simulate._batches import Progress
from sssfit.simulate.montecarlo import simulate_montecarlo, simulate_montecarlo_many

__all__ = ["Progress", "compiled_before", "simulate_montecarlo", "simulate_montecarlo_many"]
