"""Objective of the Gaussian fit of one channel: the best weights for given variances.

The objective int r (R - sum_i w_i G(v_i, r))^2 dr is evaluated from the energies of the annuli.
With e the energy of an annulus, A its area and E_i the energy of a unit Gaussian in it, it is

    sum over annuli of (e - sum_i w_i E_i)^2 / (2 pi A).

This is the same integral for the means over the annuli; point samples would be wrong where R_d is
curved within an annulus. For given variances the weights are a linear least squares problem; the
remaining function depends on the variances alone (variable projection: Golub and Pereyra 1973; the
Jacobian is Kaufman's of 1975, which leaves out a term that vanishes with the residual). `Annuli`
has a row for each annulus, `Few` the same sum of squares in some fifty rows, for the search.
"""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.fit._gaussians_basis import Basis, basis_of

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
        return _best_point(self, log_variances, columns, slopes)

    def within(self, bounds: tuple[float, float]) -> "Few":
        """Return the same objective in few rows, for log variances within bounds."""
        basis = basis_of(self.inner, self.width, bounds)
        scale = float(self.scale[0, 0]) / math.sqrt(2.0 * math.pi * float(self.width[0, 0]))
        return Few(basis, scale, basis.split(self.wanted), self.total, self.signed)

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


@dataclass(frozen=True, slots=True, eq=False)
class Few:
    """The same objective as `Annuli` in the coordinates of a basis of all Gaussians.

    ``scale`` is the target's norm, ``wanted`` (K+1,) its coordinates and the norm of what lies
    outside of the basis, divided by it.
    """

    basis: Basis
    scale: float
    wanted: FloatArray
    total: float | None
    signed: bool

    def at(self, log_variances: FloatArray) -> Point:
        """Return the best weights for given variances; infinite error if there is no solution."""
        columns, slopes = self.basis.columns(log_variances) / self.scale
        return _best_point(self, log_variances, columns, slopes)


@dataclass(frozen=True, slots=True)
class Shared:
    """Objectives of several channels, added up, where all have the same variances."""

    parts: tuple[Few, ...]

    def at(self, log_variances: FloatArray) -> Point:
        """Return the point of all residuals, with each Gaussian's largest weight."""
        points = [each.at(log_variances) for each in self.parts]
        return Point(
            log_variances,
            np.max([each.weights for each in points], axis=0),
            np.concatenate([each.residual for each in points]),
            np.concatenate([each.jacobian for each in points]),
        )


@dataclass(frozen=True, slots=True)
class SharedAnnuli:
    """The annuli of several channels whose Gaussians have the same variances."""

    parts: tuple[Annuli, ...]

    def within(self, bounds: tuple[float, float]) -> Shared:
        """Return their objective in few rows, for log variances within bounds."""
        return Shared(tuple(each.within(bounds) for each in self.parts))

    def weights(self, log_variances: FloatArray) -> FloatArray:
        """Return the best weights for given variances (N, C)."""
        return np.stack([each.at(log_variances).weights for each in self.parts], axis=1)


Objective: TypeAlias = Annuli | SharedAnnuli
Searched: TypeAlias = Few | Shared


def _best_point(
    objective: Annuli | Few, log_variances: FloatArray, columns: FloatArray, slopes: FloatArray
) -> Point:
    """Return the best weights for unit Gaussians (n, N) with log derivatives (n, N)."""
    total = objective.total
    try:
        free = _positive_weights(objective, columns)
    except RuntimeError:  # columns equal to rounding can make the solver cycle
        return _infeasible_point(objective, log_variances)
    basis, wanted = _unconstrained(objective, columns[:, free])
    norms = np.linalg.norm(basis, axis=0)
    norms[norms == 0.0] = 1.0  # two of equal variance, one eliminated by the total
    q, r = np.linalg.qr(basis / norms)
    found = np.linalg.lstsq(r, q.T @ wanted, rcond=_RANK)[0] / norms
    if total is not None:
        found = np.append(found, total - found.sum())
    if np.abs(found).sum() > _LARGEST_SUM * max(1.0, total or 0.0):
        return _infeasible_point(objective, log_variances)
    weights = np.zeros(len(log_variances))
    weights[free] = found
    jacobian = -slopes * weights
    jacobian -= q @ (q.T @ jacobian)
    return Point(log_variances, weights, objective.wanted - columns @ weights, jacobian)


def _infeasible_point(objective: Annuli | Few, log_variances: FloatArray) -> Point:
    """Return a point of infinite error."""
    rows = len(objective.wanted)
    nothing = np.zeros((rows, len(log_variances)))
    return Point(log_variances, nothing[0], np.full(rows, np.inf), nothing)


def _positive_weights(objective: Annuli | Few, columns: FloatArray) -> npt.NDArray[np.intp]:
    """Return the indices of the weights that are not 0 at the optimum."""
    from scipy.optimize import nnls  # 0.8 s that ``fit --list`` does not need

    terms, total = columns.shape[1], objective.total
    if objective.signed:
        return np.arange(terms)
    if total is None:
        r = _triangle(np.column_stack((columns, objective.wanted)))
        return np.flatnonzero(nnls(r[:, :terms], r[:, terms])[0] > 0.0)
    # Weights on a simplex: with sum w = T, columns w - wanted = sum_i w_i/T (T column_i -
    # wanted). The non-negative u that minimises |sum_i u_i (...)|^2 + (1 - sum u)^2 is a
    # multiple of the best w, because for a fixed direction of u the minimum grows with the
    # first term.
    r = _triangle(total * columns - objective.wanted[:, None])
    rows = np.vstack((r, np.ones(terms)))
    aim = np.append(np.zeros(len(r)), 1.0)
    return np.flatnonzero(nnls(rows, aim)[0] > 0.0)


def _unconstrained(objective: Annuli | Few, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return columns and target of the problem with the last weight eliminated by the total."""
    if objective.total is None:
        return columns, objective.wanted
    last = columns[:, -1]
    return columns[:, :-1] - last[:, None], objective.wanted - objective.total * last


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
