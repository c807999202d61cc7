"""Material to profile: one method, one file, one signature ``simulate_x(material, ...)``."""

from sssfit.simulate._checkpoint import (
    CHECKPOINT_MARKS,
    EVERY_SECONDS,
    Checkpoint,
    is_checkpoint_file,
)
from sssfit.simulate._deterministic import ProfileSource
from sssfit.simulate._finished import is_complete, is_finished
from sssfit.simulate._run import Progress
from sssfit.simulate._so_far import SoFar, read_checkpoint
from sssfit.simulate.burley import simulate_burley
from sssfit.simulate.dipole import simulate_dipole, simulate_dipole_grosjean
from sssfit.simulate.exact import is_solver_compiled, simulate_exact, simulate_exact_many
from sssfit.simulate.gaussians import DEON_SKIN, simulate_deon_skin, simulate_gaussians
from sssfit.simulate.montecarlo import (
    is_compiled,
    shared_walks,
    simulate_montecarlo,
    simulate_montecarlo_many,
)
from sssfit.simulate.multipole import simulate_multipole

__all__ = [
    "CHECKPOINT_MARKS",
    "DEON_SKIN",
    "EVERY_SECONDS",
    "Checkpoint",
    "ProfileSource",
    "Progress",
    "SoFar",
    "is_checkpoint_file",
    "is_compiled",
    "is_complete",
    "is_finished",
    "is_solver_compiled",
    "read_checkpoint",
    "shared_walks",
    "simulate_burley",
    "simulate_deon_skin",
    "simulate_dipole",
    "simulate_dipole_grosjean",
    "simulate_exact",
    "simulate_exact_many",
    "simulate_gaussians",
    "simulate_montecarlo",
    "simulate_montecarlo_many",
    "simulate_multipole",
]
