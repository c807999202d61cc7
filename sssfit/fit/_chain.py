"""A chain of stages by its parameters: what ``_chain_pairs`` and ``_chain_stars`` share.

A stage of pairs has the spectrum b(wx) b(wy), a star that of nine fetches; with the frequencies w
of the full picture, of which a stage on a picture halved v times sees 2^v w,

    b(w) = v_0 + sum_i v_i beta(o_i, w),    v_0 + 2 sum_i v_i = 1,
    b(wx, wy) = v_0 + v_1 beta(o, wx) beta(o, wy) + v_2 (beta(o', wx) + beta(o', wy)),
                v_0 + 4 v_1 + 4 v_2 = 1,
    beta(o, w) = 2 ((1 - f) cos(w i) + f cos(w (i + 1))),   i = floor(o), f = o - i,
    K^ = sum_l m_l u_l,   u_l = up_l prod_{j <= l} down_j b_j(2^v w),

with a halving's down(w) = cos(2^v w / 2) along either axis, for the mean of two texels, and on the
way back its up(w) = 3/4 cos(2^v w / 2) + 1/4 cos(3 2^v w / 2) for the bilinear fetch. All of it is
averaged over positions against the grid; what is left out is aliasing.

Everything is positive, and energy exact: v = exp(.) normalised, m = energy softmax(.).
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.fit._spectrum import SpectralTarget
from sssfit.kernel.structure import Shape

_BARRIER = 0.01  # a squared misfit; an offset 1 % beyond the kernel adds 1e-6
_STAR = "star"
_FAR = 20.0  # a logarithm; a line search may try 1e4, whose exponential is not finite
_ROUNDING = 1e-9  # of a stage's reach, by which two sums of its steps may differ
_LEAST_TEXELS = 1e-9  # between fetches of a table: a stage that a fit has no need of shrinks to 0


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """What a parameter vector stands for: offsets in texels and weights by stage, the blend."""

    offsets: list[FloatArray]
    weights: list[FloatArray]
    blend: FloatArray


class Searched(Protocol):
    """What a search needs to know: a function of parameters, and which of them are offset steps."""

    @property
    def step_parameters(self) -> npt.NDArray[np.intp]:
        """Indices of those to which the search gives random changes."""

    def start(self, rng: np.random.Generator) -> FloatArray:
        """Return random parameters."""

    def value_and_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the function and its gradient."""

    def hessian(self, x: FloatArray) -> FloatArray:
        """Return its second derivatives, or an approximation that is not negative."""


