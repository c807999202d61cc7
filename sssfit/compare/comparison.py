"""The records of a comparison of kernels: its pictures, and a row for each kernel on each.

``sssfit.compare.pareto`` fills them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, plain
from sssfit.errors import RenderError
from sssfit.fit import support_of
from sssfit.formats.colours import as_light
from sssfit.measure.score import COLOUR_FIGURES
from sssfit.profile import Profile


def pareto_front(cost: npt.ArrayLike, error: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Tell which points no other point dominates.

    A point is dominated by another that is at least as good in both and better in one; of points
    that are equal in both the first is kept. NaN and infinite points are never on the front.

    Parameters
    ----------
    cost, error : array (n,)
        Less is better, of both.

    Returns
    -------
    array of bool (n,)
        Along the front cost rises and error falls, both strictly.

    Raises
    ------
    RenderError
        Not two lists of the same length.

    Examples
    --------
    >>> pareto_front([2, 2, 4, 6], [0.5, 0.3, 0.4, 0.1]).tolist()
    [False, True, False, True]
    """
    costs, errors = as_light(cost, "cost"), as_light(error, "error")
    if costs.ndim != 1 or costs.shape != errors.shape:
        raise RenderError(
            f"cost of shape {costs.shape}, error {errors.shape}; expected two lists of one length."
        )
    usable = np.isfinite(costs) & np.isfinite(errors)
    front = np.zeros(costs.size, dtype=np.bool_)
    least = np.inf
    for i in np.lexsort((errors, costs)):  # stable: of equals the first comes first
        if usable[i] and errors[i] < least:
            front[i], least = True, errors[i]
    return front


# What a front can be of: the names of the command line, and the rows' fields.
ERRORS = {
    "delta-e": "delta_e_2000_mean",
    "p99": "delta_e_2000_p99",
    "l2": "relative_l2",
}
COSTS = {
    "fetches": "fetches",
    "passes": "passes",
    "bytes": "bytes_per_pixel",
    "seconds": "seconds_per_megapixel",
}
_ROW_FIGURES = (
    *("picture", "label", "method", "rank", "taps", "structure", "settings"),
    *(*COLOUR_FIGURES, "relative_l2", "rmse", "psnr_db", "energy_drift", "radial_asymmetry"),
    *("fetches", "passes", "all_passes", "bytes_per_pixel", "kernel_bytes"),
    *("seconds_per_megapixel", "fit_seconds", "relative_frobenius_error", "stop_reasons"),
)
_LEAST_ERROR = 1e-9  # what a geometric mean takes for none
_COLOURED = (1, 3)  # channels that have a colour, or are grey


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of a comparison: its size in pixels, and the exposure of its truth."""

    name: str
    width: int
    height: int
    exposure: float


@dataclass(frozen=True, slots=True, eq=False)
class KernelRow:
    """One kernel on one picture; C channels.

    Parameters
    ----------
    label, method : str
        The candidate's, as "svd 3, kept" and "svd".
    rank : int, optional
        Separable terms; None for a cascade.
    taps : int, optional
        Bilinear fetches of a pass; None for a dense kernel, with a weight for every pixel of a
        pass, and for a cascade.
    structure : str, optional
        The stages of a cascade.
    settings : mapping
        Keywords of the fit.
    picture : str
    delta_e_2000_mean, delta_e_2000_p95, delta_e_2000_p99, share_above_1 : float
    relative_l2, rmse, psnr_db : float
    energy_drift : array (C,)
        As in `ImageScore`.
    radial_asymmetry : array (C,)
        As in `Evaluation`; NaN for kernels of fewer than 9 pixels.
    fetches, passes, all_passes, bytes_per_pixel, kernel_bytes : float or int
        As in `Cost`.
    seconds_per_megapixel : float [s]
        Wall time of `render` in float64 on the largest picture, the least of several.
    fit_seconds : float [s]
        A sum of Gaussians continues from the smaller ones found before, whose time is not counted;
        nor is the fit of the dense kernel for the tables of taps that are made from it.
    relative_frobenius_error : array (C,)
        The kernel's, as in `FitResult`; NaN for tables of taps.
    stop_reasons : tuple of str
        Why the fit of each channel ended; empty for tables of taps.
    fronts : frozenset of (error, cost)
        Keys of ``ERRORS`` and ``COSTS`` for which no row of the same picture beats this one.
    """

    label: str
    method: str
    rank: int | None
    taps: int | None
    structure: str | None
    settings: Mapping[str, Any]
    picture: str
    delta_e_2000_mean: float
    delta_e_2000_p95: float
    delta_e_2000_p99: float
    share_above_1: float
    relative_l2: float
    rmse: float
    psnr_db: float
    energy_drift: FloatArray
    radial_asymmetry: FloatArray
    fetches: float
    passes: int
    all_passes: int
    bytes_per_pixel: float
    kernel_bytes: int
    seconds_per_megapixel: float
    fit_seconds: float
    relative_frobenius_error: FloatArray
    stop_reasons: tuple[str, ...]
    fronts: frozenset[tuple[str, str]] = frozenset()

    @property
    def is_dense(self) -> bool:
        """Whether it has a weight for every pixel, which no shader applies."""
        return self.taps is None and self.structure is None

    def error(self, name: str) -> float:
        """Return the error that a key of ``ERRORS`` names."""
        return float(getattr(self, ERRORS[name]))

    def cost(self, name: str) -> float:
        """Return the cost that a key of ``COSTS`` names."""
        return float(getattr(self, COSTS[name]))

    def rounded_cost(self, name: str) -> float:
        """Return the cost as a front counts it: seconds to two digits, as sure as clocks are.

        Otherwise of kernels of equal work each that was a percent faster is on the front.
        """
        cost = self.cost(name)
        return float(f"{cost:.2g}") if name == "seconds" else cost

    def to_dict(self) -> dict[str, Any]:
        """Return a row of ``sssfit compare --json``: lists and numbers, None: not measured.

        ``on_front`` tells for every error and cost whether no row of the picture beats this one.
        """
        on_front = {
            error: {cost: (error, cost) in self.fronts for cost in COSTS} for error in ERRORS
        }
        return plain({**{key: getattr(self, key) for key in _ROW_FIGURES}, "on_front": on_front})


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Every kernel on every picture.

    Parameters
    ----------
    profile : Profile
    mm_per_pixel : float [mm]
    pixels : int
        Pixels of a pass.
    threads : int
        Threads that the seconds were measured with.
    pictures : tuple of Picture
    rows : tuple of KernelRow
        Kernel by kernel in the candidates' order, for each all pictures.
    left_out : tuple of (label, reason)
        Candidates that could not be fitted.
    """

    profile: Profile
    mm_per_pixel: float
    pixels: int
    threads: int
    pictures: tuple[Picture, ...]
    rows: tuple[KernelRow, ...]
    left_out: tuple[tuple[str, str], ...]

    @property
    def missing_share(self) -> FloatArray:
        """Share of the diffuse reflectance that lies beyond the profile's grid (C,).

        True pictures have it spread evenly, or lack it where the border is black. A kernel with its
        energy restored has it near the beam, and cannot be nearer to them than that.
        """
        total = self.profile.diffuse_reflectance
        beyond = self.profile.beyond_grid
        return np.divide(beyond, total, out=np.zeros_like(total), where=total > 0.0)

    @property
    def support_mm(self) -> float:
        """Radius that keeps 99.9 % of every channel [mm]: how far a disk or an edge counts."""
        return support_of(self.profile)

    def rows_of(self, picture: str) -> list[KernelRow]:
        """Rows of one picture."""
        return [row for row in self.rows if row.picture == picture]

    def front(self, picture: str, error: str, cost: str) -> list[KernelRow]:
        """Rows of a picture that none of its rows beats, cheapest first."""
        found = [row for row in self.rows_of(picture) if (error, cost) in row.fronts]
        return sorted(found, key=lambda row: row.cost(cost))

    def to_dict(self, error: str | None = None, cost: str | None = None) -> dict[str, Any]:
        """Return the figures that ``sssfit compare --json`` prints, a row for each kernel.

        With an error and a cost also the `verdicts` by them.
        """
        material = self.profile.material_name
        asked: dict[str, Any] = {}
        last: dict[str, Any] = {}
        if error is not None and cost is not None:
            found = [asdict(each) for each in verdicts(self, error, cost)]
            asked = {"error": error, "cost": cost}
            last = {"verdict": found}
        return plain(
            {
                **asked,
                "material": material,
                "profile_method": self.profile.meta.get("method"),
                "channels": self.profile.channels,
                "mm_per_pixel": self.mm_per_pixel,
                "pixels": self.pixels,
                "threads": self.threads,
                "pictures": [asdict(each) for each in self.pictures],
                "missing_share": self.missing_share,
                "left_out": [{"label": label, "reason": why} for label, why in self.left_out],
                "rows": [{"material": material, **row.to_dict()} for row in self.rows],
                **last,
            }
        )


