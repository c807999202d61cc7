"""Radial grids: the rings in which a simulation counts the light that comes back.

A grid is uniform: ``annuli`` rings, each ``dr_mm`` wide, from the axis outwards. The simulation
counts light beyond the last ring separately. The default spacing and radius are those of "Separable
Subsurface Scattering", supplementary material F.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sssfit.arrays import check_record
from sssfit.errors import SimulationError
from sssfit.material import Material
from sssfit.messages import shown

MOST_ANNULI = 100_000  # 80 times skin1's; three channels of sums and squares are then 5 MB a thread
_RINGS_PER_MFP = 20  # of the shortest mean free path
_MFPS_PER_RADIUS = 32  # of the longest


@dataclass(frozen=True, slots=True)
class RadialGrid:
    """A uniform radial grid.

    Parameters
    ----------
    dr_mm : float
        Width of a ring [mm].
    annuli : int
        Number of rings, 1 to 100 000.

    Raises
    ------
    SimulationError
        The width is not a finite length above 0, or the number of rings is out of range.
    """

    dr_mm: float
    annuli: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "dr_mm", _length("dr_mm", self.dr_mm))
        count = self.annuli
        if isinstance(count, bool) or not isinstance(count, Integral) or count < 1:
            raise SimulationError(f"annuli = {shown(count)}; expected a whole number above 0.")
        _check_count(int(count), self.dr_mm)
        object.__setattr__(self, "annuli", int(count))

    @property
    def radius_mm(self) -> float:
        """Outer radius of the last ring [mm]."""
        return self.dr_mm * self.annuli

    @property
    def r_edges_mm(self) -> NDArray[np.float64]:
        """Radii of the ring edges [mm], (annuli + 1,); the first is 0."""
        return self.dr_mm * np.arange(self.annuli + 1, dtype=np.float64)


def paper_grid(material: Material) -> RadialGrid:
    """Return the grid of the paper: 20 rings in the shortest mean free path, 32 of the longest out.

    ``dr = min(MFP) / 20`` and ``annuli = ceil(32 max(MFP) / dr)`` over the channels of all layers
    that are not clear, with reduced mean free paths ("Separable Subsurface Scattering",
    supplementary material F). For high albedo the radius cuts off energy: 2.7 % of wholemilk's red.

    Raises
    ------
    SimulationError
        The mean free paths differ so much that the grid would need over 100 000 rings.
    """
    return make_grid(material)


def make_grid(
    material: Material, *, dr_mm: float | None = None, radius_mm: float | None = None
) -> RadialGrid:
    """Return the grid of the paper, or one with another ring width or radius.

    Parameters
    ----------
    material : Material
        Its reduced mean free paths give the defaults.
    dr_mm : float, optional
        Width of a ring [mm]; by default a 20th of the shortest mean free path.
    radius_mm : float, optional
        Outer radius [mm], rounded up to whole rings; by default 32 of the longest mean free paths.

    Raises
    ------
    SimulationError
        A length is not finite and above 0, the rings are wider than the radius, or there are over
        100 000 of them; the message names valid widths and radii.
    """
    check_record("material", material, Material, SimulationError)
    paths_mm = np.concatenate([layer.mean_free_path_mm for layer in material.layers])
    paths_mm = paths_mm[np.isfinite(paths_mm)]
    shortest, longest = float(paths_mm.min()), float(paths_mm.max())
    dr = shortest / _RINGS_PER_MFP if dr_mm is None else _length("dr_mm", dr_mm)
    radius = _MFPS_PER_RADIUS * longest if radius_mm is None else _length("radius_mm", radius_mm)
    why = (
        f" (sigma_a_per_mm and sigma_s_per_mm give mean free paths from {shortest:.3g} to "
        f"{longest:.3g} mm)"
    )
    return grid_of_lengths(dr, radius, whose=f"{material.name}: ", why=why)


def grid_of_lengths(
    dr_mm: float, radius_mm: float, *, whose: str = "", why: str = ""
) -> RadialGrid:
    """Return the grid of rings ``dr_mm`` wide that covers ``radius_mm``, rounded up to whole rings.

    Raises SimulationError as `make_grid`; its message begins with ``whose`` and includes ``why``.
    """
    dr, radius = _length("dr_mm", dr_mm), _length("radius_mm", radius_mm)
    if dr > radius * (1.0 + 1e-9):
        raise SimulationError(
            f"{whose}annuli {dr:g} mm wide do not fit into a radius of {radius:g} mm; use a "
            "smaller `dr_mm` or a larger `radius_mm` (both in mm)."
        )
    # 1e-9: a ratio that is an integer up to rounding must not gain a ring.
    annuli = max(1, math.ceil(radius / dr - 1e-9))
    _check_count(annuli, dr, whose, why)
    return RadialGrid(dr, annuli)


def _length(key: str, value: Any) -> float:
    """Return a finite length above 0."""
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not is_number:
        raise SimulationError(f"{key} = {shown(value)} is not a number; expected a length in mm.")
    if not 1e-12 <= value <= 1e12:
        raise SimulationError(f"{key} = {shown(value)}; expected a length from 1e-12 to 1e12 mm.")
    return float(value)


def _check_count(annuli: int, dr_mm: float, whose: str = "", why: str = "") -> None:
    """Raise an error for too many rings, with a sufficient width or radius."""
    if annuli > MOST_ANNULI:
        annuli = min(annuli, 10**300)  # a float has no larger ones
        least_dr = _rounded(dr_mm * (annuli / MOST_ANNULI), math.ceil)
        most_radius = _rounded(dr_mm * MOST_ANNULI, math.floor)
        raise SimulationError(
            f"{whose}the grid would have {annuli:.6g} annuli, over the limit of {MOST_ANNULI}{why}"
            f"; use `dr_mm = {least_dr}` or more, or "
            f"`radius_mm = {most_radius}` or less (both in mm)."
        )


def _rounded(value: float, rounding: Callable[[float], int]) -> str:
    """Return a number with three digits as text, rounded to the safe side."""
    scale = 10.0 ** (math.floor(math.log10(value)) - 2)
    return f"{rounding(value / scale) * scale:.3g}"
