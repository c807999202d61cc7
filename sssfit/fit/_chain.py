"""The spectrum of a chain of pairs of passes, with its derivatives.

With the frequencies w of the full picture, of which a stage on a picture halved v times sees 2^v w,

    b_l(w) = v_0 + sum_i v_i beta(o_i, w),   v_0 + 2 sum_i v_i = 1,
    beta(o, w) = 2 ((1 - f) cos(w i) + f cos(w (i + 1))),   i = floor(o), f = o - i,
    K^(wx, wy) = sum_l m_l u_l(wx) u_l(wy),   u_l = up_l(w) prod_{j <= l} down_j(w) b_j(2^v w),

a halving's down(w) = cos(2^v w / 2) for the mean of two texels, and on the way back its up(w) = 3/4
cos(2^v w / 2) + 1/4 cos(3 2^v w / 2) for the bilinear fetch. All of it is averaged over positions
against the grid; what is left out is aliasing.

Everything is positive, and energy exact: v = exp(.) normalised, m = energy softmax(.).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.fit._spectrum import SpectralTarget
from sssfit.kernel.structure import Shape

_BARRIER = 0.01  # a squared misfit; an offset 1 % beyond the kernel adds 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class _Blur:
    """A stage at some parameters: its spectrum (C, n) and derivatives (C, parameters, n)."""

    spectrum: FloatArray
    slopes: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """What a parameter vector stands for: offsets in texels and weights by stage, the blend."""

    offsets: list[FloatArray]
    weights: list[FloatArray]
    blend: FloatArray


class Chain:
    """The misfit of a chain of pairs to a spectrum, by parameters.

    The parameters are the blend's logits (L+1, C), then for each stage the logarithms of its offset
    steps (k,), shared by the channels, and of its weights (C, k+1).
    """

    def __init__(self, target: SpectralTarget, shapes: Sequence[Shape]) -> None:
        self.target, self.shapes = target, tuple(shapes)
        self.channels = len(target.energy)
        self._down, self._up = _resampling(target.frequencies, [each.level for each in shapes])
        pairs = np.array([each.pairs for each in shapes])
        own = pairs + self.channels * (pairs + 1)
        first = self.channels * (len(shapes) + 1)
        self._at = first + np.concatenate(([0], np.cumsum(own)))
        self.size = int(self._at[-1])
        own = [np.arange(self._steps(k).start, self._steps(k).stop) for k in range(len(shapes))]
        self.step_parameters = np.concatenate(own)  # which parameters are offset steps

    def start(self, rng: np.random.Generator) -> FloatArray:
        """Return random parameters: offsets that grow by a random factor from stage to stage."""
        reach, growth = rng.uniform(0.7, 2.0), rng.uniform(1.5, 2.6)
        parts = [rng.normal(0.0, 0.3, self.channels * (len(self.shapes) + 1))]
        for each in self.shapes:
            k = np.arange(1, each.pairs + 1)
            texels = max(reach / 2.0**each.level, 0.5)
            offsets = np.maximum.accumulate(k * rng.uniform(0.8, 1.25, k.size)) + 1e-3 * k
            bell = -0.5 * (np.concatenate(([0.0], offsets)) / (0.6 * each.pairs)) ** 2
            steps = np.log(texels * np.diff(offsets, prepend=0.0))
            parts += [steps, np.tile(bell, self.channels)]
            reach *= growth * max(1.0, each.pairs**0.5)
        return np.concatenate(parts)

    def numbers(self, x: FloatArray) -> Numbers:
        """Return what parameters stand for."""
        parts = [self._stage(x, k) for k in range(len(self.shapes))]
        return Numbers(
            [np.cumsum(np.exp(steps)) for steps, _ in parts],
            [_normalised(logits)[0].T for _, logits in parts],
            self._blend(x),
        )

    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""
        stages = self._stage_spectra([self._blur(x, k) for k in range(len(self.shapes))])
        shared: FloatArray = stages * self._blend(x).T[:, None, :] @ stages.transpose(0, 2, 1)
        return shared

    def value_and_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum over channels of the squared relative misfit, and its gradient."""
        blurs = [self._blur(x, k) for k in range(len(self.shapes))]
        u, m = self._stage_spectra(blurs), self._blend(x)  # (C, n, L+1), (L+1, C)
        apart = (u * m.T[:, None, :]) @ u.transpose(0, 2, 1) - self.target.wanted
        weighted = self.target.power * apart
        value = float(np.vdot(weighted, apart))
        across = weighted @ u
        by_blend = 2.0 * m * np.einsum("cnl,cnl->lc", u, across)
        share = m / self.target.energy
        gradient = np.empty(self.size)
        gradient[: m.size] = (by_blend - share * by_blend.sum(axis=0)).ravel()
        self._backwards(blurs, 4.0 * across * m.T[:, None, :], gradient)
        for k in range(len(self.shapes)):
            beyond, slopes = self._beyond(x, k)
            value += _BARRIER * beyond**2
            gradient[self._steps(k)] += 2.0 * _BARRIER * beyond * slopes
        return value, gradient

    def hessian(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of the second derivatives, (size, size)."""
        blurs = [self._blur(x, k) for k in range(len(self.shapes))]
        u, m = self._stage_spectra(blurs), self._blend(x)
        slopes = self._slopes(blurs)  # (C, parameters, n, L+1)
        half = slopes @ (u * m.T[:, None, :]).transpose(0, 2, 1)[:, None]
        by_stage = half + half.transpose(0, 1, 3, 2)
        layers = u.transpose(0, 2, 1)[..., None] * u.transpose(0, 2, 1)[:, :, None]
        whole = np.einsum("lc,clij->cij", m, layers) / self.target.energy[:, None, None]
        by_blend = m.T[:, :, None, None] * (layers - whole[:, None])
        rows = np.concatenate((by_blend, by_stage), axis=1)
        rows *= np.sqrt(self.target.power)[:, None]
        found = np.zeros((self.size, self.size))
        for c in range(self.channels):
            flat = rows[c].reshape(rows.shape[1], -1)
            own = self._parameters_of(c)
            found[np.ix_(own, own)] += 2.0 * flat @ flat.T
        for k in range(len(self.shapes)):
            beyond, slopes = self._beyond(x, k)
            if beyond > 0.0:
                found[self._steps(k), self._steps(k)] += 2.0 * _BARRIER * np.outer(slopes, slopes)
        return found

    def _steps(self, k: int) -> slice:
        """Where a stage's offset steps are among the parameters."""
        return slice(int(self._at[k]), int(self._at[k]) + self.shapes[k].pairs)

    def _beyond(self, x: FloatArray, k: int) -> tuple[float, FloatArray]:
        """Return the logarithm by which a stage's last offset exceeds the kernel, and its slopes.

        The graded frequencies cannot tell such an offset from one inside.
        """
        steps = np.exp(x[self._steps(k)])
        last = float(steps.sum())
        beyond = math.log(last * 2.0 ** self.shapes[k].level / self.target.half_pixels)
        return max(beyond, 0.0), steps / last

    def _blend(self, x: FloatArray) -> FloatArray:
        logits = x[: self._at[0]].reshape(-1, self.channels)
        shares = np.exp(logits - logits.max(axis=0))
        blend: FloatArray = shares / shares.sum(axis=0) * self.target.energy
        return blend

    def _stage(self, x: FloatArray, k: int) -> tuple[FloatArray, FloatArray]:
        """Return a stage's logarithms: of steps (pairs,) and of weights (C, pairs+1)."""
        own, pairs = x[self._at[k] : self._at[k + 1]], self.shapes[k].pairs
        return own[:pairs], own[pairs:].reshape(self.channels, pairs + 1)

    def _parameters_of(self, channel: int) -> npt.NDArray[np.intp]:
        """Return the indices of what a channel depends on, in the order of `_slopes`."""
        found = [np.arange(len(self.shapes) + 1) * self.channels + channel]
        for k, each in enumerate(self.shapes):
            weights = self._at[k] + each.pairs + channel * (each.pairs + 1)
            found += [
                self._at[k] + np.arange(each.pairs),
                weights + np.arange(each.pairs + 1),
            ]
        return np.concatenate(found)

    def _blur(self, x: FloatArray, k: int) -> _Blur:
        steps, logits = self._stage(x, k)
        step = np.exp(steps)
        weights, copies = _normalised(logits)
        w = 2.0 ** self.shapes[k].level * self.target.frequencies
        fetched, by_offset = _fetches(np.cumsum(step), w)
        spectrum = weights @ fetched
        by_weight = weights[:, :, None] * (fetched - copies[:, None] * spectrum[:, None, :])
        by_offset = weights[:, 1:, None] * by_offset
        # A step moves its own offset and all farther ones.
        by_step = np.cumsum(by_offset[:, ::-1], axis=1)[:, ::-1] * step[:, None]
        return _Blur(spectrum, np.concatenate((by_step, by_weight), axis=1))

    def _stage_spectra(self, blurs: Sequence[_Blur]) -> FloatArray:
        """Return the spectrum of each stage's picture, (C, n, L+1)."""
        found = np.ones((self.channels, self.target.frequencies.size, len(blurs) + 1))
        chain = np.ones(found.shape[:2])
        for k, blur in enumerate(blurs):
            chain = chain * (self._down[k] * blur.spectrum)
            found[:, :, k + 1] = chain * self._up[k]
        return found

    def _backwards(self, blurs: Sequence[_Blur], by_u: FloatArray, gradient: FloatArray) -> None:
        """Fill in the gradient by the stages from that by their spectra (C, n, L+1)."""
        before = [np.ones(by_u.shape[:2])]
        for k, blur in enumerate(blurs):
            before.append(before[-1] * (self._down[k] * blur.spectrum))
        by_chain = np.zeros(by_u.shape[:2])
        for k in range(len(blurs) - 1, -1, -1):
            by_chain = by_chain + by_u[:, :, k + 1] * self._up[k]
            pairs = self.shapes[k].pairs
            own = np.einsum("cn,cpn->cp", by_chain * before[k] * self._down[k], blurs[k].slopes)
            gradient[self._at[k] : self._at[k] + pairs] = own[:, :pairs].sum(axis=0)
            gradient[self._at[k] + pairs : self._at[k + 1]] = own[:, pairs:].ravel()
            by_chain = by_chain * (self._down[k] * blurs[k].spectrum)

    def _slopes(self, blurs: Sequence[_Blur]) -> FloatArray:
        """Return derivatives of the stages' spectra by a channel's parameters, (C, p, n, L+1)."""
        counts = [each.slopes.shape[1] for each in blurs]
        n = self.target.frequencies.size
        found = np.zeros((self.channels, sum(counts), n, len(blurs) + 1))
        chain, moving = np.ones((self.channels, n)), np.zeros((self.channels, sum(counts), n))
        done = 0
        for k, blur in enumerate(blurs):
            factor = self._down[k] * blur.spectrum
            moving[:, :done] *= factor[:, None]
            own = slice(done, done + counts[k])
            moving[:, own] = (chain * self._down[k])[:, None] * blur.slopes
            chain = chain * factor
            done += counts[k]
            found[:, :done, :, k + 1] = moving[:, :done] * self._up[k]
        return found


def _normalised(logits: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return weights (C, k+1), one middle and k pairs that add up to 1, and their copies (k+1,)."""
    weights = np.exp(logits - logits.max(axis=1, keepdims=True))
    copies = np.where(np.arange(logits.shape[1]) == 0, 1.0, 2.0)
    return weights / (weights @ copies)[:, None], copies


def _fetches(offsets: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return spectra (k+1, n) of the middle and mirrored fetches, and slopes by offset (k, n)."""
    whole = np.floor(offsets)
    near, far = np.cos(whole[:, None] * w), np.cos((whole[:, None] + 1.0) * w)
    slope = 2.0 * (far - near)
    pairs = 2.0 * near + (offsets - whole)[:, None] * slope
    return np.concatenate((np.ones((1, w.size)), pairs)), slope


def _resampling(w: FloatArray, levels: Sequence[int]) -> tuple[FloatArray, FloatArray]:
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
