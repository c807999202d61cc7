"""Objective of the Gaussian fit of one channel, and the search for the variances.

The objective int r (R - sum_i w_i G(v_i, r))^2 dr is evaluated from the energies of the annuli.
With e the energy of an annulus, A its area and E_i the energy of a unit Gaussian in it, it is

    sum over annuli of (e - sum_i w_i E_i)^2 / (2 pi A).

This is the same integral for the means over the annuli; point samples would be wrong where R_d is
curved within an annulus. For given variances the weights are a linear least squares problem; the
remaining function depends on the variances alone and is minimised over their logarithms (variable
projection: Golub and Pereyra 1973; the Jacobian is Kaufman's of 1975, which leaves out a term that
vanishes with the residual).

The search adds one Gaussian at a time. The best sum of N starts from the best of N - 1 with a new
Gaussian in each gap between variances, below the smallest and above the largest. With weight 0 for
the new one each start is as good as the previous optimum, so the error cannot rise with N.
"""

import functools
import math
import threading
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.fit._gaussians_basis import basis_of
from sssfit.fit._target import Target
from sssfit.messages import counted
from sssfit.profile.pixels import PARTS_PER_ANNULUS, SUBDIVIDED_ANNULI, annulus_areas

if TYPE_CHECKING:
    from sssfit._jit.gaussians import Sum

# Signed weights may cancel: two of +-1e8 with nearly equal variances were seen to fit photon noise.
# Their absolute sum may be at most this many times the energy.
_LARGEST_SUM = 10.0
_RANK = 1e-12  # columns closer than this, such as Gaussians of equal variance, count as one


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """Log variances (N,), the best weights for them (N,), and their error.

    ``residual`` (n,) is relative: its norm is the relative error of the literature. ``jacobian``
    (n, N).
    """

    log_variances: FloatArray
    weights: FloatArray
    residual: FloatArray
    jacobian: FloatArray

    @property
    def cost(self) -> float:
        """Square of the relative error."""
        return float(self.residual @ self.residual)


