"""The misfit of a chain whose stages are all pairs of passes: its spectrum is separable.

K^ = sum_l m_l u_l(wx) u_l(wy), so nothing but the sum has two dimensions; see ``_chain``.

A picture halved v times also shows light of the frequency w as if it were of w - 2 pi / 2^v, by its
place among the texels: it shimmers under motion. Along x these images have the amplitude

    A_v = sum_l m_l c_l(wx) up_l(wx - 2 pi / 2^v) u_l(wy),    u_l = c_l up_l,

over the stages l of level v and coarser (those with the other sign), c_l the product of all
halvings and stages up to l. Their squares are added to the misfit with the spectrum of the pictures
and the weight ``aliasing``. Those along y are equal, and those of other images much smaller.
"""

import itertools
import math
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
    power: FloatArray  # (C, n, n), the weights of its squares


class PairChain(Chain):
    """See `Chain`."""

    def __init__(
        self, target: SpectralTarget, shapes: Sequence[Shape], aliasing: float = 0.0
    ) -> None:
        super().__init__(target, shapes, aliasing)
        up = np.concatenate((np.ones((1, target.frequencies.size)), self._up))
        self.views = [_View(slice(None), up, up, target.wanted, target.power)]
        of_images = aliasing * target.power
        for first, image in self._images():
            self.views.append(_View(slice(first, None), image, up[first:], 0.0, of_images))
        self._w = 2.0 ** np.array([[each.level] for each in shapes]) * target.frequencies
        count, most = np.array(self.counts)[:, None], max(self.counts)
        self._has_step = np.arange(most) < count
        self._has_weight = np.arange(most + 1) <= count
        self._steps_at = np.zeros((len(shapes), most), np.intp)
        self._weights_at = np.zeros((self.channels, len(shapes), most + 1), np.intp)
        for k, own in enumerate(self.counts):
            self._steps_at[k, :own], self._weights_at[:, k, : own + 1] = self.places(k)
        self._has = np.concatenate((self._has_step, self._has_weight), axis=1)
        self._stage_of = np.nonzero(self._has)[0]  # of a channel's parameters after the blend
        ends = np.cumsum([2 * own + 1 for own in self.counts]).tolist()
        self._own_at = [slice(*each) for each in itertools.pairwise([0, *ends])]
        n = target.frequencies.size
        planes, rows = len(shapes) * n * n, ends[-1] * (len(shapes) + 1) * n
        # New, the system clears its pages: twice the time.
        self._spare = [np.empty(self.channels * size) for size in (planes, rows, rows)]

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
            weighted = view.power * apart
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
        blurs, m = self._blurs(x), self._blend(x).T
        own, after = self._slopes(blurs), self._after(blurs)
        found = np.zeros((self.size, self.size))
        for view in self.views:
            products = self._products(view, blurs.chain, own, after, m)
            for at, each in zip(self.parameters, products, strict=True):
                found[np.ix_(at, at)] += 2.0 * each
        return found

    def _products(
        self, view: _View, chain: FloatArray, own: FloatArray, after: FloatArray, m: FloatArray
    ) -> FloatArray:
        """Return the weighted products of a view's derivatives by channels' parameters, (C, p, p).

        A parameter p of stage k changes the stage's spectrum by s_p(w), and a view by

            s_p(i) G_k(i, j) + s_p(j) H_k(i, j),
            G_k(i, j) = sum_l g_kl(i) uy_l(j),    H_k(i, j) = sum_l ux_l(i) h_kl(j),

        with g_kl and h_kl what is left of m_l ux_l and m_l uy_l without that spectrum. So only G
        needs both frequencies at once, and there is one a stage, not one a parameter: .5 to .7 of
        the time. Given are the chain (C, L+1, n), s (C, p, n), the chain's derivatives by the
        stages' spectra (C, S, L+1, n) and the blend (C, L+1).
        """
        part, blend = chain[:, view.stages], m[:, view.stages]
        ux, uy = part * view.x, part * view.y  # (C, l, n)
        left = after[:, :, view.stages] * blend[:, None, :, None]
        g, h = left * view.x, left * view.y  # (C, S, l, n)
        by_x, by_y = _across(uy, view.power), _across(ux, view.power.swapaxes(1, 2))
        gx, hy = _frequencies_first(g), _frequencies_first(h)  # (C, n, S, l)
        with_x, with_y = gx @ by_x, hy @ by_y
        alike = _frequencies_last(with_x @ gx.swapaxes(2, 3) + with_y @ hy.swapaxes(2, 3))
        blended = with_x * ux.swapaxes(1, 2)[:, :, None] + with_y * uy.swapaxes(1, 2)[:, :, None]
        blended = _frequencies_last(blended)  # (C, S, l, n)
        shares = m[:, :, None] * np.eye(m.shape[1])[:, view.stages]
        shares -= m[:, :, None] * blend[:, None] / self.target.energy[:, None, None]
        squares = np.einsum("cnkl,ckn,cln->ckl", by_x, ux, ux)
        count, size = m.shape[1], m.shape[1] + own.shape[1]
        found = np.empty((len(m), size, size))
        found[:, :count, :count] = shares @ squares @ shares.swapaxes(1, 2)
        for k, at in enumerate(self._own_at):
            stages = blended[:, k] @ own[:, at].swapaxes(1, 2)
            found[:, :count, count + at.start : count + at.stop] = shares @ stages
        found[:, count:, :count] = found[:, :count, count:].swapaxes(1, 2)
        crossed = self._crossed(g, h, (ux, uy), own, view.power)
        found[:, count:, count:] = crossed + crossed.swapaxes(1, 2) + self._alike(alike, own)
        return found

    def _crossed(
        self,
        g: FloatArray,
        h: FloatArray,
        seen: tuple[FloatArray, FloatArray],
        own: FloatArray,
        power: FloatArray,
    ) -> FloatArray:
        """Return the weighted products (C, p, p) of all s_p(i) G_k(i, j) and s_p(j) H_k(i, j).

        Given are g and h (C, S, l, n), ux and uy (C, l, n), s (C, p, n) and the weights (C, n, n).
        """
        (ux, uy), (channels, count, n) = seen, own.shape
        shape = channels, count, ux.shape[1], n
        lit = _room(self._spare[0], (channels, len(self.shapes), n, n))
        np.matmul(g.swapaxes(2, 3), uy[:, None], out=lit)  # all G
        lit *= power[:, None]
        rows, moved = (_room(each, shape) for each in self._spare[1:])
        np.multiply(own[:, :, None], ux[:, None], out=rows)
        for k, at in enumerate(self._own_at):
            given, out = (each[:, at].reshape(channels, -1, n) for each in (rows, moved))
            np.matmul(given, lit[:, k], out=out)
            np.multiply(own[:, at, None], h[:, k, None], out=rows[:, at])
        left, right = (each.reshape(channels, count, -1) for each in (moved, rows))
        found: FloatArray = left @ right.swapaxes(1, 2)
        return found

    def _alike(self, alike: FloatArray, own: FloatArray) -> FloatArray:
        """Return the sums (C, p, p) of s_p s_q alike over frequencies, for alike (C, S, S, n)."""
        found = np.empty((*own.shape[:2], own.shape[1]))
        for k, at in enumerate(self._own_at):
            rows = own * alike[:, self._stage_of, k]
            found[:, :, at] = rows @ own[:, at].swapaxes(1, 2)
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
        """Return derivatives of the stages' spectra by their own parameters, (C, p, n)."""
        weights, spectrum = blurs.weights[..., None], blurs.spectrum[:, :, None]
        by_weight = weights * (blurs.fetched - blurs.copies[:, None] * spectrum)
        moved = (weights[:, :, 1:] * blurs.by_offset).swapaxes(2, 3)
        by_step = (_of_farther(moved) * blurs.step[:, None]).swapaxes(2, 3)
        return np.concatenate((by_step, by_weight), axis=2)[:, self._has]

    def _after(self, blurs: _Blurs) -> FloatArray:
        """Return the derivatives of the chain by the stages' spectra, (C, S, L+1, n)."""
        channels, stages, n = blurs.factors.shape
        found = np.zeros((channels, stages, stages + 1, n))
        for k in range(stages):
            found[:, :k, k + 1] = found[:, :k, k] * blurs.factors[:, k, None]
            found[:, k, k + 1] = blurs.chain[:, k] * self._down[k]
        return found


