"""Search for the variances of a sum of Gaussians.

The objective (``_gaussians_objective.py``) is minimised over the logarithms of the variances. The
search adds one Gaussian at a time. The best sum of N starts from the best of N - 1 with a new
Gaussian in each gap between variances, below the smallest and above the largest. With weight 0 for
the new one each start is as good as the previous optimum, so the error cannot rise with N.
"""

import functools
import math
import threading
from dataclasses import dataclass, replace

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit._gaussians_objective import Annuli, Objective, Point, Searched
from sssfit.fit._target import Target
from sssfit.messages import counted
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


def fitted_annuli(target: Target, channel: int) -> tuple[FloatArray, FloatArray]:
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
_MIN_STEP = 1e-9  # shorter ones are rounding
_MAX_EVALUATIONS = 300  # from one start; 5 to 40 are usual
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


def search(annuli: Objective, terms: int, least_mm2: float, most_mm2: float) -> GaussianSum:
    """Find up to ``terms`` Gaussians with variances between two limits [mm^2].

    Fewer if one more does not lower the error.
    """
    bounds = float(np.log(least_mm2)), float(np.log(most_mm2))
    step = _chain(annuli, bounds).step(terms)
    return GaussianSum(
        np.exp(step.log_variances),
        step.weights,
        step.cost**0.5,
        step.evaluations,
        step.stop_reason(terms),
    )


def local_minimum(annuli: Annuli, log_variances: FloatArray, bounds: tuple[float, float]) -> Point:
    """Descend from given log variances alone, within bounds, as one start of the search does."""
    few = annuli.within(bounds)
    return _descend(few, few.at(log_variances), bounds, _FINE)[0]


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """The best sum after adding one Gaussian; ``evaluations`` are those of all steps so far.

    Unlike a `Point` it has no residual and no Jacobian, which would take 1 MB a channel.
    """

    log_variances: FloatArray
    weights: FloatArray
    cost: float
    evaluations: int
    settled: bool
    is_enough: bool = False  # adding this Gaussian did not lower the error, and it was left out

    @property
    def is_last(self) -> bool:
        return self.is_enough or self.cost <= _MET

    def stop_reason(self, terms: int) -> str:
        kept, is_one = f"{len(self.weights)} of {counted(terms, 'term')}", len(self.weights) == 1
        if self.is_enough:
            return f"{kept} {'is' if is_one else 'are'} enough: one more does not lower the error"
        if self.cost <= _MET:
            return f"{kept} {'meets' if is_one else 'meet'} the profile to rounding"
        reason = "converged" if self.settled else f"stopped after {_MAX_EVALUATIONS} evaluations"
        if len(self.weights) == terms:
            return reason
        return f"{reason}; {kept} {'has' if is_one else 'have'} a weight"


class _Chain:
    """The best sums of 1, 2, 3 ... Gaussians of one channel, each searched from the one before."""

    def __init__(self, annuli: Objective, bounds: tuple[float, float]) -> None:
        self._objective, self._bounds = annuli.within(bounds), bounds
        self._steps: list[_Step] = []
        self._lock = threading.Lock()

    def step(self, terms: int) -> _Step:
        """Return the step of so many Gaussians, or the last one if it comes sooner."""
        with self._lock:
            while len(self._steps) < terms and not (self._steps and self._steps[-1].is_last):
                self._steps.append(self._next(self._steps[-1] if self._steps else None))
            return self._steps[min(terms, len(self._steps)) - 1]

    def _next(self, before: _Step | None) -> _Step:
        starts = _starts(None if before is None else before.log_variances, self._bounds)
        found, settled, count = _best_of(self._objective, starts, self._bounds)
        if before is not None:
            count += before.evaluations
            if not found.cost < before.cost:
                return replace(before, evaluations=count, is_enough=True)
        return _Step(*_without_zero_weights(found), found.cost, count, settled)


# The sums depend neither on the support nor, mostly, on the pixels: a comparison or a choice asks
# for 1 to 10 Gaussians of the same channels on up to seven supports and four views.
@functools.lru_cache(maxsize=48)
def _chain(annuli: Objective, bounds: tuple[float, float]) -> _Chain:
    return _Chain(annuli, bounds)


def forget_searches() -> None:
    """Forget the sums that were found, so that a benchmark measures the search."""
    _chain.cache_clear()


def _starts(log_variances: FloatArray | None, bounds: tuple[float, float]) -> list[FloatArray]:
    """Return where to start from: ascending log variances with a new one in each gap."""
    if log_variances is None:
        return [np.array([each]) for each in np.linspace(*bounds, _SINGLE_STARTS + 2)[1:-1]]
    inside = 0.5 * (log_variances[1:] + log_variances[:-1])
    new = np.clip([log_variances[0] - 2.0, *inside, log_variances[-1] + 1.5], *bounds)
    return [np.append(log_variances, each) for each in new]


def _best_of(
    objective: Searched, starts: list[FloatArray], bounds: tuple[float, float]
) -> tuple[Point, bool, int]:
    """Try all starts roughly, finish the best; return that point, if it converged, evaluations."""
    tried = [_descend(objective, objective.at(start), bounds, _ROUGH) for start in starts]
    tried.sort(key=lambda each: each[0].cost)
    finished = [_descend(objective, each[0], bounds, _FINE) for each in tried[:_FINISHED]]
    count = len(starts) + sum(each[2] for each in [*tried, *finished])
    best = min(finished, key=lambda each: each[0].cost)
    return best[0], best[1], count


def _descend(
    objective: Searched, point: Point, bounds: tuple[float, float], tolerance: float
) -> tuple[Point, bool, int]:
    """Run least squares from a point; return the last point, if it converged, evaluations."""
    from scipy.optimize import least_squares  # 0.8 s that ``fit --list`` does not need

    if not np.isfinite(point.cost):
        return point, True, 0
    seen = _LastPoint(objective, point)
    found = least_squares(
        seen.residual,
        point.log_variances,
        seen.jacobian,
        bounds,
        x_scale=_STEP_SCALE,
        ftol=tolerance,
        xtol=_MIN_STEP,
        gtol=None,
        max_nfev=_MAX_EVALUATIONS,
    )
    return objective.at(found.x), bool(found.status > 0), int(found.nfev)


class _LastPoint:
    """Keeps the last point, whose weights serve the residual and the Jacobian."""

    def __init__(self, objective: Searched, point: Point) -> None:
        self._objective, self._point = objective, point

    def residual(self, log_variances: FloatArray) -> FloatArray:
        if not np.array_equal(log_variances, self._point.log_variances):
            self._point = self._objective.at(log_variances)
        return self._point.residual

    def jacobian(self, log_variances: FloatArray) -> FloatArray:
        self.residual(log_variances)
        return self._point.jacobian


def _without_zero_weights(point: Point) -> tuple[FloatArray, FloatArray]:
    """Return log variances, ascending, and weights, without the Gaussians of weight 0."""
    order = np.argsort(point.log_variances)
    kept = order[point.weights[order] != 0.0]
    return point.log_variances[kept], point.weights[kept]
