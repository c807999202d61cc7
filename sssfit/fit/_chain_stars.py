"""The misfit of a chain with stars or turned stages: its spectrum has two dimensions throughout.

A pass along the direction (y, x) fetches at o (y, x), between texels along both axes, and has the
spectrum

    v_0 + 2 sum_i v_i Re(f(o_i y, wy) f(o_i x, wx)),
    f(o, w) = (1 - f) e^(i w k) + f e^(i w (k + 1)),    k = floor(o), f = o - k.

Without single lines every spectrum stays the same if the axes are exchanged, so the frequencies of
a triangle stand for all; see ``_chain``. The images that halved pictures show along x
(``_chain_pairs``) change with the exchange, so both orders of a place in the triangle are summed.
Lines come with their mirror images and are shown behind
all of them, so that a quadrant stands for all.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.fit._chain import Chain, fetches, normalised, texels_of
from sssfit.fit._spectrum import SpectralTarget
from sssfit.kernel.structure import Shape, directions

ComplexArray = npt.NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class _Blur:
    """A stage at some parameters: its spectrum (C, M) and derivatives (C, parameters, M)."""

    spectrum: FloatArray
    slopes: FloatArray

    def gradient(self, by_blur: FloatArray) -> FloatArray:
        """Return derivatives by the stage's parameters (C, p) from those by its spectrum (C, M)."""
        found: FloatArray = np.einsum("cm,cpm->cp", by_blur, self.slopes)
        return found


