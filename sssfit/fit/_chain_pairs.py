"""The misfit of a chain whose stages are all pairs of passes: its spectrum is separable.

K^ = sum_l m_l u_l(wx) u_l(wy), so nothing but the sum has two dimensions; see ``_chain``.

A picture halved v times also shows light of the frequency w as if it were of w - 2 pi / 2^v, by its
place among the texels: it shimmers under motion. Along x these images have the amplitude

    A_v = sum_l m_l c_l(wx) up_l(wx - 2 pi / 2^v) u_l(wy),    u_l = c_l up_l,

over the stages l of level v and coarser (those with the other sign), c_l the product of all
halvings and stages up to l. Their squares are added to the misfit with the spectrum of the pictures
and the weight ``aliasing``. Those along y are equal, and those of other images much smaller.
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
    """A stage at some parameters: its spectrum (C, n) and derivatives (C, parameters, n)."""

    spectrum: FloatArray
    slopes: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """One fitted sum over stages: what the chain up to each stage is multiplied by, by axis."""

    x: FloatArray  # (L+1, n)
    y: FloatArray  # (L+1, n)
    wanted: FloatArray | float
    weight: float  # of its squares


class PairChain(Chain):
    """See `Chain`."""

    def __init__(self, target: SpectralTarget, shapes: Sequence[Shape]) -> None:
        super().__init__(target, shapes)
        n, most = target.frequencies.size, self._parameters_of(0).size
        self._kept, self._spare = np.empty((most, n, n)), np.empty((most, n, n))

    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""
        chain = self._chain([self._blur(x, k) for k in range(len(self.shapes))])
        return _sum(chain, self._views()[0], self._blend(x))

    def misfit(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum over channels of the squared relative misfit, and its gradient."""
        blurs = [self._blur(x, k) for k in range(len(self.shapes))]
        chain, m = self._chain(blurs), self._blend(x)  # (C, n, L+1), (L+1, C)
        value, by_blend, by_chain = 0.0, np.zeros_like(m), np.zeros_like(chain)
        for view in self._views():
            ux, uy = chain * view.x.T, chain * view.y.T
            apart = _sum(chain, view, m) - view.wanted
            weighted = view.weight * self.target.power * apart
            value += float(np.vdot(weighted, apart))
            across, along = weighted @ uy, weighted.transpose(0, 2, 1) @ ux
            by_blend += 2.0 * m * np.einsum("cnl,cnl->lc", ux, across)
            by_chain += 2.0 * m.T[:, None, :] * (across * view.x.T + along * view.y.T)
        share = m / self.target.energy
        gradient = np.empty(self.size)
        gradient[: m.size] = (by_blend - share * by_blend.sum(axis=0)).ravel()
        self._backwards(blurs, by_chain, gradient)
        return value, gradient

    def matrix(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of its second derivatives, (size, size)."""
        blurs = [self._blur(x, k) for k in range(len(self.shapes))]
        chain, m = self._chain(blurs), self._blend(x)
        slopes = self._slopes(blurs)  # (C, parameters, n, L+1)
        found = np.zeros((self.size, self.size))
        for view in self._views():
            ux, uy = chain * view.x.T, chain * view.y.T
            weight = np.sqrt(view.weight * self.target.power)
            for c in range(self.channels):
                rows = self._rows(view, ux[c], uy[c], slopes[c], m[:, c], c)
                rows *= weight[c]
                flat = rows.reshape(len(rows), -1)
                twice = np.multiply(rows, 2.0, out=self._spare[: len(rows)]).reshape(flat.shape)
                own = self._parameters_of(c)
                found[np.ix_(own, own)] += twice @ flat.T
        return found

    def _rows(
        self,
        view: _View,
        ux: FloatArray,
        uy: FloatArray,
        slopes: FloatArray,
        m: FloatArray,
        c: int,
    ) -> FloatArray:
        """Return a view's derivatives by a channel's blend and stages, (L+1 + parameters, n, n).

        They stand in ``_kept``: making arrays of a megabyte for each channel took two fifths of
        a fit's time, since the system clears every page of them.
        """
        blend, many = m.size, len(slopes)
        rows, across = self._kept[: blend + many], self._spare[:many]
        np.matmul(slopes * view.x.T, (uy * m).T, out=rows[blend:])
        rows[blend:] += np.matmul(ux * m, (slopes * view.y.T).transpose(0, 2, 1), out=across)
        layers = ux.T[:, :, None] * uy.T[:, None]
        whole = np.einsum("l,lij->ij", m, layers) / self.target.energy[c]
        np.multiply(m[:, None, None], layers - whole, out=rows[:blend])
        return rows

    def _views(self) -> list[_View]:
        """Return the kernel, and what aliasing adds to each level, where it counts."""
        irradiance = np.ones((1, self.target.frequencies.size))
        up = np.concatenate((irradiance, self._up))
        images = [_View(image, up, 0.0, self.aliasing) for image in self._images()]
        return [_View(up, up, self.target.wanted, 1.0), *images]

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

    def _chain(self, blurs: Sequence[_Blur]) -> FloatArray:
        """Return the product of all stages and halvings up to each stage, (C, n, L+1)."""
        found = np.ones((self.channels, self.target.frequencies.size, len(blurs) + 1))
        for k, blur in enumerate(blurs):
            found[:, :, k + 1] = found[:, :, k] * (self._down[k] * blur.spectrum)
        return found

    def _backwards(self, blurs: Sequence[_Blur], by_u: FloatArray, gradient: FloatArray) -> None:
        """Fill in the gradient by the stages from that by their chain (C, n, L+1)."""
        before = self._chain(blurs)
        by_chain = np.zeros(by_u.shape[:2])
        for k in range(len(blurs) - 1, -1, -1):
            by_chain = by_chain + by_u[:, :, k + 1]
            moved = by_chain * before[:, :, k] * self._down[k]
            self._put_stage(gradient, k, np.einsum("cn,cpn->cp", moved, blurs[k].slopes))
            by_chain = by_chain * (self._down[k] * blurs[k].spectrum)

    def _slopes(self, blurs: Sequence[_Blur]) -> FloatArray:
        """Return derivatives of the chain by a channel's parameters, (C, p, n, L+1)."""
        counts = [each.slopes.shape[1] for each in blurs]
        n = self.target.frequencies.size
        found = np.zeros((self.channels, sum(counts), n, len(blurs) + 1))
        before, moving = self._chain(blurs), np.zeros((self.channels, sum(counts), n))
        done = 0
        for k, blur in enumerate(blurs):
            moving[:, :done] *= (self._down[k] * blur.spectrum)[:, None]
            own = slice(done, done + counts[k])
            moving[:, own] = (before[:, :, k] * self._down[k])[:, None] * blur.slopes
            done += counts[k]
            found[:, :done, :, k + 1] = moving[:, :done]
        return found


def _sum(chain: FloatArray, view: _View, blend: FloatArray) -> FloatArray:
    """Return a view's sum over stages (C, n, n)."""
    ux, uy = chain * view.x.T, chain * view.y.T
    found: FloatArray = ux * blend.T[:, None, :] @ uy.transpose(0, 2, 1)
    return found
