"""Offsets and weights of separable terms on taps, fitted to the kernel's spectrum as pictures are.

With amplitudes a_t of the middle and of n mirrored fetches at offsets o that all terms share,

    K^(wx, wy) = f sum_t s_t a^_t(wx) a^_t(wy),    a^_t(w) = a_t0 + sum_i a_ti beta(o_i, w),

beta the spectrum of two bilinear fetches (``_chain``) and f the factor that keeps each channel's
energy. The signs s_t are the dense kernel's. The sum of squares is minimised over the logarithms of
the offsets' steps and over the amplitudes, with its gradient.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from sssfit.arrays import FloatArray
from sssfit.fit._chain import fetches
from sssfit.fit._spectrum import SpectralTarget

_STEPS = 1000
_BARRIER = 0.01  # as of a chain's offsets beyond the kernel


@dataclass(frozen=True, slots=True, eq=False)
class _Terms:
    """The misfit of terms on taps: signs (T, C), energy (C,) and the spectrum they are to have."""

    target: SpectralTarget
    signs: FloatArray
    energy: FloatArray

    def parts(self, x: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
        """Return the steps (n,) and amplitudes (T, C, n+1) of parameters."""
        return np.exp(x[:count]), x[count:].reshape(*self.signs.shape, count + 1)

    def misfit(self, x: FloatArray, count: int) -> tuple[float, FloatArray]:
        """Return the squared misfit, and what offsets beyond the kernel add, with the gradient."""
        step, amplitudes = self.parts(x, count)
        pairs, slopes = fetches(np.cumsum(step), self.target.frequencies)
        fetched = np.concatenate((np.ones((1, pairs.shape[1])), pairs))
        seen = amplitudes @ fetched  # (T, C, n)
        signed = self.signs[:, :, None] * seen
        product = np.einsum("tci,tcj->cij", signed, seen)
        own = product[:, 0, 0]
        scale = self.energy / own
        apart = scale[:, None, None] * product - self.target.wanted
        weighted = self.target.power * apart
        by_scale = np.einsum("cij,cij->c", weighted, product)
        by_seen = 4.0 * scale[:, None] * np.einsum("tci,cij->tcj", signed, weighted)
        by_seen[:, :, 0] -= 4.0 * scale / own * by_scale * signed[:, :, 0]
        by_offset = np.einsum("tci,tcn,in->i", amplitudes[:, :, 1:], by_seen, slopes)
        last = float(step.sum())
        beyond = max(math.log(last / self.target.half_pixels), 0.0)
        by_step = np.cumsum(by_offset[::-1])[::-1] + 2.0 * _BARRIER * beyond / last
        value = float(np.vdot(weighted, apart)) + _BARRIER * beyond**2
        return value, np.concatenate((by_step * step, (by_seen @ fetched.T).ravel()))


def refined(
    target: SpectralTarget, starts: Sequence[tuple[FloatArray, FloatArray]], signs: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return better offsets and amplitudes of terms on taps, of the same energy.

    Parameters
    ----------
    target : SpectralTarget
    starts : sequence of (offsets, amplitudes)
        Offsets (n,) [pixels] and amplitudes (T, n+1, C) of the middle and of each mirrored fetch;
        the search starts from the best of them.
    signs : array (T, C)

    Returns
    -------
    offsets (n,) [pixels] and amplitudes (T, n+1, C), no worse than any start
    """
    offsets, half = starts[0]
    count, copies = offsets.size, np.where(np.arange(half.shape[1]) == 0, 1.0, 2.0)
    energy = _energy(signs, half, copies)
    terms = _Terms(target, signs, energy)
    points = [
        np.concatenate((np.log(np.diff(at, prepend=0.0)), own.transpose(0, 2, 1).ravel()))
        for at, own in starts
    ]
    found = optimize.minimize(
        terms.misfit,
        min(points, key=lambda x: terms.misfit(x, count)[0]),
        args=(count,),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": _STEPS, "maxcor": 20, "ftol": 1e-8, "gtol": 0.0},
    )
    step, amplitudes = terms.parts(found.x, count)
    amplitudes = amplitudes.transpose(0, 2, 1)
    return np.cumsum(step), amplitudes * np.sqrt(energy / _energy(signs, amplitudes, copies))


def _energy(signs: FloatArray, half: FloatArray, copies: FloatArray) -> FloatArray:
    """Return the energy (C,) of terms with amplitudes (T, n+1, C)."""
    sums: FloatArray = np.einsum("tnc,n->tc", half, copies)
    found: FloatArray = np.sum(signs * sums**2, axis=0)
    return found
