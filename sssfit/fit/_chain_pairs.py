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
from sssfit.fit._chain import Chain, fetches, normalised, texels_of
from sssfit.fit._spectrum import SpectralTarget
from sssfit.kernel.structure import Shape


@dataclass(frozen=True, slots=True, eq=False)
class _Blurs:
    """All stages along an axis; those of fewer taps are filled up with fetches of no weight.

    Attributes
    ----------
    step : array (S, k)
    weights : array (C, S, k+1)
    copies : array (k+1,)
        How many fetches have each weight.
    fetched : array (S, k+1, n)
        The spectra of a stage's fetches.
    by_offset : array (S, k, n)
        Their slopes.
    spectrum, factors : array (C, S, n)
        The stages' spectra, and those with the halvings before them.
    chain : array (C, L+1, n)
        The product of all factors up to each stage.
    """

    step: FloatArray
    weights: FloatArray
    copies: FloatArray
    fetched: FloatArray
    by_offset: FloatArray
    spectrum: FloatArray
    factors: FloatArray
    chain: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """One fitted sum over stages: what the chain up to each stage is multiplied by, by axis."""

    stages: slice  # of the irradiance, 0, and the stages
    x: FloatArray  # (l, n)
    y: FloatArray  # (l, n)
    wanted: FloatArray | float
    weight: float  # of its squares


