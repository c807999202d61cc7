"""Exponential moving mean, variance and covariance of whole images, a frame at a time.

Equations are those of Xie and Olano 2021, "Supplementary: Real-time Subsurface Control Variates".
With the rate ``blend``, after the frames 0 to n a frame i has the weight

    w_i = blend (1 - blend)^(n - i) for i from 1,    w_0 = (1 - blend)^n,

and every estimate equals the weighted two-pass formula. A blend of 0 keeps the first frame; a blend
of 1 keeps the newest, and its variance is 0.

Every pixel has its own history. It begins with the pixel's first finite value, where the variance
is 0; a frame in which any variable of a pixel is NaN or infinite leaves that pixel as it was. A
pixel without history has the mean NaN.
"""

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray, number_array
from sssfit.errors import ArgumentError
from sssfit.messages import shown
from sssfit.motion.reproject import Shift, reprojected


def checked_blend(blend: float) -> float:
    """Return a rate from 0 to 1, or raise ArgumentError."""
    is_number = isinstance(blend, int | float | np.number) and not isinstance(blend, bool)
    if not (is_number and 0.0 <= blend <= 1.0):
        raise ArgumentError(f"blend = {shown(blend)}; expected a rate from 0 to 1.")
    return float(blend)


class MovingMean:
    """Moving mean: mu_n = (1 - blend) mu_(n-1) + blend x_n, mu_0 = x_0 (equation 18).

    Parameters
    ----------
    blend : float
        Weight of the newest frame, 0 to 1.

    Attributes
    ----------
    mean : array (...)
        NaN before the first finite value.

    Raises
    ------
    ArgumentError
        The rate is out of range, or frames differ in shape.

    Examples
    --------
    >>> moving = MovingMean(0.25)
    >>> [float(moving.update(x)) for x in (1.0, 3.0, float("nan"))]
    [1.0, 1.5, 1.5]
    """

    def __init__(self, blend: float) -> None:
        self.blend = checked_blend(blend)
        self.mean: FloatArray = np.array(np.nan)

    def update(self, values: npt.ArrayLike) -> FloatArray:
        """Take a frame in, and return the mean after it."""
        new = known(values)[0]
        self.mean = moved_mean(history(self.mean, new.shape), new, self.blend)
        return self.mean

    def move(self, shift: Shift) -> None:
        """Move the history (H, W) with the picture, by whole pixels down and right."""
        self.mean = reprojected(self.mean, shift, np.nan)


class MovingCovariance:
    """Moving covariance matrix (EMCM) of K variables: equation 21, from 0 on.

    Cov_n = (1 - blend) Cov_(n-1) + blend (1 - blend) (x_n - mu_(n-1)) (y_n - nu_(n-1)).

    The EWMA estimator leaves the factor 1 - blend of the new term out (equation 22), so that it is
    larger by 1 / (1 - blend); coefficients, which are ratios, are the same.

    Parameters
    ----------
    blend : float
        Weight of the newest frame, 0 to 1.
    is_ewma : bool
        Whether to estimate by EWMA.

    Attributes
    ----------
    mean : array (K, ...)
    covariance : array (K, K, ...)

    Raises
    ------
    ArgumentError
        The rate is out of range, or frames differ in shape.

    Examples
    --------
    >>> moving = MovingCovariance(0.5)
    >>> for x in (0.0, 2.0):
    ...     moving.update(x, 3.0 * x)
    >>> moving.covariance.tolist()
    [[1.0, 3.0], [3.0, 9.0]]
    """

    def __init__(self, blend: float, *, is_ewma: bool = False) -> None:
        self.blend = checked_blend(blend)
        self.is_ewma = is_ewma
        self.mean: FloatArray = np.array(np.nan)
        self.covariance: FloatArray = np.array(0.0)

    def update(self, *variables: npt.ArrayLike) -> None:
        """Take a frame of every variable in, arrays of the same shape (...)."""
        new = known(*variables)
        old = history(self.mean, new.shape)
        if not self.covariance.ndim:
            self.covariance = np.zeros((len(new), *new.shape))
        step = new - old
        gain = self.blend * (1.0 if self.is_ewma else 1.0 - self.blend)
        for i, k in np.ndindex(len(new), len(new)):
            past = self.covariance[i, k]
            self.covariance[i, k] = moved(past, step[i] * step[k], self.blend, gain)
        self.mean = moved_mean(old, new, self.blend)

    def move(self, shift: Shift) -> None:
        """Move the history (K, H, W) with the picture, by whole pixels down and right."""
        self.mean = reprojected(self.mean, shift, np.nan)
        self.covariance = reprojected(self.covariance, shift, 0.0)


