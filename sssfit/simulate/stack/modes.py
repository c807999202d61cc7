"""The eigenmodes of a layer at one wavenumber, and the light that a beam scatters into it.

Complex modes come in conjugate pairs, x and conj x, whose two columns hold Re x and Im x: all that
is done with modes then is real, at a quarter of the operations.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.arrays import FloatArray
from sssfit.simulate.stack.azimuth import Azimuth
from sssfit.simulate.stack.phase import Medium

ComplexArray = npt.NDArray[Any]  # real where all modes of a layer are
_NEVER_NEGATIVE = 1e-14  # of the largest square of a rate: a real one below is rounding
_RESONANCE = 1e-7  # of sigma_t*^2: a beam this near to a mode's rate is moved by ten times that


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Modes exp(-rate z) of the equation without a source, and the particular solution.

    Parameters
    ----------
    rate : (n,) [1/mm]
        Their real parts are positive; of a pair, the one with the positive imaginary part is first.
    along, against : (n, n)
        Columns: the radiance of a mode on the side to which it decays, and on the other one.
    beam_along, beam_against : (n,)
        The radiance scattered from a beam of power 1, exp(-sigma_t* z).
    is_rounded : bool
        Whether a rate is below rounding: its mode is the same along and against, and a layer that
        ends lets no light through.
    """

    rate: ComplexArray
    along: FloatArray
    against: FloatArray
    beam_along: FloatArray
    beam_against: FloatArray
    is_rounded: bool


def modes_of(medium: Medium, k: float, azimuth: Azimuth) -> Modes:
    """Solve A_v A_u X = X lambda^2 and (A_v A_u - sigma^2) u_p = A_v mu^-1 Q_s + sigma mu^-1 Q_d.

    u = L+ + L- and v = L+ - L- obey v' = -A_u u + mu^-1 Q_s and u' = -A_v v + mu^-1 Q_d, so that
    each mode has Y = A_u X / lambda, and the beam v_p = (A_u u_p - mu^-1 Q_s) / sigma.
    """
    a_u = _streaming_and_collision(medium, medium.even, k, azimuth)
    a_v = _streaming_and_collision(medium, medium.odd, k, azimuth)
    product = a_v @ a_u
    squares, x = np.linalg.eig(product)
    positive, is_rounded = _positive(squares)
    rate = np.sqrt(positive)
    if np.iscomplexobj(x):
        x = np.where(squares.imag < 0.0, -x.imag, x.real)
    y = times(a_u @ x, 1.0 / rate)
    sigma = medium.sigma_t
    if float(np.abs(squares - sigma**2).min()) < _RESONANCE * sigma**2:
        sigma *= 1.0 + 10.0 * _RESONANCE
    both, difference = _sources(medium, azimuth.orders)
    shifted = product - sigma**2 * np.eye(len(product))
    u = np.linalg.solve(shifted, a_v @ both + sigma * difference)
    v = (a_u @ u - both) / sigma
    return Modes(rate, 0.5 * (x + y), 0.5 * (x - y), 0.5 * (u + v), 0.5 * (u - v), is_rounded)


def times(columns: FloatArray, factor: ComplexArray) -> FloatArray:
    """Return modes, as columns (m, n), times a factor each (n,), conjugate ones for a pair."""
    if not np.iscomplexobj(factor):
        return np.asarray(columns * factor, np.float64)
    partner = np.arange(factor.size)
    partner[factor.imag != 0.0] = partner[factor.imag != 0.0].reshape(-1, 2)[:, ::-1].ravel()
    found: FloatArray = columns * factor.real - columns[:, partner] * factor.imag
    return found


def _positive(squares: ComplexArray) -> tuple[ComplexArray, bool]:
    """Return squares of rates, the real ones of which are positive, and whether any was not."""
    least = _NEVER_NEGATIVE * np.abs(squares).max()
    is_below = (squares.imag == 0.0) & (squares.real < least)
    found: ComplexArray = np.where(is_below, least, squares)
    return found, bool(is_below.any())


def _streaming_and_collision(
    medium: Medium, scattering: FloatArray, k: float, azimuth: Azimuth
) -> FloatArray:
    """Return mu^-1 (sigma_t* + k sin(theta) cos(phi) - scattering), by order and node."""
    orders, n, node = azimuth.orders, medium.n, np.arange(medium.n)
    matrix = np.zeros((orders, n, orders, n))
    for m in range(orders):
        matrix[m, :, m, :] = -scattering[m]
    along = k * medium.directions.sine[:, None, None] * azimuth.streaming
    matrix[:, node, :, node] += along + medium.sigma_t * np.eye(orders)
    matrix /= medium.directions.cosine[None, :, None, None]
    return matrix.reshape(orders * n, orders * n)


def _sources(medium: Medium, orders: int) -> tuple[FloatArray, FloatArray]:
    """Return mu^-1 Q_s and mu^-1 Q_d in variables sqrt(2 w) L; only order 0 has any."""
    found = np.zeros((2, orders * medium.n))
    scale = np.sqrt(2.0 * medium.directions.weight) / medium.directions.cosine
    found[0, : medium.n] = scale * (medium.forward + medium.backward)
    found[1, : medium.n] = scale * (medium.forward - medium.backward)
    return found[0], found[1]
