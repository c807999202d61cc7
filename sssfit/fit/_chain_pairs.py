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

    stages: slice  # of the irradiance, 0, and the stages
    x: FloatArray  # (n, l)
    y: FloatArray  # (n, l)
    wanted: FloatArray | float
    weight: float  # of its squares


class PairChain(Chain):
    """See `Chain`."""

    def __init__(
        self, target: SpectralTarget, shapes: Sequence[Shape], aliasing: float = 0.0
    ) -> None:
        super().__init__(target, shapes, aliasing)
        up = np.concatenate((np.ones((1, target.frequencies.size)), self._up)).T
        self.views = [_View(slice(None), up, up, target.wanted, 1.0)]
        for first, image in self._images():
            self.views.append(_View(slice(first, None), image.T, up[:, first:], 0.0, aliasing))
        n, most = target.frequencies.size, self._parameters_of(0).size
        self._spare = np.empty((most, n, n))  # new, the system clears its pages: twice the time

    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""
        chain = self._chain([self._blur(x, k) for k in range(len(self.shapes))])
        view = self.views[0]
        return _sum(chain * view.x, chain * view.y, self._blend(x))

    def misfit(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum over channels of the squared relative misfit, and its gradient."""
        blurs = [self._blur(x, k) for k in range(len(self.shapes))]
        chain, m = self._chain(blurs), self._blend(x)  # (C, n, L+1), (L+1, C)
        value, by_blend, by_chain = 0.0, np.zeros_like(m), np.zeros_like(chain)
        for view in self.views:
            part, own = chain[:, :, view.stages], m[view.stages]
            ux, uy = part * view.x, part * view.y
            apart = _sum(ux, uy, own) - view.wanted
            weighted = view.weight * self.target.power * apart
            value += float(np.vdot(weighted, apart))
            across, along = weighted @ uy, weighted.transpose(0, 2, 1) @ ux
            by_blend[view.stages] += 2.0 * own * np.einsum("cnl,cnl->lc", ux, across)
            along = across * view.x + along * view.y
            by_chain[:, :, view.stages] += 2.0 * own.T[:, None, :] * along
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
        for c in range(self.channels):
            own = self._parameters_of(c)
            for view in self.views:
                products = self._products(view, chain[c], slopes[c], m[:, c], c)
                found[np.ix_(own, own)] += 2.0 * products
        return found

    def _products(
        self, view: _View, chain: FloatArray, slopes: FloatArray, m: FloatArray, c: int
    ) -> FloatArray:
        """Return the weighted products of a view's derivatives by a channel's parameters.

        A view's derivative by the parameter p is A_p + B_p with

            A_p(i, j) = sum_l a_pl(i) uy_l(j),    B_p(i, j) = sum_l ux_l(i) b_pl(j).

        Nothing but A needs both frequencies at once: the products of all derivatives as pictures
        took 1.1 to 1.4 times as long.
        """
        part, own = chain[:, view.stages], m[view.stages]
        ux, uy, moved = part * view.x, part * view.y, slopes[..., view.stages] * own
        power = view.weight * self.target.power[c]
        shares = np.diag(m)[:, view.stages] - m[:, None] * own / self.target.energy[c]
        a = np.concatenate((shares[:, None] * ux, moved * view.x))  # (L+1 + parameters, n, l)
        b = moved * view.y
        lit = np.matmul(a, uy.T, out=self._spare)
        lit *= power
        crossed = _products_with((ux.T @ lit).transpose(0, 2, 1), b)
        found = _products_with(_across(a, uy, power), a)
        found[:, m.size :] += crossed
        found[m.size :] += crossed.T
        found[m.size :, m.size :] += _products_with(_across(b, ux, power.T), b)
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


def _across(rows: FloatArray, other: FloatArray, power: FloatArray) -> FloatArray:
    """Return sums over stages (p, n, l), with the other axis's functions (n, l) summed over."""
    n, stages = other.shape
    products = (other[:, :, None] * other[:, None, :]).reshape(n, -1)
    pairs = (products.T @ power.T).T.reshape(n, stages, stages)
    found: FloatArray = np.matmul(rows.transpose(1, 0, 2), pairs).transpose(1, 0, 2)
    return found


def _products_with(rows: FloatArray, others: FloatArray) -> FloatArray:
    """Return the products (p, q) of functions (p, n, l) and (q, n, l)."""
    found: FloatArray = rows.reshape(len(rows), -1) @ others.reshape(len(others), -1).T
    return found


def _sum(ux: FloatArray, uy: FloatArray, blend: FloatArray) -> FloatArray:
    """Return the sum over stages (C, n, n) of what the axes see, (C, n, l), blended (l, C)."""
    found: FloatArray = ux * blend.T[:, None, :] @ uy.transpose(0, 2, 1)
    return found
