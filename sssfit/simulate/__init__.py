"""Material to profile: one method per file, with one signature ``simulate_x(material, ...)``.

The package can also be called like the function `simulate`: ``sssfit.simulate("skin1")``.
"""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from sssfit.arrays import check_kinds, check_settings
from sssfit.errors import SimulationError
from sssfit.material import Material, load_material
from sssfit.messages import shown
from sssfit.methods import SIMULATIONS
from sssfit.profile import Profile
from sssfit.simulate._checkpoint import (
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
from sssfit.simulate.exact import simulate_exact, simulate_exact_many
from sssfit.simulate.gaussians import DEON_SKIN, simulate_deon_skin, simulate_gaussians
from sssfit.simulate.half_space import is_solver_compiled
from sssfit.simulate.montecarlo import (
    is_compiled,
    shared_walks,
    simulate_montecarlo,
    simulate_montecarlo_many,
)
from sssfit.simulate.multipole import simulate_multipole
from sssfit.simulate.runner import Outcome, Results, simulate_to_files

__all__ = [
    "DEON_SKIN",
    "EVERY_SECONDS",
    "Checkpoint",
    "Outcome",
    "ProfileSource",
    "Progress",
    "Results",
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
    "simulate_to_files",
]


def simulate(
    material: Material | str | Path, method: str | None = None, **settings: Any
) -> Profile:
    """Compute the diffuse reflectance profile of a material.

    Parameters
    ----------
    material : Material, str or Path
        The record, a shipped name, or the path of a TOML file, as in `sssfit.load_material`; or
        "deon-skin", the skin of six Gaussians, a profile without coefficients.
    method : str, optional
        A name of `sssfit.methods.SIMULATIONS`; by default "montecarlo", the photon walk, and
        "gaussians" for "deon-skin".
    **settings
        Keyword arguments of the method's ``simulate_x``: ``photons``, ``seed``, ``dr_mm``, ...

    Raises
    ------
    SimulationError
        The method is unknown, or cannot simulate this material with these settings.
    ArgumentError
        The method has no such setting.
    MaterialError
        The material is unknown, or its file cannot be read.
    """
    made = {each.makes: name for name, each in SIMULATIONS.items() if each.makes}
    own = made.get(material) if isinstance(material, str) else None
    if method is None:
        method = own or "montecarlo"
    if not isinstance(method, str) or method not in SIMULATIONS:
        expected = ", ".join(SIMULATIONS)
        raise SimulationError(f"method = {shown(method)}; expected one of {expected}.")
    chosen = SIMULATIONS[method]
    if own is not None and method != own:
        raise SimulationError(
            f"{material} has no coefficients, and the method {method} needs them; leave the method "
            "out."
        )
    if own is None and chosen.makes is not None:
        raise SimulationError(
            f"the method {method} makes {chosen.makes} only, and this is {shown(material)}."
        )
    profiles = chosen.load()
    check_settings(profiles, settings, f"the method {method}")
    check_kinds(chosen, settings, SimulationError)
    if own is not None:
        return _single_profile(profiles(**settings))
    record = load_material(material) if isinstance(material, str | Path) else material
    return _single_profile(profiles([record] if chosen.shares else record, **settings))


def _single_profile(found: Profile | list[Profile]) -> Profile:
    """Return the profile of a method that takes one material or several."""
    return found[0] if isinstance(found, list) else found


class _CallableRoom(ModuleType):
    """Makes the package callable, as `import sssfit.simulate` binds it to the function's name."""

    def __call__(
        self, material: Material | str | Path, method: str | None = None, **settings: Any
    ) -> Profile:
        return simulate(material, method, **settings)

    __call__.__doc__ = simulate.__doc__


sys.modules[__name__].__class__ = _CallableRoom