@dataclass(frozen=True, slots=True, eq=False)
class Annuli:
    """The objective for one channel, as a function of the variances' logarithms.

    Energies are shares of the energy on the grid, so that faint profiles do not underflow.

    ``inner``, ``width`` (n, 1) [mm^2] are r0^2 / 2 and (r1^2 - r0^2) / 2 of each annulus; ``scale``
    (n, 1) is sqrt(area) times the target's norm, ``wanted`` (n,) the target, of norm 1; ``total``
    the required sum of the weights, or None if it is free.
    """

    inner: FloatArray
    width: FloatArray
    scale: FloatArray
    wanted: FloatArray
    total: float | None
    signed: bool

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Annuli) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[object, ...]:
        arrays = self.inner, self.width, self.wanted
        return *(each.tobytes() for each in arrays), self.total, self.signed

    def at(self, log_variances: FloatArray) -> Point:
        """Return the best weights for given variances; infinite error if there is no solution."""
        columns, slopes = self._columns(log_variances)
        weights = np.zeros(len(log_variances))
        try:
            free = self._positive_weights(columns)
        except RuntimeError:  # columns equal to rounding can make the solver cycle
            return self._infeasible_point(log_variances)
        basis, wanted = self._unconstrained(columns[:, free])
        norms = np.linalg.norm(basis, axis=0)
        norms[norms == 0.0] = 1.0  # two of equal variance, one eliminated by the total
        q, r = np.linalg.qr(basis / norms)
        found = np.linalg.lstsq(r, q.T @ wanted, rcond=_RANK)[0] / norms
        if self.total is not None:
            found = np.append(found, self.total - found.sum())
        if np.abs(found).sum() > _LARGEST_SUM * max(1.0, self.total or 0.0):
            return self._infeasible_point(log_variances)
        weights[free] = found
        jacobian = -slopes * weights
        jacobian -= q @ (q.T @ jacobian)
        return Point(log_variances, weights, self.wanted - columns @ weights, jacobian)

    def _infeasible_point(self, log_variances: FloatArray) -> Point:
        """Return a point of infinite error."""
        nothing = np.zeros((len(self.wanted), len(log_variances)))
        return Point(log_variances, nothing[0], np.full(self.wanted.shape, np.inf), nothing)

    def _columns(self, log_variances: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return scaled energies of unit Gaussians in the annuli (n, N), and their log derivatives.

        exp(-a) - exp(-b) is computed as exp(-a) (1 - exp(a - b)), which keeps its digits in thin
        annuli.
        """
        inverse = np.exp(-log_variances)
        a, step = self.inner * inverse, self.width * inverse
        at_inner = np.exp(-a)
        energy = -at_inner * np.expm1(-step)
        slope = a * energy - step * (at_inner - energy)
        return energy / self.scale, slope / self.scale

    def _positive_weights(self, columns: FloatArray) -> npt.NDArray[np.intp]:
        """Return the indices of the weights that are not 0 at the optimum."""
        from scipy.optimize import nnls  # 0.8 s that ``fit --list`` does not need

        terms = columns.shape[1]
        if self.signed:
            return np.arange(terms)
        if self.total is None:
            r = _triangle(np.column_stack((columns, self.wanted)))
            return np.flatnonzero(nnls(r[:, :terms], r[:, terms])[0] > 0.0)
        # Weights on a simplex: with sum w = T, columns w - wanted = sum_i w_i/T (T column_i -
        # wanted). The non-negative u that minimises |sum_i u_i (...)|^2 + (1 - sum u)^2 is a
        # multiple of the best w, because for a fixed direction of u the minimum grows with the
        # first term.
        r = _triangle(self.total * columns - self.wanted[:, None])
        rows = np.vstack((r, np.ones(terms)))
        aim = np.append(np.zeros(len(r)), 1.0)
        return np.flatnonzero(nnls(rows, aim)[0] > 0.0)

    def _unconstrained(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return columns and target of the problem with the last weight eliminated by the total."""
        if self.total is None:
            return columns, self.wanted
        last = columns[:, -1]
        return columns[:, :-1] - last[:, None], self.wanted - self.total * last


@dataclass(frozen=True, slots=True)
class SharedAnnuli:
    """The objectives of several channels, added up, where all have the same variances."""

    parts: tuple[Annuli, ...]

    def at(self, log_variances: FloatArray) -> Point:
        """Return the point of all residuals, with each Gaussian's largest weight."""
        points = [each.at(log_variances) for each in self.parts]
        return Point(
            log_variances,
            np.max([each.weights for each in points], axis=0),
            np.concatenate([each.residual for each in points]),
            np.concatenate([each.jacobian for each in points]),
        )

    def weights(self, log_variances: FloatArray) -> FloatArray:
        """Return the best weights for given variances (N, C)."""
        return np.stack([each.at(log_variances).weights for each in self.parts], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class Coordinates:
    """The same objective as `Annuli` in few coordinates and compiled, within bounds."""

    objective: "Sum"

    @classmethod
    def of(cls, annuli: Annuli, bounds: tuple[float, float]) -> "Coordinates":
        """Return the objective of annuli, for log variances within bounds."""
        from sssfit._jit.gaussians import Sum  # numba: 0.4 s that ``fit --list`` does not need

        basis = basis_of(annuli.inner, annuli.width, bounds)
        scale = float(annuli.scale[0, 0]) / math.sqrt(2.0 * math.pi * float(annuli.width[0, 0]))
        total = math.nan if annuli.total is None else float(annuli.total)
        wanted = basis.split(annuli.wanted)
        return cls(Sum(basis.series, *bounds, scale, wanted, total, annuli.signed))

    def at(self, log_variances: FloatArray) -> Point:
        """Return the best weights for given variances; infinite error if there is no solution."""
        from sssfit._jit.gaussians import best_weights

        shape = len(self.objective.wanted), len(log_variances)
        weights, residual, jacobian = np.zeros(shape[1]), np.empty(shape[0]), np.zeros(shape)
        if not best_weights(self.objective, log_variances, weights, residual, jacobian):
            residual = np.full(shape[0], np.inf)
        return Point(log_variances, weights, residual, jacobian)

    def descend(self, log_variances: FloatArray, tolerance: float) -> tuple[Point, bool, int]:
        """Return the point where a descent ends, if it converged, and evaluations."""
        from sssfit._jit.gaussians import descend

        end, settled, count = descend(self.objective, log_variances, tolerance, _MAX_EVALUATIONS)
        return self.at(np.asarray(end, dtype=np.float64)), settled, count


Objective: TypeAlias = Annuli | SharedAnnuli
Searchable: TypeAlias = Coordinates | SharedAnnuli


def _triangle(matrix: FloatArray) -> FloatArray:
    """Return R of the QR decomposition: a small matrix with the same inner products."""
    return np.asarray(np.linalg.qr(matrix, mode="r"), dtype=np.float64)


def make_annuli(
    r_edges_mm: FloatArray, energy: FloatArray, total: float | None, *, signed: bool
) -> Annuli:
    """Set up the objective for the energies (n,) of a channel, at least one of them above 0.

    ``total`` is the required sum of the weights as a share of the energy on the grid, or None.
    """
    inner, outer = r_edges_mm[:-1], r_edges_mm[1:]
    width = 0.5 * (outer - inner) * (outer + inner)
    root = np.sqrt(2.0 * math.pi * width)
    wanted = energy / energy.sum() / root
    norm = float(np.linalg.norm(wanted))
    return Annuli(
        inner=0.5 * inner[:, None] ** 2,
        width=width[:, None],
        scale=root[:, None] * norm,
        wanted=wanted / norm,
        total=total,
        signed=signed,
    )


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
    own = Coordinates.of(annuli, bounds)
    return _descend(own, own.at(log_variances), bounds, _FINE)[0]


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
        self._annuli: Searchable
        self._annuli = Coordinates.of(annuli, bounds) if isinstance(annuli, Annuli) else annuli
        self._bounds = bounds
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
        found, settled, count = _best_of(self._annuli, starts, self._bounds)
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
    annuli: Searchable, starts: list[FloatArray], bounds: tuple[float, float]
) -> tuple[Point, bool, int]:
    """Try all starts roughly, finish the best; return that point, if it converged, evaluations."""
    tried = [_descend(annuli, annuli.at(start), bounds, _ROUGH) for start in starts]
    tried.sort(key=lambda each: each[0].cost)
    finished = [_descend(annuli, each[0], bounds, _FINE) for each in tried[:_FINISHED]]
    count = len(starts) + sum(each[2] for each in [*tried, *finished])
    best = min(finished, key=lambda each: each[0].cost)
    return best[0], best[1], count


def _descend(
    annuli: Searchable, point: Point, bounds: tuple[float, float], tolerance: float
) -> tuple[Point, bool, int]:
    """Run least squares from a point; return the last point, if it converged, evaluations."""
    from scipy.optimize import least_squares  # 0.8 s that ``fit --list`` does not need

    if not np.isfinite(point.cost):
        return point, True, 0
    if isinstance(annuli, Coordinates):
        return annuli.descend(point.log_variances, tolerance)
    seen = _LastPoint(annuli, point)
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
    return annuli.at(found.x), bool(found.status > 0), int(found.nfev)


class _LastPoint:
    """Keeps the last point, whose weights serve the residual and the Jacobian."""

    def __init__(self, annuli: SharedAnnuli, point: Point) -> None:
        self._annuli, self._point = annuli, point

    def residual(self, log_variances: FloatArray) -> FloatArray:
        if not np.array_equal(log_variances, self._point.log_variances):
            self._point = self._annuli.at(log_variances)
        return self._point.residual

    def jacobian(self, log_variances: FloatArray) -> FloatArray:
        self.residual(log_variances)
        return self._point.jacobian


def _without_zero_weights(point: Point) -> tuple[FloatArray, FloatArray]:
    """Return log variances, ascending, and weights, without the Gaussians of weight 0."""
    order = np.argsort(point.log_variances)
    kept = order[point.weights[order] != 0.0]
    return point.log_variances[kept], point.weights[kept]
