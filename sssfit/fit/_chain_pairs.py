"""The misfit of a chain whose stages are all pairs of passes: its spectrum is separable.

K^ = sum_l m_l u_l(wx) u_l(wy), so nothing but the sum has two dimensions; see ``_chain``.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit._chain import Chain, fetches, normalised


@dataclass(frozen=True, slots=True, eq=False)
class _Blur:
    """A stage at some parameters: its spectrum (C, n) and derivatives (C, parameters, n)."""

    spectrum: FloatArray
    slopes: FloatArray


class PairChain(Chain):
    """See `Chain`."""

    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""
        stages = self._stage_spectra([self._blur(x, k) for k in range(len(self.shapes))])
        shared: FloatArray = stages * self._blend(x).T[:, None, :] @ stages.transpose(0, 2, 1)
        return shared

    def misfit(self, x: FloatArray) -> tuple[float, FloatArray]:
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
        return value, gradient

    def matrix(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of its second derivatives, (size, size)."""
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
        return found

    def _blur(self, x: FloatArray, k: int) -> _Blur:
        steps, logits = self._stage(x, k)
        step = np.exp(steps)
        weights, copies = normalised(logits)
        w = 2.0 ** self.shapes[k].level * self.target.frequencies
        pairs, by_offset = fetches(np.cumsum(step), w)
        fetched = np.concatenate((np.ones((1, w.size)), pairs))
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
            own = np.einsum("cn,cpn->cp", by_chain * before[k] * self._down[k], blurs[k].slopes)
            self._put_stage(gradient, k, own)
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
