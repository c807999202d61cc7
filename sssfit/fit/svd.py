"""The best kernel of a given rank: the largest eigenvalues of the pixels of a profile.

Truncating the singular value decomposition of the 2D kernel is optimal in the Frobenius norm
(Eckart and Young 1936; Jimenez et al. 2015, "Separable Subsurface Scattering", supplement eqs. S.2
to S.4). The kernel K is symmetric and even in x and in y, so its decomposition is that of one
quadrant Q: with c_i copies of pixel i in a line (1 in the middle, else 2) the matrix sqrt(c_i) Q_ik
sqrt(c_k) has K's eigenvalues, and V_i / sqrt(c_i) are the eigenvectors' halves. Singular values are
absolute eigenvalues. A negative one, from noise or from the steps between annuli, gives a term of
sign -1.

Optimal terms do not have the profile's energy. By default they are scaled to it (supplement B): to
all of ||R_d||_1, including the light beyond the support and the grid, so that a wall in even light
keeps its colour. ``energy="keep"`` keeps them optimal; no kernel of the same rank has a smaller
error.
"""

import math
import operator

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.errors import FitError
from sssfit.fit._result import (
    ChannelFit,
    FitResult,
    energy_factor,
    fit_channels,
    frobenius_error,
    rescales_energy,
)
from sssfit.fit._target import Pitch, Target, make_target
from sssfit.messages import shown
from sssfit.profile import Profile

_USUAL_RANK = 3
# Up to here all eigenvalues take 4 ms, no more than a few by Lanczos. At 1237 pixels it is 90 ms
# against 6 ms, at 3932 it is seconds against 0.1 s.
_SMALL = 200


def fit_svd(
    profile: Profile,
    *,
    rank: int | None = None,
    energy: str = "rescale",
    mm_per_pixel: Pitch | None = None,
    support_mm: float | None = None,
    normalize: bool = False,
) -> FitResult:
    """Keep the largest terms of the kernel's singular value decomposition.

    Parameters
    ----------
    profile : Profile
        The profile to fit.
    rank : int, optional
        Number of terms, from 1 to the pixels of a half line, which is the full rank of the kernel.
        By default 3, or all of a smaller kernel.
    energy : str
        "rescale" (default) scales the terms of every channel to its diffuse reflectance; "keep"
        keeps them as they are, optimal in the Frobenius norm.
    mm_per_pixel, support_mm : float, optional [mm]
        Pixel size and half width of the support; see ``sssfit.fit.make_target``.
    normalize : bool
        Scale every channel to unit energy, and keep its energy in ``kernel.scale``.

    Returns
    -------
    FitResult
        Terms in descending order; ``kernel.parameters`` has each channel's ``eigenvalues`` (of the
        profile's kernel) and ``scaled_by``, their common factor.

    Raises
    ------
    FitError, ProfileError
        The rank, profile, pixel size or support is invalid.
    """
    target = make_target(profile, mm_per_pixel, support_mm)
    rank = _checked_rank(rank, target)
    rescale = rescales_energy(energy)

    def fit_channel(channel: int) -> ChannelFit:
        return _fit_channel(target, channel, rank, rescale=rescale)

    settings = {"rank": rank, "energy": energy}
    return fit_channels(
        target,
        "svd",
        fit_channel,
        settings=settings,
        normalize=normalize,
        keeps_energy=rescale,
    )


def eigenpairs(quadrant: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return a kernel's eigenvalues of largest magnitude, descending, and their eigenvectors.

    Parameters
    ----------
    quadrant : array (n, n)
        A quadrant including both axes, symmetric.
    count : int
        At most n; all other eigenvalues of the kernel of 2 n - 1 pixels are 0.

    Returns
    -------
    array (count,), array (count, n)
        Signed eigenvalues; halves of eigenvectors of unit length, positive in the middle.
    """
    root = _root_copies(len(quadrant))
    values, vectors = _largest(quadrant, root, count)
    order = np.argsort(-np.abs(values), kind="stable")[:count]
    halves = vectors[:, order].T / root
    return values[order], np.where(halves[:, :1] < 0.0, -halves, halves)


def all_eigenvalues(quadrant: FloatArray) -> FloatArray:
    """Return all eigenvalues (n,) of a quadrant (n, n), descending in magnitude.

    0.1 s for 1237 pixels, 3 s for 3932.
    """
    from scipy.linalg import eigvalsh

    root = _root_copies(len(quadrant))
    values = np.asarray(eigvalsh(root[:, None] * quadrant * root), dtype=np.float64)
    return values[np.argsort(-np.abs(values), kind="stable")]


def _root_copies(n: int) -> FloatArray:
    """Return the square root of the copies of each pixel of a half line (n,)."""
    return np.sqrt(np.where(np.arange(n) == 0, 1.0, 2.0))


def _largest(quadrant: FloatArray, root: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return eigenvalues of root_i Q_ik root_k: all if n is small, else the largest."""
    # 0.1 s that other methods do not need
    from scipy.linalg import eigh
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    n = len(quadrant)
    if n > _SMALL and 4 * count < n:
        # As a product, so that 124 MB for 3932 pixels are not stored twice.
        weighted = LinearOperator(
            (n, n), matvec=lambda x: root * (quadrant @ (root * x.ravel())), dtype=np.float64
        )
        try:
            values, vectors = eigsh(weighted, count, which="LM", v0=root, rng=0)
        except ArpackNoConvergence:
            pass  # noise can make eigenvalues nearly equal: take the slow path
        else:
            return values, vectors
    found: tuple[FloatArray, FloatArray] = eigh(root[:, None] * quadrant * root)
    return found


def _fit_channel(target: Target, channel: int, rank: int, *, rescale: bool) -> ChannelFit:
    """Return one channel's terms, and its error while its pixels are in memory."""
    quadrant = target.quadrant(channel)
    values, vectors = eigenpairs(quadrant, rank)
    signs = np.where(values < 0.0, -1.0, 1.0)
    half = np.sqrt(np.abs(values))[:, None] * vectors
    total = float(target.total[channel])
    factor = energy_factor(total, target, channel, signs, half) if rescale else 1.0
    half *= math.sqrt(factor)
    return ChannelFit(
        signs,
        half,
        f"the largest {'' if rank == 1 else f'{rank} '}of {len(quadrant)} eigenvalues",
        parameters={"eigenvalues": values.tolist(), "scaled_by": factor},
        relative_frobenius_error=frobenius_error(target, quadrant, signs, half),
    )


def _checked_rank(rank: int | None, target: Target) -> int:
    """Check that the kernel has this rank."""
    pixels, most = 2 * target.half_pixels + 1, target.half_pixels + 1
    if rank is None:
        return min(_USUAL_RANK, most)
    try:
        whole = operator.index(rank)
    except TypeError:
        raise FitError(f"rank = {shown(rank)}; expected a whole number from 1 to {most}.") from None
    if not 1 <= whole <= most:
        raise FitError(
            f"rank = {whole}; expected 1 to {most}: the kernel has {pixels} x {pixels} pixels and, "
            "being even, no more terms. Use a smaller `mm_per_pixel` or a larger support."
        )
    return whole