class PairChain(Chain):
    """See `Chain`."""

    def __init__(
        self, target: SpectralTarget, shapes: Sequence[Shape], aliasing: float = 0.0
    ) -> None:
        super().__init__(target, shapes, aliasing)
        up = np.concatenate((np.ones((1, target.frequencies.size)), self._up))
        self.views = [_View(slice(None), up, up, target.wanted, 1.0)]
        for first, image in self._images():
            self.views.append(_View(slice(first, None), image, up[first:], 0.0, aliasing))
        self._w = 2.0 ** np.array([[each.level] for each in shapes]) * target.frequencies
        count, most = np.array(self.counts)[:, None], max(self.counts)
        self._has_step = np.arange(most) < count
        self._has_weight = np.arange(most + 1) <= count
        self._steps_at = np.zeros((len(shapes), most), np.intp)
        self._weights_at = np.zeros((self.channels, len(shapes), most + 1), np.intp)
        for k, own in enumerate(self.counts):
            self._steps_at[k, :own], self._weights_at[:, k, : own + 1] = self.places(k)
        n, size = target.frequencies.size, self.parameters[0].size
        self._spare = np.empty((size, n, n))  # new, the system clears its pages: twice the time

    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""
        chain, view = self._blurs(x).chain, self.views[0]
        return _sum(chain * view.x, chain * view.y, self._blend(x))

    def misfit(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum over channels of the squared relative misfit, and its gradient."""
        blurs, m = self._blurs(x), self._blend(x)
        value, by_blend, by_chain = 0.0, np.zeros_like(m), np.zeros_like(blurs.chain)
        for view in self.views:
            part, own = blurs.chain[:, view.stages], m[view.stages]
            ux, uy = part * view.x, part * view.y
            apart = _sum(ux, uy, own) - view.wanted
            weighted = view.weight * self.target.power * apart
            value += float(np.vdot(weighted, apart))
            across, along = uy @ weighted.transpose(0, 2, 1), ux @ weighted
            by_blend[view.stages] += 2.0 * own * np.einsum("cln,cln->lc", ux, across)
            along = across * view.x + along * view.y
            by_chain[:, view.stages] += 2.0 * own.T[:, :, None] * along
        share = m / self.target.energy
        gradient = np.empty(self.size)
        gradient[: m.size] = (by_blend - share * by_blend.sum(axis=0)).ravel()
        self._backwards(blurs, by_chain, gradient)
        return value, gradient

    def matrix(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of its second derivatives, (size, size)."""
        blurs, m = self._blurs(x), self._blend(x)
        slopes = self._slopes(blurs)  # (C, parameters, L+1, n)
        found = np.zeros((self.size, self.size))
        for c in range(self.channels):
            own = self.parameters[c]
            for view in self.views:
                products = self._products(view, blurs.chain[c], slopes[c], m[:, c], c)
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
        part, own = chain[view.stages], m[view.stages]
        ux, uy, moved = part * view.x, part * view.y, slopes[:, view.stages] * own[:, None]
        power = view.weight * self.target.power[c]
        shares = np.diag(m)[:, view.stages] - m[:, None] * own / self.target.energy[c]
        a = np.concatenate((shares[:, :, None] * ux, moved * view.x))  # (L+1 + parameters, l, n)
        b = moved * view.y
        lit = np.matmul(a.transpose(0, 2, 1), uy, out=self._spare)
        lit *= power
        crossed = _products_with(ux @ lit, b)
        found = _products_with(_across(a, uy, power), a)
        found[:, m.size :] += crossed
        found[m.size :] += crossed.T
        found[m.size :, m.size :] += _products_with(_across(b, ux, power.T), b)
        return found

    def _blurs(self, x: FloatArray) -> _Blurs:
        step = texels_of(x[self._steps_at]) * self._has_step
        logits = np.where(self._has_weight, x[self._weights_at], -np.inf)
        weights, copies = normalised(logits)
        pairs, by_offset = fetches(np.cumsum(step, axis=1), self._w)
        fetched = np.concatenate((np.ones_like(self._w)[:, None], pairs), axis=1)
        spectrum = (weights[:, :, None] @ fetched)[:, :, 0]
        factors = self._down * spectrum
        chain = np.ones((self.channels, len(self.shapes) + 1, self._w.shape[1]))
        np.cumprod(factors, axis=1, out=chain[:, 1:])
        return _Blurs(step, weights, copies, fetched, by_offset, spectrum, factors, chain)

    def _backwards(self, blurs: _Blurs, by_u: FloatArray, gradient: FloatArray) -> None:
        """Fill in the gradient by the stages from that by their chain (C, L+1, n)."""
        by_blur = by_u[:, 1:]  # by what each stage makes of its picture, those after it included
        for k in range(len(self.shapes) - 2, -1, -1):
            by_blur[:, k] += blurs.factors[:, k + 1] * by_blur[:, k + 1]
        by_blur *= blurs.chain[:, :-1] * self._down
        of_fetches = (blurs.fetched @ by_blur[..., None])[..., 0]  # (C, S, k+1)
        of_all = np.einsum("csn,csn->cs", by_blur, blurs.spectrum)[:, :, None]
        by_weight = blurs.weights * (of_fetches - blurs.copies * of_all)
        by_offset = blurs.weights[:, :, 1:] * (blurs.by_offset @ by_blur[..., None])[..., 0]
        by_step = _of_farther(by_offset.sum(axis=0)) * blurs.step
        gradient[self._steps_at[self._has_step]] = by_step[self._has_step]
        gradient[self._weights_at[:, self._has_weight]] = by_weight[:, self._has_weight]

    def _slopes(self, blurs: _Blurs) -> FloatArray:
        """Return derivatives of the chain by a channel's parameters, (C, p, L+1, n)."""
        weights, spectrum = blurs.weights[..., None], blurs.spectrum[:, :, None]
        by_weight = weights * (blurs.fetched - blurs.copies[:, None] * spectrum)
        moved = (weights[:, :, 1:] * blurs.by_offset).swapaxes(2, 3)
        by_step = (_of_farther(moved) * blurs.step[:, None]).swapaxes(2, 3)
        has = np.concatenate((self._has_step, self._has_weight), axis=1)
        own = np.concatenate((by_step, by_weight), axis=2)[:, has]  # (C, p, n)
        stage = np.nonzero(has)[0]
        found = np.zeros((*own.shape[:2], blurs.chain.shape[1], own.shape[2]))
        found[:, np.arange(stage.size), stage + 1] = (
            own * (blurs.chain[:, :-1] * self._down)[:, stage]
        )
        for k in range(1, len(self.shapes)):
            before = stage < k
            found[:, before, k + 1] = found[:, before, k] * blurs.factors[:, k, None]
        return found


def _of_farther(by_offset: FloatArray) -> FloatArray:
    """Return derivatives by steps from those by offsets (..., k): a step moves all farther ones."""
    return np.cumsum(by_offset[..., ::-1], axis=-1)[..., ::-1]


def _across(rows: FloatArray, other: FloatArray, power: FloatArray) -> FloatArray:
    """Return sums over stages (p, l, n), with the other axis's functions (l, n) summed over."""
    pairs = (other[:, None] * other) @ power.T
    found: FloatArray = np.matmul(rows.transpose(2, 0, 1), pairs.transpose(2, 0, 1))
    return found.transpose(1, 2, 0)


def _products_with(rows: FloatArray, others: FloatArray) -> FloatArray:
    """Return the products (p, q) of functions (p, l, n) and (q, l, n)."""
    found: FloatArray = rows.reshape(len(rows), -1) @ others.reshape(len(others), -1).T
    return found


def _sum(ux: FloatArray, uy: FloatArray, blend: FloatArray) -> FloatArray:
    """Return the sum over stages (C, n, n) of what the axes see, (C, l, n), blended (l, C)."""
    found: FloatArray = (ux * blend.T[:, :, None]).transpose(0, 2, 1) @ uy
    return found
