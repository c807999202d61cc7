"""What a walk tells apart of the directions in which light leaves: angles, or an aperture.

Its tallies have a bin for every annulus and direction. Directions are told apart by the cosines
between them, which are computed once; without any, each annulus has one bin, and nothing is lost.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sssfit.arrays import FloatArray, is_number, is_whole
from sssfit.errors import SimulationError
from sssfit.material import Material
from sssfit.messages import note, shown
from sssfit.profile.npz import FORMAT, FORMAT_OF_DIRECTIONS

MAX_ANGLES = 180  # single precision resolves the cosines between half degrees to .2 %
MAX_CELLS = 10_000_000  # 160 MB of sums for each batch that is under way


@dataclass(frozen=True, slots=True)
class Directions:
    """Directions of a walk: ``angles`` equal bins of the exit angle, or a detector's aperture.

    Parameters
    ----------
    angles : int, optional
        Bins of the angle to the normal outside, from 0 to pi/2, 1 to 180.
    aperture : float, optional
        Numerical aperture of a detector above the surface: n_above times the sine of the largest
        angle that it sees.

    Raises
    ------
    SimulationError
        A number is out of range, or both are given.
    """

    angles: int | None = None
    aperture: float | None = None

    def __post_init__(self) -> None:
        angles, aperture = self.angles, self.aperture
        if angles is not None and not (is_whole(angles) and 1 <= angles <= MAX_ANGLES):
            raise SimulationError(
                f"angles = {shown(angles)}; give a whole number of bins from 1 to {MAX_ANGLES}."
            )
        if aperture is not None and not (is_number(aperture) and 0.0 < aperture < math.inf):
            raise SimulationError(
                f"numerical_aperture = {shown(aperture)}; give a number above 0, such as 0.22."
            )
        if aperture is not None:  # as a profile's file records it
            object.__setattr__(self, "aperture", float(aperture))
        if angles is not None and aperture is not None:
            raise SimulationError(
                "`angles` and `numerical_aperture` are both given; the angles up to that of the "
                "aperture already hold what it sees: leave one out."
            )

    @property
    def edges_rad(self) -> FloatArray:
        """Edges of the angle bins (A+1,)."""
        return np.linspace(0.0, 0.5 * math.pi, (self.angles or 1) + 1)

    def above(self, material: Material) -> FloatArray:
        """Falling cosines, outside, between the directions above the surface."""
        if self.aperture is None:
            return self.below()
        sine = self.aperture / material.eta_above
        return np.array([math.sqrt(1.0 - sine * sine)] if sine < 1.0 else [])

    def note_wide(self, material: Material) -> None:
        """Say that no aperture is as wide as the one given, which then has no effect."""
        if self.aperture is not None and self.aperture > material.eta_above:
            note(
                f"`numerical_aperture = {self.aperture:g}` is above {material.eta_above:g}, the "
                "index above the surface: the detector sees all light, as without it."
            )

    def below(self) -> FloatArray:
        """Falling cosines between the directions below a stack, where no detector is."""
        if self.angles is None:
            return np.array([])
        # Python's cosine, because numpy's differs in the last bit between processors
        return np.array([math.cos(each) for each in self.edges_rad[1:-1].tolist()])

    def inside(self, material: Material) -> FloatArray:
        """Falling cosines inside the top layer between the directions above, by Snell's law."""
        ratio = material.eta_above / material.layers[0].eta
        above: list[float] = self.above(material).tolist()
        return np.array([math.sqrt(1.0 - ratio * ratio * (1.0 - c * c)) for c in above])

    def split(self, reflected: FloatArray, transmitted: FloatArray | None) -> dict[str, Any]:
        """Return a tally by direction, (n + 1, B, C, 2), as fields of `Sums`."""
        if self.angles is not None:
            below = None if transmitted is None else transmitted.sum(axis=1)
            fields = {"reflected": reflected.sum(axis=1), "transmitted": below}
            return fields | {"above_by_angle": reflected, "below_by_angle": transmitted}
        unseen = reflected[:, 1:, :, 0].sum(axis=(0, 1)) if self.aperture is not None else None
        below = None if transmitted is None else transmitted[:, 0]
        return {"reflected": reflected[:, 0], "transmitted": below, "unseen": unseen}

    def given(self) -> dict[str, float]:
        """Return what was asked for, as a profile records it: nothing without directions."""
        own = {"angles": self.angles, "numerical_aperture": self.aperture}
        return {key: value for key, value in own.items() if value is not None}

    @property
    def profile_format(self) -> str:
        """Format of a profile of these directions."""
        return FORMAT_OF_DIRECTIONS if self.given() else FORMAT


EVERYWHERE = Directions()  # all directions together


def mean_and_error(sums: FloatArray, photons: int) -> tuple[FloatArray, FloatArray]:
    """Return the mean over photons and its standard error from sums of w and w^2, (..., 2)."""
    mean, mean_square = sums[..., 0] / photons, sums[..., 1] / photons
    # Rounding may leave a variance of -1e-17 if all photons have the same weight.
    return mean, np.sqrt(np.maximum(mean_square - mean**2, 0.0) / (photons - 1))


def by_angle(sums: Any, entering: float, directions: Directions) -> dict[str, FloatArray]:
    """Return the fields of a profile by angle, from the `Sums` of a walk; none without angles."""
    found: dict[str, FloatArray] = {}
    sides = {"angle_reflected": sums.above_by_angle, "angle_transmitted": sums.below_by_angle}
    for name, bins in sides.items():
        if bins is not None:
            mean, error = mean_and_error(bins, sums.photons)
            found |= {name: entering * mean, f"{name}_stderr": entering * error}
    return found | ({"exit_angle_edges_rad": directions.edges_rad} if found else {})


def directions_of(settings: dict[str, str]) -> Directions:
    """Return the directions that a checkpoint records."""
    angles, aperture = settings.get("angles"), settings.get("numerical_aperture")
    return Directions(
        None if angles is None else int(angles), None if aperture is None else float(aperture)
    )


def check_cells(cells: int, directions: Directions) -> None:
    """Raise an error for more bins than memory should hold."""
    if directions.angles is not None and cells > MAX_CELLS:
        raise SimulationError(
            f"angles = {directions.angles} with these annuli and channels are {cells:,} bins, more "
            f"than {MAX_CELLS:,}; give fewer `angles`, or wider annuli by `dr_mm`."
        )