class Chain(ABC):
    """The misfit of a chain of stages to a spectrum, by parameters.

    The parameters are the blend's logits (L+1, C), then for each stage the logarithms of its offset
    steps (k,), shared by the channels, and of its weights (C, k+1). The two offsets of a star stand
    in place of steps.

    Parameters
    ----------
    target : SpectralTarget
    shapes : sequence of Shape
    aliasing : float
        Weight in the misfit of the squared images that halved pictures show; see ``_chain_pairs``.
    """

    def __init__(
        self, target: SpectralTarget, shapes: Sequence[Shape], aliasing: float = 0.0
    ) -> None:
        self.target, self.shapes, self.aliasing = target, tuple(shapes), aliasing
        self.channels = len(target.energy)
        self._down, self._up = resampling(target.frequencies, [each.level for each in shapes])
        self.counts = [2 if each.kind == _STAR else each.pairs for each in shapes]
        count = np.array(self.counts)
        first = self.channels * (len(shapes) + 1)
        own = np.cumsum(count + self.channels * (count + 1))
        self._at = first + np.concatenate(([0], own))
        self.size = int(self._at[-1])
        steps = [np.arange(self._steps(k).start, self._steps(k).stop) for k in range(len(shapes))]
        self.step_parameters = np.concatenate(steps)  # which parameters are offset steps
        self._first_steps = np.cumsum(count) - count  # of each stage, among these
        half = (1.0 - _ROUNDING) * target.half_pixels
        self._reach = half / 2.0 ** np.array([each.level for each in shapes])
        self.parameters = [self._parameters_of(c) for c in range(self.channels)]

    @abstractmethod
    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""

    @abstractmethod
    def misfit(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum over channels of the squared relative misfit, and its gradient."""

    @abstractmethod
    def matrix(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of the misfit's second derivatives, (size, size)."""

    def value_and_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the misfit, and what offsets beyond the kernel add to it, with the gradient."""
        value, gradient = self.misfit(x)
        for k in self._far_stages(x):
            beyond, slopes = self._beyond(x, k)
            value += _BARRIER * beyond**2
            gradient[self._steps(k)] += 2.0 * _BARRIER * beyond * slopes
        return value, gradient

    def hessian(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of the second derivatives of both, (size, size)."""
        found = self.matrix(x)
        for k in self._far_stages(x):
            beyond, slopes = self._beyond(x, k)
            if beyond > 0.0:
                found[self._steps(k), self._steps(k)] += 2.0 * _BARRIER * np.outer(slopes, slopes)
        return found

    def start(self, rng: np.random.Generator) -> FloatArray:
        """Return random parameters: offsets that grow by a random factor from stage to stage."""
        reach, growth = rng.uniform(0.7, 2.0), rng.uniform(1.5, 2.6)
        parts = [rng.normal(0.0, 0.3, self.channels * (len(self.shapes) + 1))]
        for each in self.shapes:
            texels = max(reach / 2.0**each.level, 0.5)
            if each.kind == _STAR:
                offsets = np.array([1.0, 1.6]) * rng.uniform(0.8, 1.25, 2)
                parts += [np.log(texels * offsets), np.tile([0.0, -0.5, -0.7], self.channels)]
                reach *= growth * 1.6**0.5
                continue
            k = np.arange(1, each.pairs + 1)
            offsets = np.maximum.accumulate(k * rng.uniform(0.8, 1.25, k.size)) + 1e-3 * k
            bell = -0.5 * (np.concatenate(([0.0], offsets)) / (0.6 * each.pairs)) ** 2
            steps = np.log(texels * np.diff(offsets, prepend=0.0))
            parts += [steps, np.tile(bell, self.channels)]
            reach *= growth * max(1.0, each.pairs**0.5)
        return np.concatenate(parts)

    def numbers(self, x: FloatArray) -> Numbers:
        """Return what parameters stand for."""
        parts = [self._stage(x, k) for k in range(len(self.shapes))]
        kinds = [each.kind for each in self.shapes]
        return Numbers(
            [
                texels if kind == _STAR else np.cumsum(texels)
                for kind, (steps, _) in zip(kinds, parts, strict=True)
                for texels in [np.maximum(texels_of(steps), _LEAST_TEXELS)]
            ],
            [normalised(logits, kind)[0].T for kind, (_, logits) in zip(kinds, parts, strict=True)],
            self._blend(x),
        )

    def start_from(self, numbers: Numbers) -> FloatArray:
        """Return parameters that stand for such numbers; those that are 0 become very small."""
        x = np.empty(self.size)
        shares = numbers.blend / numbers.blend.sum(axis=0)
        x[: shares.size] = _logarithms(shares).ravel()
        for k, shape in enumerate(self.shapes):
            offsets, (steps, weights) = numbers.offsets[k], self.places(k)
            x[steps] = _logarithms(
                offsets if shape.kind == _STAR else np.diff(offsets, prepend=0.0)
            )
            x[weights] = _logarithms(numbers.weights[k].T)
        return x

    def places(self, k: int) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Return where a stage's steps (k,) and weights (C, k+1) are among the parameters."""
        at = np.arange(self._at[k], self._at[k + 1])
        count = self.counts[k]
        return at[:count], at[count:].reshape(self.channels, count + 1)

    def _images(self) -> Iterator[tuple[int, FloatArray]]:
        """Yield for each level by what images along an axis multiply the chain, (l, n).

        They have nothing of what comes before the level's first stage, whose number is given. There
        is none where aliasing is not weighed in; see ``_chain_pairs``.
        """
        levels = np.array([0, *(each.level for each in self.shapes)])
        for level in range(1, levels[-1] + 1 if self.aliasing > 0.0 else 1):
            first = int(np.searchsorted(levels, level))
            w = self.target.frequencies - 2.0 * np.pi / 2.0**level
            _, image = resampling(w, levels[first:].tolist())
            # Texels of coarser levels lie between those, where the image has the other sign.
            yield first, image * np.sign(level + 0.5 - levels[first:])[:, None]

    def _steps(self, k: int) -> slice:
        """Return where a stage's offset steps are among the parameters."""
        return slice(int(self._at[k]), int(self._at[k]) + self.counts[k])

    def _far_stages(self, x: FloatArray) -> list[int]:
        """Return the stages that may reach beyond the kernel: hardly any, and the rest cost time.

        The two offsets of a star are added up here, which is more than the farther one.
        """
        texels = texels_of(x[self.step_parameters])
        found: list[int] = np.flatnonzero(
            np.add.reduceat(texels, self._first_steps) > self._reach
        ).tolist()
        return found

    def _beyond(self, x: FloatArray, k: int) -> tuple[float, FloatArray]:
        """Return the logarithm by which a stage's last offset exceeds the kernel, and its slopes.

        The graded frequencies cannot tell such an offset from one inside.
        """
        steps = texels_of(x[self._steps(k)])
        if self.shapes[k].kind == _STAR:
            steps = np.where(np.arange(2) == np.argmax(steps), steps, 0.0)
        last = float(steps.sum())
        beyond = math.log(last * 2.0 ** self.shapes[k].level / self.target.half_pixels)
        return max(beyond, 0.0), steps / last

    def _blend(self, x: FloatArray) -> FloatArray:
        logits = x[: self._at[0]].reshape(-1, self.channels)
        shares = np.exp(logits - logits.max(axis=0))
        blend: FloatArray = shares / shares.sum(axis=0) * self.target.energy
        return blend

    def _stage(self, x: FloatArray, k: int) -> tuple[FloatArray, FloatArray]:
        """Return a stage's logarithms: of steps (k,) and of weights (C, k+1)."""
        own, count = x[self._at[k] : self._at[k + 1]], self.counts[k]
        return own[:count], own[count:].reshape(self.channels, count + 1)

    def _parameters_of(self, channel: int) -> npt.NDArray[np.intp]:
        """Return the indices of what a channel depends on: blend, then stage by stage."""
        found = [np.arange(len(self.shapes) + 1) * self.channels + channel]
        for at, count in zip(self._at, self.counts, strict=False):
            weights = at + count + channel * (count + 1)
            found += [at + np.arange(count), weights + np.arange(count + 1)]
        return np.concatenate(found)

    def _put_stage(self, gradient: FloatArray, k: int, own: FloatArray) -> None:
        """Put the slopes (C, parameters) of a stage into the gradient; steps serve all channels."""
        count = self.counts[k]
        gradient[self._at[k] : self._at[k] + count] = own[:, :count].sum(axis=0)
        gradient[self._at[k] + count : self._at[k + 1]] = own[:, count:].ravel()


def _logarithms(values: FloatArray) -> FloatArray:
    logarithms: FloatArray = np.log(np.maximum(values, math.exp(-_FAR)))
    return logarithms


def texels_of(steps: FloatArray) -> FloatArray:
    """Return offset steps, or a star's offsets, in texels from their logarithms."""
    return np.exp(np.clip(steps, -_FAR, _FAR))


def normalised(logits: FloatArray, kind: str = "pair") -> tuple[FloatArray, FloatArray]:
    """Return weights (..., k+1) whose fetches add up to 1, and how many each stands for (k+1,)."""
    weights = np.exp(logits - logits.max(axis=-1, keepdims=True))
    mirrored = 4.0 if kind == _STAR else 2.0
    copies = np.where(np.arange(logits.shape[-1]) == 0, 1.0, mirrored)
    return weights / (weights @ copies)[..., None], copies


def fetches(offsets: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the spectra (..., k, n) of mirrored bilinear fetches (..., k), and slopes by offset.

    The frequencies are (..., n).
    """
    whole = np.floor(offsets)[..., None]
    w = w[..., None, :]
    near, far = np.cos(whole * w), np.cos((whole + 1.0) * w)
    slope = 2.0 * (far - near)
    return 2.0 * near + (offsets[..., None] - whole) * slope, slope


def resampling(w: FloatArray, levels: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Return for each stage the spectrum of the halvings before it, and of the way back up."""
    down, up = np.ones((len(levels), w.size)), np.ones((len(levels), w.size))
    back, level = np.ones(w.size), 0
    for k, own in enumerate(levels):
        while level < own:
            half = 0.5 * 2.0**level * w
            down[k] *= np.cos(half)
            back = back * (0.75 * np.cos(half) + 0.25 * np.cos(3.0 * half))
            level += 1
        up[k] = back
    return down, up
