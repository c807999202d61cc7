"""Adaptive sampling over time: samples go where the last frames' residuals varied.

For every pixel the renderer keeps the moving variance of Res = f - alpha G, with f the brightest
channel of a frame's estimate and G the irradiance around the pixel, which takes no samples; the
coefficient alpha is Cov(f, G) / Var(G) of the moving covariance matrix. So light that flickers does
not look like noise, and asks for no samples. With alpha = 0 it is the same renderer without control
variates. Xie and Olano 2021, "Supplementary: Real-time Subsurface Control Variates", sections 3, 4.

The next frame's samples depend on frames before it only, and on G, so every frame is unbiased.
"""

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.errors import RenderError
from sssfit.motion.local_light import brightest_channel, half_width, local_irradiance
from sssfit.motion.moving import MovingCovariance
from sssfit.motion.reproject import Shift, reprojected
from sssfit.motion.residual import MovingResidual
from sssfit.motion.variate import coefficient
from sssfit.profile import Profile
from sssfit.render.adaptive import CountArray, make_sampler, render_samples, samples_for
from sssfit.scene.record import Scene

BLEND_COVARIANCE, BLEND_RESIDUAL = 0.05, 0.2  # as in the supplement, section 3.1
TARGET_VARIANCE = 2e-3
_START = 8  # samples of a pixel without history: in the middle of 1 to 64
_UNCERTAIN = 4  # frames of a history that cannot be trusted: a variance of two is 0 or too large
# Light counts as still where the root of its moving variance is below this share of its mean: noise
# over so little would be a coefficient of hundreds, and over rounding, as a picture moves, one of
# 4e14, which an edge that came near turned into 64 samples.
_STILL = 1e-3
# Variances are averaged over 5 x 5 pixels. In dim light few samples meet a lit pixel: alone, a
# pixel found no variance for many frames, then too much. An edge in still light took 23.3 samples
# a pixel for the error of 13.8 fixed ones; with 3 x 3 pixels 23.1 for that of 23.6, with 5 x 5
# 23.1 for that of 24.8, and with 9 x 9 23.0 for that of 25.4.
_AROUND = 5