def _of_farther(by_offset: FloatArray) -> FloatArray:
    """Return derivatives by steps from those by offsets (..., k): a step moves all farther ones."""
    return np.cumsum(by_offset[..., ::-1], axis=-1)[..., ::-1]


def _across(other: FloatArray, power: FloatArray) -> FloatArray:
    """Return the products of the other axis's functions (C, l, n), summed over it, (C, n, l, l)."""
    pairs = other[:, :, None] * other[:, None]
    return _frequencies_first(pairs @ power.swapaxes(1, 2)[:, None])


def _frequencies_first(functions: FloatArray) -> FloatArray:
    """Return functions (C, p, q, n) as (C, n, p, q), in one piece, as BLAS wants them."""
    return np.ascontiguousarray(functions.transpose(0, 3, 1, 2))


def _frequencies_last(functions: FloatArray) -> FloatArray:
    """Return functions (C, n, p, q) as (C, p, q, n), in one piece."""
    return np.ascontiguousarray(functions.transpose(0, 2, 3, 1))


def _room(spare: FloatArray, shape: Sequence[int]) -> FloatArray:
    """Return the beginning of spare memory as an array."""
    return spare[: math.prod(shape)].reshape(shape)


def _sum(ux: FloatArray, uy: FloatArray, blend: FloatArray) -> FloatArray:
    """Return the sum over stages (C, n, n) of what the axes see, (C, l, n), blended (l, C)."""
    found: FloatArray = (ux * blend.T[:, :, None]).transpose(0, 2, 1) @ uy
    return found
