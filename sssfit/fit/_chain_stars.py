"""The misfit of a chain with stars among its stages: its spectrum has two dimensions throughout.

Every spectrum stays the same if the axes are exchanged, so the frequencies of a triangle stand for
all; see ``_chain``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit._chain import Chain, fetches, normalised
from sssfit.fit._spectrum import SpectralTarget
from sssfit.kernel.structure import Shape


@dataclass(frozen=True, slots=True, eq=False)
class _Blur:
    """A stage at some parameters: its spectrum (C, M) and derivatives (C, parameters, M)."""

    spectrum: FloatArray
    slopes: FloatArray


class StarChain(Chain):
    """See `Chain`; M is the number of frequencies (wx, wy) of the triangle."""

    def __init__(self, target: SpectralTarget, shapes: Sequence[Shape]) -> None:
        super().__init__(target, shapes)
        self._x, self._y = np.tril_indices(target.frequencies.size)
        twice = np.where(self._x == self._y, 1.0, 2.0)
        self._power = target.power[:, self._x, self._y] * twice
        self._wanted = target.wanted[:, self._x, self._y]
        self._resized = [self._both(each) for each in (self._down, self._up)]

    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""
        count = self.target.frequencies.size
        found = np.empty((self.channels, count, count))
        flat = np.einsum("lc,lcm->cm", self._blend(x), self._pictures(self._blurs(x)))
        found[:, self._x, self._y] = found[:, self._y, self._x] = flat
        return found

    def misfit(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum over channels of the squared relative misfit, and its gradient."""
        blurs, m = self._blurs(x), self._blend(x)
        u = self._pictures(blurs)  # (L+1, C, M)
        apart = np.einsum("lc,lcm->cm", m, u) - self._wanted
        weighted = self._power * apart
        by_blend = 2.0 * m * np.einsum("cm,lcm->lc", weighted, u)
        share = m / self.target.energy
        gradient = np.empty(self.size)
        gradient[: m.size] = (by_blend - share * by_blend.sum(axis=0)).ravel()
        self._backwards(blurs, 2.0 * weighted, m, gradient)
        return float(np.vdot(weighted, apart)), gradient

    def matrix(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of its second derivatives, (size, size)."""
        blurs, m = self._blurs(x), self._blend(x)
        u = self._pictures(blurs)
        whole = np.einsum("lc,lcm->cm", m, u) / self.target.energy[:, None]
        by_blend = (m[:, :, None] * (u - whole)).transpose(1, 0, 2)
        rows = np.concatenate((by_blend, self._slopes(blurs, m)), axis=1)
        rows *= np.sqrt(self._power)[:, None]
        found = np.zeros((self.size, self.size))
        for c in range(self.channels):
            own = self._parameters_of(c)
            found[np.ix_(own, own)] += 2.0 * rows[c] @ rows[c].T
        return found

    def _both(self, line: FloatArray) -> FloatArray:
        """Return f(wx) f(wy) of spectra (..., n) along an axis."""
        product: FloatArray = line[..., self._x] * line[..., self._y]
        return product

    def _blurs(self, x: FloatArray) -> list[_Blur]:
        kinds = [each.kind for each in self.shapes]
        made = {"pair": self._pair, "star": self._star}
        return [made[kind](*self._stage(x, k), k) for k, kind in enumerate(kinds)]

    def _frequencies(self, k: int) -> FloatArray:
        return 2.0 ** self.shapes[k].level * self.target.frequencies

    def _pair(self, steps: FloatArray, logits: FloatArray, k: int) -> _Blur:
        step = np.exp(steps)
        weights, copies = normalised(logits)
        pairs, by_offset = fetches(np.cumsum(step), self._frequencies(k))
        fetched = np.concatenate((np.ones((1, pairs.shape[1])), pairs))
        line = weights @ fetched
        by_weight = weights[:, :, None] * (fetched - copies[:, None] * line[:, None, :])
        by_offset = weights[:, 1:, None] * by_offset
        by_step = np.cumsum(by_offset[:, ::-1], axis=1)[:, ::-1] * step[:, None]
        slopes = np.concatenate((by_step, by_weight), axis=1)
        across = slopes[..., self._x] * line[:, None, self._y]
        return _Blur(self._both(line), across + slopes[..., self._y] * line[:, None, self._x])

    def _star(self, steps: FloatArray, logits: FloatArray, k: int) -> _Blur:
        offsets = np.exp(steps)
        weights, copies = normalised(logits, "star")
        (diagonal, axis), (by_diagonal, by_axis) = fetches(offsets, self._frequencies(k))
        corners, beside = self._both(diagonal), axis[self._x] + axis[self._y]
        fetched = np.stack((np.ones(corners.size), corners, beside))
        spectrum = weights @ fetched
        by_weight = weights[:, :, None] * (fetched - copies[:, None] * spectrum[:, None, :])
        turned = by_diagonal[self._x] * diagonal[self._y] + diagonal[self._x] * by_diagonal[self._y]
        moved = np.stack((turned, by_axis[self._x] + by_axis[self._y])) * offsets[:, None]
        by_offset = weights[:, 1:, None] * moved
        return _Blur(spectrum, np.concatenate((by_offset, by_weight), axis=1))

    def _pictures(self, blurs: Sequence[_Blur]) -> FloatArray:
        """Return the spectrum of each stage's picture as it is added up, (L+1, C, M)."""
        down, up = self._resized
        found = np.ones((len(blurs) + 1, self.channels, self._x.size))
        chain = found[0]
        for k, blur in enumerate(blurs):
            chain = chain * (down[k] * blur.spectrum)
            found[k + 1] = chain * up[k]
        return found

    def _backwards(
        self, blurs: Sequence[_Blur], by_sum: FloatArray, m: FloatArray, gradient: FloatArray
    ) -> None:
        """Fill in the gradient by the stages from that by the chain's spectrum (C, M)."""
        down, up = self._resized
        before = [np.ones(by_sum.shape)]
        for k, blur in enumerate(blurs):
            before.append(before[-1] * (down[k] * blur.spectrum))
        by_chain = np.zeros(by_sum.shape)
        for k in range(len(blurs) - 1, -1, -1):
            by_chain = by_chain + m[k + 1][:, None] * up[k] * by_sum
            by_blur = by_chain * before[k] * down[k]
            self._put_stage(gradient, k, np.einsum("cm,cpm->cp", by_blur, blurs[k].slopes))
            by_chain = by_chain * (down[k] * blurs[k].spectrum)

    def _slopes(self, blurs: Sequence[_Blur], m: FloatArray) -> FloatArray:
        """Return derivatives of the chain's spectrum by a channel's stages, (C, p, M)."""
        down, up = self._resized
        counts = [each.slopes.shape[1] for each in blurs]
        moving = np.zeros((self.channels, sum(counts), self._x.size))
        found, chain, done = np.zeros(moving.shape), np.ones(moving[:, 0].shape), 0
        for k, blur in enumerate(blurs):
            factor = down[k] * blur.spectrum
            moving[:, :done] *= factor[:, None]
            moving[:, done : done + counts[k]] = (chain * down[k])[:, None] * blur.slopes
            chain, done = chain * factor, done + counts[k]
            found[:, :done] += (m[k + 1][:, None] * up[k])[:, None] * moving[:, :done]
        return found
