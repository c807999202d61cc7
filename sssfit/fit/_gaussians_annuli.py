"""A sum of Gaussians against the annuli of one channel: weights inside, variances outside.

The objective int r (R - sum_i w_i G(v_i, r))^2 dr is read annulus by annulus, energies against
energies: with e the energy of an annulus, A its area and E_i the energy a Gaussian has in it,

    sum over annuli of (e - sum_i w_i E_i)^2 / (2 pi A).

It is the same integral for the means over the annuli: point samples would be off where R_d bends
within an annulus. For given variances the weights are a linear least squares problem; what is left
is a function of the variances alone, searched in their logarithms (variable projection: Golub and
Pereyra 1973; the Jacobian is Kaufman's of 1975, which leaves out a term that vanishes with the
residual).

Next: ``_gaussians_search.py`` looks for the variances.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray

# Signed weights may cancel: two of +-1e8 on variances that hardly differ were seen to fit the noise
# of photons. Their absolute sum may be this many times the energy.
_LARGEST_SUM = 10.0
_RANK = 1e-12  # columns closer than this, as Gaussians of one variance are, count as one


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """Log variances (N,), the best weights for them (N,), and how well they do.

    ``residual`` (n,) is relative: its norm is the error of the literature. ``jacobian`` (n, N).
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

    Energies are shares of the energy on the grid, so that no profile is too faint.

    ``inner``, ``width`` (n, 1) [mm^2] are r0^2 / 2 and (r1^2 - r0^2) / 2 of each annulus; ``scale``
    (n, 1) is sqrt(area) times the target's norm, ``wanted`` (n,) the target, of norm 1; ``total``
    what the weights have to add up to, None for anything.
    """

    inner: FloatArray
    width: FloatArray
    scale: FloatArray
    wanted: FloatArray
    total: float | None
    signed: bool

    def at(self, log_variances: FloatArray) -> Point:
        """Find the best weights for given variances; infinite error where there is no solution."""
        columns, slopes = self._columns(log_variances)
        weights = np.zeros(len(log_variances))
        try:
            free = self._free(columns)
        except RuntimeError:  # columns alike to rounding can send the solver round in circles
            return self._infeasible_point(log_variances)
        basis, wanted = self._unconstrained(columns[:, free])
        norms = np.linalg.norm(basis, axis=0)
        norms[norms == 0.0] = 1.0  # two of one variance, one put in by the total
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
        """Scaled energies of unit Gaussians in the annuli (n, N); derivatives by log variance.

        exp(-a) - exp(-b) as exp(-a) (1 - exp(a - b)), which keeps its digits in thin annuli.
        """
        inverse = np.exp(-log_variances)
        a, step = self.inner * inverse, self.width * inverse
        at_inner = np.exp(-a)
        energy = -at_inner * np.expm1(-step)
        slope = a * energy - step * (at_inner - energy)
        return energy / self.scale, slope / self.scale

    def _free(self, columns: FloatArray) -> npt.NDArray[np.intp]:
        """Return which weights are not 0 at the optimum."""
        from scipy.optimize import nnls  # 0.8 s that ``fit --list`` need not wait for

        terms = columns.shape[1]
        if self.signed:
            return np.arange(terms)
        if self.total is None:
            r = _triangle(np.column_stack((columns, self.wanted)))
            return np.flatnonzero(nnls(r[:, :terms], r[:, terms])[0] > 0.0)
        # Weights on a simplex: with sum w = T, columns w - wanted = sum_i w_i/T (T column_i -
        # wanted). The non-negative u that minimises |that with u|^2 + (1 - sum u)^2 is a multiple
        # of the best w, because for w fixed in direction both terms grow with the former.
        r = _triangle(self.total * columns - self.wanted[:, None])
        rows = np.vstack((r, np.ones(terms)))
        aim = np.append(np.zeros(len(r)), 1.0)
        return np.flatnonzero(nnls(rows, aim)[0] > 0.0)

    def _unconstrained(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return columns and target of the problem with the last weight put in by the total."""
        if self.total is None:
            return columns, self.wanted
        last = columns[:, -1]
        return columns[:, :-1] - last[:, None], self.wanted - self.total * last


def _triangle(matrix: FloatArray) -> FloatArray:
    """R of the QR decomposition: a small matrix of the same inner products."""
    return np.asarray(np.linalg.qr(matrix, mode="r"), dtype=np.float64)


def make_annuli(
    r_edges_mm: FloatArray, energy: FloatArray, total: float | None, *, signed: bool
) -> Annuli:
    """Set up the objective for the energies (n,) of a channel, of which some is above 0.

    ``total`` is the sum the weights have to have, as a share of the energy on the grid, or None.
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
