"""The parts of a page that need a material's coefficients: models, error budget, convergence."""

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from sssfit.compare.budget import Budget, error_budgets
from sssfit.compare.convergence import Convergence, compute_convergence
from sssfit.compare.models import ModelComparison, compare_models
from sssfit.errors import SimulationError
from sssfit.material import Material
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.report.kept import told_once
from sssfit.scene.record import Scene

# Of the chart of convergence: numbers of photons, two a decade; walks of each; the exact solver's.
_WALKS, _SEEDS, _TOLERANCES = 5, 3, (1e-4, 5e-6)
_LEAST_CONVERGING = 100_000  # photons of the longest walk; the shortest then has 1000

Part = TypeVar("Part")
Parts = tuple[ModelComparison | None, tuple[Budget, ...], Convergence | None]


def parts_of(
    source: Material | Profile, exact: Profile, flat: Sequence[Scene], walk: dict[str, Any]
) -> Parts:
    """Return what needs coefficients; a part that does not cover the material is noted.

    Parameters
    ----------
    source : Material or Profile
        A profile has no coefficients, and so none of the parts.
    exact : Profile
        The material's exact profile, on the paper's grid.
    flat : sequence of Scene
        The scenes of the budget.
    walk : dict
        ``photons``, ``seed`` and ``threads`` of the photon walks.
    """
    if isinstance(source, Profile):
        return None, (), None
    with told_once():  # models and budget leave the same ones out
        return (
            _covered("models", lambda: compare_models(source, exact=exact, **walk)),
            tuple(_covered("error budget", lambda: error_budgets(source, flat, **walk)) or ()),
            _covered("convergence", lambda: _convergence(source, **walk)),
        )


def _covered(what: str, make: Callable[[], Part]) -> Part | None:
    """Return a part of the page, or None with a note if it does not cover the material."""
    try:
        return make()
    except SimulationError as refusal:
        note(f"The page has no {what}: {refusal}")
        return None


def _convergence(
    material: Material, *, photons: int, seed: int, threads: int | None
) -> Convergence | None:
    """Return walks of up to so many photons; so few that no slope would be seen have none."""
    if photons < _LEAST_CONVERGING:
        return None
    numbers = [round(photons * 10 ** (-0.5 * k)) for k in reversed(range(_WALKS))]
    settings: dict[str, Any] = {"seeds": _SEEDS, "first_seed": seed, "threads": threads}
    return compute_convergence(material, photons=numbers, tolerances=_TOLERANCES, **settings)