class AdaptiveRenderer:
    """Renders a sequence of frames, each pixel with the samples that its history asks for.

    Parameters
    ----------
    profile : Profile
        Its kernel is sampled.
    mm_per_pixel : float [mm]
        Pixel size of all frames.
    target_variance : float
        Variance that every pixel of a frame should have, above 0, of the channel that is brightest
        in the first frame; in squared units of radiant exitance.
    has_variates : bool
        Whether control variates take the changes of light out of the variance.
    looks_ahead : bool
        With variates: whether the variance is that expected at the coming frame's G, which is known
        before it is sampled (`MovingResidual.variance_at`). The supplement does not do this.
    seed : int
        Random numbers are a function of it, of frame, pixel and sample.
    border : str
        One of ``sssfit.render.borders.BORDERS``.
    threads : int, optional
        By default all cores; pictures do not depend on them.
    blend_covariance, blend_residual : float
        Rates of the covariance matrix and of the residual's variance.

    Attributes
    ----------
    counts : array (H, W) of int
        Samples of the last frame.
    frame : int
        Number of the next frame, from 0.

    Raises
    ------
    ArgumentError, RenderError
        A setting is out of range, or frames differ in size.
    """

    def __init__(
        self,
        profile: Profile,
        mm_per_pixel: float,
        *,
        target_variance: float = TARGET_VARIANCE,
        has_variates: bool = True,
        looks_ahead: bool = False,
        seed: int = 1,
        border: str = "mirror",
        threads: int | None = None,
        blend_covariance: float = BLEND_COVARIANCE,
        blend_residual: float = BLEND_RESIDUAL,
    ) -> None:
        samples_for(0.0, target_variance, _START)  # raises for a target out of range
        self._sampler = make_sampler(profile, mm_per_pixel)
        self._target_variance = target_variance
        self._has_variates, self._looks_ahead = has_variates, has_variates and looks_ahead
        self._seed, self._border, self._threads = seed, border, threads
        self._matrix = MovingCovariance(blend_covariance)
        self._residual = MovingResidual(blend_residual)
        self._channel = 0
        self.frame = 0
        self.counts: CountArray = np.array(_START, dtype=np.int32)

    @property
    def alpha(self) -> FloatArray:
        """Coefficient for the next frame (H, W); 0 under still light, or without variates."""
        matrix = self._matrix.covariance
        if not matrix.ndim:
            return np.zeros(self.counts.shape)
        mean, variance = self._matrix.mean[1], matrix[1, 1]
        is_moving = variance > (_STILL * mean) ** 2
        return np.where(is_moving, coefficient(matrix[0, 1], variance), 0.0)

    @property
    def variance(self) -> FloatArray:
        """Moving variance of one sample's residual (H, W); NaN without history."""
        return self._residual.variance

    def render(
        self, scene: Scene, *, shift: Shift = (0, 0), scale: npt.ArrayLike = 1.0
    ) -> FloatArray:
        """Render the next frame.

        Parameters
        ----------
        scene : Scene
            The frame's irradiance.
        shift : (int, int) [pixels]
            By how much the picture has moved down and right since the frame before; pixels that
            came into it begin again.
        scale : float or array (H, W)
            Factor of each pixel's radii, as `render_samples`; G stays that of the profile itself.

        Returns
        -------
        array (H, W, C)
            Radiant exitance: an unbiased estimate from this frame's samples alone.
        """
        self._follow(scene, shift)
        variate = self._variate(scene)
        self.counts = self._decided(variate)
        picture = render_samples(
            scene,
            self._sampler,
            self.counts,
            scale=scale,
            frame=self.frame,
            seed=self._seed,
            border=self._border,
            threads=self._threads,
        )
        shown = picture[..., self._channel]
        self._residual.update(shown, variate, self.alpha, self.counts)
        if self._has_variates:
            self._matrix.update(shown, variate)
        self.frame += 1
        return picture

    def _follow(self, scene: Scene, shift: Shift) -> None:
        """Begin with the first frame, and let the histories move with later ones."""
        shape = (scene.height, scene.width)
        if not self.frame:
            self._channel = brightest_channel(scene, self._sampler.profile)
            self.counts = np.full(shape, _START, dtype=np.int32)
        elif self.counts.shape != shape:
            raise RenderError(
                f"a frame of {shape} pixels after frames of {self.counts.shape}; expected the same "
                "size."
            )
        self._matrix.move(shift)
        self._residual.move(shift)
        self.counts = reprojected(self.counts, shift, _START)

    def _variate(self, scene: Scene) -> FloatArray:
        half = half_width(self._sampler.profile, self._channel, scene.mm_per_pixel)
        return local_irradiance(scene, self._channel, half, self._border)

    def _decided(self, variate: FloatArray) -> CountArray:
        """Return the samples that the histories ask for; unchanged where they are too short."""
        if not self.frame:
            return self.counts
        past = self._residual
        variance = past.variance_at(variate) if self._looks_ahead else past.variance
        certain = np.where(past.frames > _UNCERTAIN, variance, np.nan)
        return samples_for(averaged_around(certain), self._target_variance, self.counts)


def averaged_around(values: FloatArray) -> FloatArray:
    """Return means (H, W) over 5 x 5 pixels of those that are not NaN; NaN stays NaN."""
    from scipy.ndimage import uniform_filter  # 0.1 s

    is_known = np.isfinite(values)
    share = uniform_filter(is_known.astype(np.float64), _AROUND, mode="nearest")
    total = uniform_filter(np.where(is_known, values, 0.0), _AROUND, mode="nearest")
    mean: FloatArray = np.divide(total, share, out=np.full(values.shape, np.nan), where=is_known)
    return np.maximum(mean, 0.0)  # running sums leave -1e-17
