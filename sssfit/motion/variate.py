"""Control variates under light that changes: coefficients, and the variance of a residual.

T is the intensity of the light over time, F the scattering and G the control variate of a pixel; a
frame shows T F, and the residual is T F - alpha T G. Equations are those of Xie and Olano 2021,
"Supplementary: Real-time Subsurface Control Variates".
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray


def coefficient(covariance: npt.ArrayLike, variance: npt.ArrayLike) -> FloatArray:
    """Return Cov(TF, TG) / Var(TG), the optimum of equations 29 and 31.

    It is 0 where the variance is 0: a constant variate explains nothing.
    """
    above, below = np.asarray(covariance, dtype=np.float64), np.asarray(variance, dtype=np.float64)
    shape = np.broadcast_shapes(above.shape, below.shape)
    found: FloatArray = np.divide(above, below, out=np.zeros(shape), where=below > 0.0)
    return found


def least_squares_coefficient(mean_fg: npt.ArrayLike, mean_gg: npt.ArrayLike) -> FloatArray:
    """Return E(FG) / E(G^2), which minimises E((F - alpha G)^2) (equation 37)."""
    return coefficient(mean_fg, mean_gg)


def in_frame_coefficient(
    covariance: npt.ArrayLike, mean_g: npt.ArrayLike, variance_t: npt.ArrayLike
) -> FloatArray:
    """Return Cov(TF, T) / (E(G) Var(T)), of a variate that is constant in a frame (equation 41).

    Where F does not depend on T, that is E(F) / E(G) (equation 42).
    """
    return coefficient(covariance, np.asarray(mean_g) * np.asarray(variance_t))


def estimator_variance(
    alpha: npt.ArrayLike,
    variance_f: npt.ArrayLike,
    variance_g: npt.ArrayLike,
    covariance: npt.ArrayLike,
) -> FloatArray:
    """Return Var(TF) + alpha^2 Var(TG) - 2 alpha Cov(TF, TG) (equation 30)."""
    a, f, g, both = (
        np.asarray(each, dtype=np.float64) for each in (alpha, variance_f, variance_g, covariance)
    )
    found: FloatArray = f + a * a * g - 2.0 * a * both
    return found


@dataclass(frozen=True, slots=True)
class Split:
    """Parts of Var(T (F - alpha G)), T independent of F and G (equation 33).

    Parameters
    ----------
    stable : float
        E(T)^2 Var(F - alpha G): all that is left under stable light (equation 34).
    crossed : float
        Var(T) Var(F - alpha G).
    temporal : float
        Var(T) E(F - alpha G)^2, which the coefficient of equation 42 removes (equations 43, 44).
    """

    stable: float
    crossed: float
    temporal: float

    @property
    def total(self) -> float:
        """The variance (equation 32)."""
        return self.stable + self.crossed + self.temporal


def variance_split(
    mean_t: float, variance_t: float, mean_residual: float, variance_residual: float
) -> Split:
    """Return the parts of a residual's variance.

    Parameters
    ----------
    mean_t, variance_t : float
        Those of the light's intensity T.
    mean_residual, variance_residual : float
        Those of F - alpha G.
    """
    return Split(
        mean_t**2 * variance_residual,
        variance_t * variance_residual,
        variance_t * mean_residual**2,
    )
