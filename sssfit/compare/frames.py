"""Error and noise of pictures that change from frame to frame, as a filter over time shows them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.measure.score import measure
from sssfit.render.disk import NEWEST, averaged

COUNTS = (1, 8, 16)
_SETTLED = 64  # frames whose mean stands for no noise


@dataclass(frozen=True, slots=True)
class FrameError:
    """What is seen after a number of frames.

    Parameters
    ----------
    frames : int
    error_mean, error_p99 : float
        Delta E 2000 against the truth: mean and 99th percentile over the pixels.
    noise_mean, noise_p99 : float
        The same against the mean of 64 frames: what would flicker, or crawl, without more of them.
    """

    frames: int
    error_mean: float
    error_p99: float
    noise_mean: float
    noise_p99: float


def over_frames(
    picture: Callable[[int], FloatArray],
    truth: FloatArray,
    *,
    mask: npt.ArrayLike | None = None,
    newest: float = NEWEST,
) -> tuple[FrameError, ...]:
    """Return error and noise of one frame, after 8 and after 16 frames.

    Parameters
    ----------
    picture : function
        Takes the number of a frame, from 0, and returns its picture (H, W, C).
    truth : array (H, W, C)
    mask : array (H, W), optional
        Pixels that count, as of `sssfit.measure.score.measure`.
    newest : float
        Share of the newest frame in an exponential average that starts as the mean
        (`sssfit.render.disk.averaged`): by default 1/8.

    Raises
    ------
    RenderError
        The share is out of range.
    """
    frames = [picture(k) for k in range(_SETTLED)]
    settled = np.mean(frames, axis=0)
    found = []
    for count, seen in enumerate(averaged(frames[: max(COUNTS)], newest), 1):
        if count in COUNTS:
            error, noise = (measure(seen, each, mask=mask) for each in (truth, settled))
            found.append(
                FrameError(
                    count,
                    error.delta_e_2000_mean,
                    error.delta_e_2000_p99,
                    noise.delta_e_2000_mean,
                    noise.delta_e_2000_p99,
                )
            )
    return tuple(found)
