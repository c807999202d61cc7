"""Material to profile: one method, one file, one signature ``simulate_x(material, ...)``."""

from sssfit.simulate._batches import Progress
from sssfit.simulate.montecarlo import simulate_montecarlo, simulate_montecarlo_many

__all__ = ["Progress", "simulate_montecarlo", "simulate_montecarlo_many"]
