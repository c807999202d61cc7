"""Moving variance of the residual f - alpha G, for frames of different numbers of samples.

The covariance of two means of n samples is that of one sample over n (equation 27 of the
supplement), so a squared deviation counts n times: every frame measures the variance of one sample.
"""

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.motion.moving import checked_blend, history, known, moved, moved_mean
from sssfit.motion.reproject import Shift, reprojected


class MovingResidual:
    """Moving variance of one sample of Res = f - alpha G (equations 21 and 27).

    The deviation is (f_n - mean f) - alpha (G_n - mean G): that of Res from the mean which the
    *same* coefficient gives. The moving mean of Res itself would mix coefficients, and where G
    hardly changes these are noise times a large number: under light that varies by 1 % a sampler of
    10.7 samples a pixel then asked for 64.

    Parameters
    ----------
    blend : float
        Weight of the newest frame, 0 to 1.

    Attributes
    ----------
    means : array (2, ...)
        Moving means of f and G.
    frames : array (...) of int
        Finite frames of each pixel.

    Raises
    ------
    ArgumentError
        The rate is out of range, or frames differ in shape.
    """

    def __init__(self, blend: float) -> None:
        self.blend = checked_blend(blend)
        self.means: FloatArray = np.array(np.nan)
        self.frames: npt.NDArray[np.intp] = np.array(0)
        self._moving: FloatArray = np.array(0.0)
        self._light: FloatArray = np.array(np.nan)

    @property
    def variance(self) -> FloatArray:
        """Variance of one sample (...), without bias for independent frames.

        Equation 21's estimate over 1 - the sum of squared weights. NaN before a pixel's second
        finite frame, and for blends of 0 and 1, which keep one frame only.
        """
        kept = 1.0 - squared_weights(self.blend, np.maximum(self.frames - 1, 0))
        unknown = np.full(kept.shape, np.nan)
        found: FloatArray = np.divide(self._moving, kept, out=unknown, where=kept > 0.0)
        return found

    def variance_at(self, g: npt.ArrayLike) -> FloatArray:
        """Return the variance of one sample (...) in a frame whose variate will be ``g``.

        The variance is (Var(T) + E(T)^2) Var(F) = E(T^2) Var(F) over the frames (equation 44), and
        T^2 Var(F) in one of them; G is in proportion to T. Where G was 0 it is that of the frames.
        """
        square = np.square(np.asarray(g, dtype=np.float64))
        ratio = np.divide(square, self._light, out=np.ones(square.shape), where=self._light > 0.0)
        found: FloatArray = self.variance * ratio
        return found

    def update(
        self, f: npt.ArrayLike, g: npt.ArrayLike, alpha: npt.ArrayLike, counts: npt.ArrayLike
    ) -> None:
        """Take a frame in.

        Parameters
        ----------
        f, g : array (...)
            Means of the frame's samples, and the variate.
        alpha : array (...)
            Coefficient from the frames before.
        counts : int or array (...)
            Samples of the frame.
        """
        new = known(f, g)
        old = history(self.means, new.shape)
        if not self._moving.ndim:
            self._moving = np.zeros(new.shape[1:])
            self._light = np.full(new.shape[1:], np.nan)
            self.frames = np.zeros(new.shape[1:], dtype=np.intp)
        step = new - old
        square = np.asarray(counts) * (step[0] - alpha * step[1]) ** 2
        self._moving = moved(self._moving, square, self.blend, self.blend * (1.0 - self.blend))
        light = np.where(np.isnan(square), np.nan, new[1] ** 2)
        self._light = moved_mean(self._light, light, self._newest())
        self.means = moved_mean(old, new, self.blend)
        self.frames = self.frames + np.isfinite(new[0])

    def _newest(self) -> FloatArray:
        """Return the newest deviation's share (...) of all that the variance holds.

        b / (1 - (1 - b)^k) for the k-th deviation.
        """
        kept = 1.0 - (1.0 - self.blend) ** np.maximum(self.frames, 1)
        return np.divide(self.blend, kept, out=np.zeros(kept.shape), where=kept > 0.0)

    def move(self, shift: Shift) -> None:
        """Move the history (H, W) with the picture, by whole pixels down and right."""
        self.means = reprojected(self.means, shift, np.nan)
        self.frames = reprojected(self.frames, shift, 0)
        self._moving = reprojected(self._moving, shift, 0.0)
        self._light = reprojected(self._light, shift, np.nan)


def squared_weights(blend: float, updates: npt.ArrayLike) -> FloatArray:
    """Return the sum of the squared weights of the frames 0 to n, n = ``updates`` (equation 18).

    (1 - b)^2n + b^2 (1 - (1 - b)^2n) / (1 - (1 - b)^2).
    """
    first = (1.0 - blend) ** (2.0 * np.asarray(updates, dtype=np.float64))
    later = blend / (2.0 - blend)  # b^2 / (1 - (1 - b)^2)
    found: FloatArray = first + later * (1.0 - first)
    return found
