"""Search for the variances of a sum of Gaussians, adding one Gaussian at a time.

The best sum of N starts from the best of N - 1 with a new Gaussian in each gap between variances,
below the smallest and above the largest. With weight 0 for the new one each start is as good as the
previous optimum, so the error cannot rise with N.
"""

import math
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit._gaussians_annuli import Annuli, Point
from sssfit.fit._target import Target
from sssfit.profile.pixels import PARTS_PER_ANNULUS, SUBDIVIDED_ANNULI, annulus_areas

# Merging the first two annuli lowers int r R^2 dr by this share or more: 16 to 33 % where R_d ~ 1/r
# (the exact profiles of four materials), under 0.6 % for dipoles on grids five times too coarse.
_STEEP = 0.05


def is_steep(target: Target, channel: int) -> bool:
    """Whether the objective depends on the resolution near the beam; see ``_STEEP``."""
    energy = target.profile.annulus_energy[:, channel]
    energy = energy / energy.sum()  # otherwise the squares of a faint profile underflow
    areas = annulus_areas(target.profile.r_edges_mm)
    norm = float(np.sum(energy**2 / areas))
    apart = float(np.sum(energy[:2] ** 2 / areas[:2]))
    together = float(energy[:2].sum() ** 2 / areas[:2].sum())
    return apart - together > _STEEP * norm


def rings(target: Target, channel: int) -> tuple[FloatArray, FloatArray]:
    """Return the edges (m+1,) [mm] and energies (m,) that a channel is fitted to.

    The profile's own, unless the profile is steep; then the ten innermost annuli are cut into equal
    parts no wider than half a pixel, by the profile's monotone interpolation of F.
    """
    profile = target.profile
    edges_mm, energy = profile.r_edges_mm, profile.annulus_energy[:, channel]
    parts = math.ceil(min(2.0 * edges_mm[1] / target.mm_per_pixel, PARTS_PER_ANNULUS) - 1e-9)
    if parts == 1 or not is_steep(target, channel):
        return edges_mm, energy
    split = min(SUBDIVIDED_ANNULI, profile.n_annuli)
    places = np.arange(split * parts + 1) / parts
    inner_mm = np.interp(places, np.arange(split + 1), edges_mm[: split + 1])
    inner = np.diff(profile.cumulative_at(inner_mm)[:, channel])
    return np.append(inner_mm, edges_mm[split + 1 :]), np.append(inner, energy[split:])


_ROUGH, _FINE = 1e-3, 1e-8  # relative gain of a step at which a start, or the fit, has converged
_STEP_SCALE = 1.5  # of a log variance, a factor of 4.5: the unit of the trust region
_LEAST_STEP = 1e-9  # shorter ones are rounding
_MOST_EVALUATIONS = 300  # from one start; 5 to 40 are usual
_MET = 1e-28  # square of a relative error that is rounding
_SINGLE_STARTS = 5  # for the first Gaussian, over the whole range
_FINISHED = 2  # of the starts, the best ones, go on to the end


@dataclass(frozen=True, slots=True, eq=False)
class GaussianSum:
    """The best sum: ascending variances (N,) [mm^2], weights (N,) as shares of the on-grid energy.

    ``error`` is relative; ``stop_reason`` says in words why it ended.
    """

    variances_mm2: FloatArray
    weights: FloatArray
    error: float
    evaluations: int
    stop_reason: str


def search(annuli: Annuli, terms: int, least_mm2: float, most_mm2: float) -> GaussianSum:
    """Find up to ``terms`` Gaussians with variances between two limits [mm^2].

    Fewer if one more does not lower the error.
    """
    bounds = float(np.log(least_mm2)), float(np.log(most_mm2))
    best, evaluations, reason = None, 0, ""
    for _ in range(terms):
        starts = _starts(None if best is None else best.log_variances, bounds)
        found, settled, count = _best_of(annuli, starts, bounds)
        evaluations += count
        if best is not None and not found.cost < best.cost:
            kept = len(best.weights)
            reason = f"{kept} of {terms} terms are enough: one more does not lower the error"
            break
        best = _without_zero_weights(found)
        reason = "converged" if settled else f"stopped after {_MOST_EVALUATIONS} evaluations"
        if best.cost <= _MET:
            reason = f"{len(best.weights)} of {terms} terms meet the profile to rounding"
            break
    assert best is not None
    if "terms" not in reason and len(best.weights) < terms:
        reason += f"; {len(best.weights)} of {terms} terms have a weight"
    return GaussianSum(
        np.exp(best.log_variances), best.weights, best.cost**0.5, evaluations, reason
    )


def _starts(log_variances: FloatArray | None, bounds: tuple[float, float]) -> list[FloatArray]:
    """Return where to start from: ascending log variances with a new one in each gap."""
    if log_variances is None:
        return [np.array([each]) for each in np.linspace(*bounds, _SINGLE_STARTS + 2)[1:-1]]
    inside = 0.5 * (log_variances[1:] + log_variances[:-1])
    new = np.clip([log_variances[0] - 2.0, *inside, log_variances[-1] + 1.5], *bounds)
    return [np.append(log_variances, each) for each in new]


def _best_of(
    annuli: Annuli, starts: list[FloatArray], bounds: tuple[float, float]
) -> tuple[Point, bool, int]:
    """Try all starts roughly, finish the best; return that point, if it converged, evaluations."""
    tried = [_descend(annuli, annuli.at(start), bounds, _ROUGH) for start in starts]
    tried.sort(key=lambda each: each[0].cost)
    finished = [_descend(annuli, each[0], bounds, _FINE) for each in tried[:_FINISHED]]
    count = len(starts) + sum(each[2] for each in [*tried, *finished])
    best = min(finished, key=lambda each: each[0].cost)
    return best[0], best[1], count


def _descend(
    annuli: Annuli, point: Point, bounds: tuple[float, float], tolerance: float
) -> tuple[Point, bool, int]:
    """Run least squares from a point; return the last point, if it converged, evaluations."""
    from scipy.optimize import least_squares  # 0.8 s that ``fit --list`` does not need

    if not np.isfinite(point.cost):
        return point, True, 0
    seen = _Seen(annuli, point)
    found = least_squares(
        seen.residual,
        point.log_variances,
        seen.jacobian,
        bounds,
        x_scale=_STEP_SCALE,
        ftol=tolerance,
        xtol=_LEAST_STEP,
        gtol=None,
        max_nfev=_MOST_EVALUATIONS,
    )
    return annuli.at(found.x), bool(found.status > 0), int(found.nfev)


class _Seen:
    """Keeps the last point, whose weights serve the residual and the Jacobian."""

    def __init__(self, annuli: Annuli, point: Point) -> None:
        self._annuli, self._point = annuli, point

    def residual(self, log_variances: FloatArray) -> FloatArray:
        if not np.array_equal(log_variances, self._point.log_variances):
            self._point = self._annuli.at(log_variances)
        return self._point.residual

    def jacobian(self, log_variances: FloatArray) -> FloatArray:
        self.residual(log_variances)
        return self._point.jacobian


def _without_zero_weights(point: Point) -> Point:
    """Drop Gaussians of weight 0 and sort the others by variance."""
    order = np.argsort(point.log_variances)
    kept = order[point.weights[order] != 0.0]
    return Point(
        point.log_variances[kept], point.weights[kept], point.residual, point.jacobian[:, kept]
    )
