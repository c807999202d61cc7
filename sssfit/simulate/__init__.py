"""Material to profile: one method, one file, one signature ``simulate_x(material, ...)``.

The package is the function `simulate` as well: ``sssfit.simulate("skin1")``.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

from sssfit.errors import SimulationError
from sssfit.material import Material, load_material
from sssfit.messages import shown
from sssfit.profile import Profile
from sssfit.simulate._checkpoint import (
    CHECKPOINT_MARKS,
    EVERY_SECONDS,
    Checkpoint,
    is_checkpoint_file,
)
from sssfit.simulate._deterministic import ProfileSource
from sssfit.simulate._finished import is_complete, is_finished, run_figures
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
    "METHODS",
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
    "run_figures",
    "shared_walks",
    "simulate",
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

METHODS: dict[str, Callable[..., Profile]] = {
    "montecarlo": simulate_montecarlo,
    "exact": simulate_exact,
    "dipole": simulate_dipole,
    "dipole-grosjean": simulate_dipole_grosjean,
    "multipole": simulate_multipole,
    "burley": simulate_burley,
}


def simulate(
    material: Material | str | Path, method: str | None = None, **settings: Any
) -> Profile:
    """Compute the diffuse reflectance profile of a material.

    Parameters
    ----------
    material : Material, str or Path
        The record, a shipped name, or the path of a TOML file, as `sssfit.load_material` takes it;
        or "deon-skin", the skin of six Gaussians, which has a profile and no coefficients.
    method : str, optional
        A name of `METHODS`; by default "montecarlo", the photon walk, and "gaussians", its only
        one, for "deon-skin".
    **settings
        Keyword arguments of the method's ``simulate_x``: ``photons``, ``seed``, ``dr_mm``, ...

    Raises
    ------
    SimulationError
        There is no such method, or it cannot treat this material with these settings.
    MaterialError
        There is no such material, or its file cannot be read.
    """
    if isinstance(material, str) and material == DEON_SKIN.name:
        if method not in (None, "gaussians"):
            raise SimulationError(
                f"{DEON_SKIN.name} has no coefficients, and method = {shown(method)} needs them; "
                "leave the method out."
            )
        return simulate_deon_skin(**settings)
    method = "montecarlo" if method is None else method
    if not isinstance(method, str) or method not in METHODS:
        raise SimulationError(f"method = {shown(method)}; expected one of {', '.join(METHODS)}.")
    if isinstance(material, str | Path):
        material = load_material(material)
    return METHODS[method](material, **settings)


class _CallableRoom(ModuleType):
    """`import sssfit.simulate` binds this package to the name, so the package itself is called."""

    def __call__(
        self, material: Material | str | Path, method: str | None = None, **settings: Any
    ) -> Profile:
        return simulate(material, method, **settings)

    __call__.__doc__ = simulate.__doc__


sys.modules[__name__].__class__ = _CallableRoom