@dataclass(frozen=True, slots=True, eq=False)
class _Star:
    """A star at some parameters; its derivatives take three times as long as its spectrum.

    Attributes
    ----------
    spectrum : array (C, M)
    weights : array (C, 3)
    copies : array (3,)
        How many fetches have each weight.
    fetched, moved : array (3, M), (2, M)
        The fetches' spectra, and the derivatives of the last two by their offsets' logarithms.
    """

    spectrum: FloatArray
    weights: FloatArray
    copies: FloatArray
    fetched: FloatArray
    moved: FloatArray

    @property
    def slopes(self) -> FloatArray:
        """Derivatives (C, 5, M)."""
        weights, copies = self.weights[:, :, None], self.copies[:, None]
        by_weight = weights * (self.fetched - copies * self.spectrum[:, None, :])
        return np.concatenate((weights[:, 1:] * self.moved, by_weight), axis=1)

    def gradient(self, by_blur: FloatArray) -> FloatArray:
        """Return derivatives by the stage's parameters (C, 5) from those by its spectrum (C, M)."""
        of_all = np.einsum("cm,cm->c", by_blur, self.spectrum)[:, None]
        by_weight = self.weights * (by_blur @ self.fetched.T - self.copies * of_all)
        return np.concatenate((self.weights[:, 1:] * (by_blur @ self.moved.T), by_weight), axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _View:
    """One fitted sum over stages: what the chain up to each stage is multiplied by."""

    first: int  # of the sum; the irradiance is 0, the first stage 1
    factors: FloatArray  # (L+1 - first, M)
    wanted: FloatArray | float
    power: FloatArray  # (C, M), of its squares


class StarChain(Chain):
    """See `Chain`; M is the number of frequencies (wx, wy) of the triangle."""

    def __init__(
        self, target: SpectralTarget, shapes: Sequence[Shape], aliasing: float = 0.0
    ) -> None:
        super().__init__(target, shapes, aliasing)
        count = target.frequencies.size
        self._x, self._y = np.tril_indices(count)
        self._twice = np.where(self._x == self._y, 1.0, 2.0)
        self._has_lines = any(each.kind == "line" for each in shapes)
        if self._has_lines:
            self._x, self._y = (each.ravel() for each in np.indices((count, count)))
            self._twice = np.ones(count**2)
        self._power = target.power[:, self._x, self._y]
        self._wanted = target.wanted[:, self._x, self._y]
        self._halvings = self._both(self._down)
        self._views = self._all_views()
        self._kept = np.empty((self.channels, self.parameters[0].size, self._x.size))

    def spectrum(self, x: FloatArray) -> FloatArray:
        """Return the chain's spectrum (C, n, n)."""
        count = self.target.frequencies.size
        found = np.empty((self.channels, count, count))
        rows = self._blend(x)[:, :, None] * self._views[0].factors[:, None]
        flat = np.einsum("lcm,lcm->cm", rows, self._chain(self._blurs(x)))
        found[:, self._y, self._x] = flat  # the other half, where there is a triangle
        found[:, self._x, self._y] = flat
        return found

    def misfit(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Return the sum over channels of the squared relative misfit, and its gradient."""
        blurs, m = self._blurs(x), self._blend(x)
        chain = self._chain(blurs)  # (L+1, C, M)
        value, by_blend, by_chain = 0.0, np.zeros_like(m), np.zeros_like(chain)
        for view in self._views:
            part, own = chain[view.first :], m[view.first :]
            rows = own[:, :, None] * view.factors[:, None]
            apart = np.einsum("lcm,lcm->cm", rows, part) - view.wanted
            weighted = view.power * apart
            value += float(np.vdot(weighted, apart))
            rows *= 2.0 * weighted
            by_chain[view.first :] += rows
            by_blend[view.first :] += np.einsum("lcm,lcm->lc", rows, part)
        share = m / self.target.energy
        gradient = np.empty(self.size)
        gradient[: m.size] = (by_blend - share * by_blend.sum(axis=0)).ravel()
        self._backwards(blurs, chain, by_chain, gradient)
        return value, gradient

    def matrix(self, x: FloatArray) -> FloatArray:
        """Return the Gauss-Newton part of its second derivatives, (size, size)."""
        blurs, m = self._blurs(x), self._blend(x)
        chain, slopes = self._chain(blurs), [each.slopes for each in blurs]
        found = np.zeros((self.size, self.size))
        for view in self._views:
            rows = self._rows(view, blurs, slopes, chain, m)
            rows *= np.sqrt(view.power)[:, None]
            for c in range(self.channels):
                own = self.parameters[c]
                found[np.ix_(own, own)] += 2.0 * rows[c] @ rows[c].T
        return found

    def _rows(
        self,
        view: _View,
        blurs: Sequence[_Blur | _Star],
        slopes: Sequence[FloatArray],
        chain: FloatArray,
        m: FloatArray,
    ) -> FloatArray:
        """Return a view's derivatives by a channel's blend and stages, (C, L+1 + parameters, M).

        They stand in ``_kept``: the system clears the pages of new arrays.
        """
        by_blend, by_stage = np.split(self._kept, [len(m)], axis=1)
        shown = np.zeros_like(chain)
        np.multiply(chain[view.first :], view.factors[:, None], out=shown[view.first :])
        shown -= np.einsum("lc,lcm->cm", m, shown) / self.target.energy[:, None]
        np.multiply(m.T[:, :, None], shown.transpose(1, 0, 2), out=by_blend)
        after, end = np.zeros(chain.shape[1:]), by_stage.shape[1]
        for k in range(len(blurs) - 1, -1, -1):
            if k + 1 >= view.first:
                after += m[k + 1][:, None] * view.factors[k + 1 - view.first]
            after *= self._halvings[k]
            begin = end - slopes[k].shape[1]
            np.multiply((chain[k] * after)[:, None], slopes[k], out=by_stage[:, begin:end])
            after, end = after * blurs[k].spectrum, begin
        return self._kept

    def _all_views(self) -> list[_View]:
        """Return the kernel, and what aliasing adds to each level, where it counts."""
        up = np.concatenate((np.ones((1, self.target.frequencies.size)), self._up))
        views = [_View(0, self._both(up), self._wanted, self._power * self._twice)]
        power = 0.5 * self.aliasing * self._power * self._twice
        for first, image in self._images():
            for x, y in ((self._x, self._y), (self._y, self._x)):
                views.append(_View(first, image[:, x] * up[first:, y], 0.0, power))
        return views

    def _both(self, line: FloatArray) -> FloatArray:
        """Return f(wx) f(wy) of spectra (..., n) along an axis."""
        product: FloatArray = line[..., self._x] * line[..., self._y]
        return product

    def _blurs(self, x: FloatArray) -> list[_Blur | _Star]:
        made: dict[str, Callable[[FloatArray, FloatArray, int], _Blur | _Star]] = {
            "pair": self._pair,
            "star": self._star,
            "line": self._turned,
        }
        kinds = ["line" if each.angle_degrees else each.kind for each in self.shapes]
        return [made[kind](*self._stage(x, k), k) for k, kind in enumerate(kinds)]

    def _frequencies(self, k: int) -> FloatArray:
        return 2.0 ** self.shapes[k].level * self.target.frequencies

    def _pair(self, steps: FloatArray, logits: FloatArray, k: int) -> _Blur:
        step = texels_of(steps)
        weights, copies = normalised(logits)
        pairs, by_offset = fetches(np.cumsum(step), self._frequencies(k))
        fetched = np.concatenate((np.ones((1, pairs.shape[1])), pairs))
        line = weights @ fetched
        by_weight = weights[:, :, None] * (fetched - copies[:, None] * line[:, None, :])
        by_step = _of_farther(weights[:, 1:, None] * by_offset) * step[:, None]
        slopes = np.concatenate((by_step, by_weight), axis=1)
        across = slopes[..., self._x] * line[:, None, self._y]
        return _Blur(self._both(line), across + slopes[..., self._y] * line[:, None, self._x])

    def _turned(self, steps: FloatArray, logits: FloatArray, k: int) -> _Blur:
        """Return the blur of a line, or of a pair that is turned."""
        step = texels_of(steps)
        weights, copies = normalised(logits)
        first, *others = (
            self._line(step, (weights, copies), direction, k)
            for direction in directions(self.shapes[k])
        )
        for other in others:
            slopes = other.slopes * first.spectrum[:, None] + other.spectrum[:, None] * first.slopes
            first = _Blur(other.spectrum * first.spectrum, slopes)
        return first

    def _line(
        self,
        step: FloatArray,
        weighted: tuple[FloatArray, FloatArray],
        direction: tuple[float, float],
        k: int,
    ) -> _Blur:
        """Return the blur of a stage's passes in one direction."""
        weights, copies = weighted
        pairs, by_offset = self._along(np.cumsum(step), direction, k)
        fetched = np.concatenate((np.ones((1, self._x.size)), pairs))
        line = weights @ fetched
        by_weight = weights[:, :, None] * (fetched - copies[:, None] * line[:, None, :])
        by_step = _of_farther(weights[:, 1:, None] * by_offset) * step[:, None]
        return _Blur(line, np.concatenate((by_step, by_weight), axis=1))

    def _along(
        self, offsets: FloatArray, direction: tuple[float, float], k: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return the spectra (n, M) of mirrored fetches in a direction, and slopes by offset."""
        w, (down, right) = self._frequencies(k), direction
        (y, by_y), (x, by_x) = _waves(offsets * down, w), _waves(offsets * right, w)
        if self._has_lines:  # all pairs of frequencies: half the time of taking them one by one
            y, by_y, x, by_x = y[:, None], by_y[:, None], x[..., None], by_x[..., None]
        else:
            y, by_y, x, by_x = y[:, self._y], by_y[:, self._y], x[:, self._x], by_x[:, self._x]
        fetched, moved = 2.0 * (y * x).real, 2.0 * (down * by_y * x + right * y * by_x).real
        return fetched.reshape(offsets.size, -1), moved.reshape(offsets.size, -1)

    def _star(self, steps: FloatArray, logits: FloatArray, k: int) -> _Star:
        offsets = texels_of(steps)
        weights, copies = normalised(logits, "star")
        (diagonal, axis), (by_diagonal, by_axis) = fetches(offsets, self._frequencies(k))
        corners, beside = self._both(diagonal), axis[self._x] + axis[self._y]
        fetched = np.stack((np.ones(corners.size), corners, beside))
        turned = by_diagonal[self._x] * diagonal[self._y] + diagonal[self._x] * by_diagonal[self._y]
        moved = np.stack((turned, by_axis[self._x] + by_axis[self._y])) * offsets[:, None]
        return _Star(weights @ fetched, weights, copies, fetched, moved)

    def _chain(self, blurs: Sequence[_Blur | _Star]) -> FloatArray:
        """Return the product of all stages and halvings up to each stage, (L+1, C, M)."""
        found = np.ones((len(blurs) + 1, self.channels, self._x.size))
        for k, blur in enumerate(blurs):
            found[k + 1] = found[k] * (self._halvings[k] * blur.spectrum)
        return found

    def _backwards(
        self,
        blurs: Sequence[_Blur | _Star],
        chain: FloatArray,
        by_rows: FloatArray,
        gradient: FloatArray,
    ) -> None:
        """Fill in the gradient by the stages from that by their chain (L+1, C, M)."""
        by_chain = np.zeros(chain.shape[1:])
        for k in range(len(blurs) - 1, -1, -1):
            by_chain = by_chain + by_rows[k + 1]
            by_blur = by_chain * chain[k] * self._halvings[k]
            self._put_stage(gradient, k, blurs[k].gradient(by_blur))
            by_chain = by_chain * (self._halvings[k] * blurs[k].spectrum)


def _of_farther(by_offset: FloatArray) -> FloatArray:
    """Turn derivatives by offsets (C, k, n) into those by steps: a step moves all farther ones."""
    for i in range(by_offset.shape[1] - 2, -1, -1):  # a third of np.cumsum's time along this axis
        by_offset[:, i] += by_offset[:, i + 1]
    return by_offset


def _waves(offsets: FloatArray, w: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return the spectra (n, len(w)) of bilinear fetches along an axis, and slopes by offset."""
    whole = np.floor(offsets)[:, None]
    near, far = np.exp(1j * whole * w), np.exp(1j * (whole + 1.0) * w)
    return near + (offsets[:, None] - whole) * (far - near), far - near