class MovingVariance:
    """Moving variance of a variable: equation 21 with y = x.

    Parameters
    ----------
    blend : float
        Weight of the newest frame, 0 to 1.
    is_ewma : bool
        Whether to estimate by EWMA (equation 22).

    Attributes
    ----------
    mean, variance : array (...)

    Raises
    ------
    ArgumentError
        The rate is out of range, or frames differ in shape.
    """

    def __init__(self, blend: float, *, is_ewma: bool = False) -> None:
        self._matrix = MovingCovariance(blend, is_ewma=is_ewma)

    @property
    def mean(self) -> FloatArray:
        """Moving mean (...)."""
        return self._matrix.mean[0] if self._matrix.mean.ndim else self._matrix.mean

    @property
    def variance(self) -> FloatArray:
        """Moving variance (...)."""
        matrix = self._matrix.covariance
        return matrix[0, 0] if matrix.ndim else matrix

    def update(self, values: npt.ArrayLike) -> FloatArray:
        """Take a frame in, and return the variance after it."""
        self._matrix.update(values)
        return self.variance

    def move(self, shift: Shift) -> None:
        """Move the history (H, W) with the picture, by whole pixels down and right."""
        self._matrix.move(shift)


def batch_covariance(x: npt.ArrayLike, y: npt.ArrayLike) -> FloatArray:
    """Return the covariance of two means of n samples, Cov(X, Y) / n (equation 27).

    Parameters
    ----------
    x, y : array (n, ...)
        Two samples or more, of which only those of the same place depend on each other.

    Raises
    ------
    ArgumentError
        There is one sample or none, or the shapes differ.
    """
    first, second = number_array("x", x, ArgumentError), number_array("y", y, ArgumentError)
    if first.shape != second.shape or not first.ndim or len(first) < 2:
        raise ArgumentError(
            f"samples of shapes {first.shape} and {second.shape}; expected the same two or more."
        )
    n = len(first)
    products = (first - first.mean(axis=0)) * (second - second.mean(axis=0))
    covariance: FloatArray = products.sum(axis=0) / (n * (n - 1))
    return covariance


def known(*variables: npt.ArrayLike) -> FloatArray:
    """Stack variables (K, ...); all are NaN where one is NaN or infinite."""
    frames = [number_array("a frame", each, ArgumentError) for each in variables]
    if len({each.shape for each in frames}) != 1:
        shapes = ", ".join(str(each.shape) for each in frames)
        raise ArgumentError(f"frames of the shapes {shapes or 'none'}; expected the same of each.")
    stacked = np.stack(frames)
    return np.where(np.isfinite(stacked).all(axis=0), stacked, np.nan)


def history(mean: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Return the mean before a frame; NaN of its shape before the first."""
    if mean.shape == shape:
        return mean
    if mean.ndim:
        raise ArgumentError(f"a frame of shape {shape} after frames of {mean.shape}.")
    return np.full(shape, np.nan)


def moved_mean(old: FloatArray, new: FloatArray, blend: float | FloatArray) -> FloatArray:
    """Return the mean after a frame; as a sum of old mean and step, so that a still one stays."""
    moved = np.where(np.isnan(old), new, old + blend * (new - old))
    return np.where(np.isnan(new), old, moved)


def moved(old: FloatArray, product: FloatArray, blend: float, gain: float) -> FloatArray:
    """Return (1 - blend) old + gain product; old where the product is NaN."""
    return np.where(np.isnan(product), old, (1.0 - blend) * old + gain * product)