@dataclass(frozen=True, slots=True)
class Verdict:
    """A kernel on all pictures together.

    Parameters
    ----------
    label : str
    cost : float
        As a front counts it.
    typical_error : float
        Geometric mean over the pictures, so that all weigh alike: the errors of points are ten
        times those of a head.
    error : float
        The largest over the pictures.
    picture : str
        Where that is.
    delta_e_2000_p95 : float
        Largest over the pictures.
    """

    label: str
    cost: float
    typical_error: float
    error: float
    picture: str
    delta_e_2000_p95: float


def verdicts(comparison: Comparison, error: str, cost: str) -> list[Verdict]:
    """Return the kernels that no other beats in typical error and cost, cheapest first."""
    by_label: dict[str, list[KernelRow]] = {}
    for row in comparison.rows:
        by_label.setdefault(row.label, []).append(row)
    found = [_verdict(rows, error, cost) for rows in by_label.values()]
    on_front = pareto_front([each.cost for each in found], [each.typical_error for each in found])
    front = [each for each, is_on in zip(found, on_front, strict=True) if is_on]
    return sorted(front, key=lambda each: each.cost)


def _verdict(rows: Sequence[KernelRow], error: str, cost: str) -> Verdict:
    """Sum up one kernel's rows."""
    errors = [row.error(error) for row in rows]
    worst = int(np.argmax(errors))
    return Verdict(
        label=rows[0].label,
        cost=rows[0].rounded_cost(cost),
        typical_error=float(np.exp(np.mean(np.log(np.maximum(errors, _LEAST_ERROR))))),
        error=errors[worst],
        picture=rows[worst].picture,
        delta_e_2000_p95=max(row.delta_e_2000_p95 for row in rows),
    )


def check_error(error: str, channels: int) -> None:
    """Refuse Delta E for channels that have no colour."""
    if error != "l2" and channels not in _COLOURED:
        raise RenderError(
            f"Delta E of {channels} channels; expected 3, or 1 for grey: choose the error l2."
        )
