"""A table of taps for a pixel size between those of two others: how a shader blends them.

A cascade is made for one pixel size p, and its error grows away from it. Between two tables of the
same structure, made for p_a and p_b, the shader mixes the numbers, not the pictures:

    t = log(p / p_a) / log(p_b / p_a),   log o = (1 - t) log o_a + t log o_b,
    w = (1 - t) w_a + t w_b,             m = (1 - t) m_a + t m_b,

so fetches stay those of one table, every stage stays an average and the energy is kept.
"""

import dataclasses
import math

import numpy as np

from sssfit.arrays import check_record
from sssfit.errors import KernelError
from sssfit.kernel.checks import checked_pitch
from sssfit.kernel.taps import Stage, Taps

# What tables have in common, and what makes it so: a fit chooses the structure by the pixel size.
_ALIKE = {
    "structure": "fit both with the same `stages`",
    "chained": "fit both with the same method",
    "channels": "fit both to profiles of the same channels",
}


def taps_between(first: Taps, second: Taps, mm_per_pixel: float) -> Taps:
    """Return the table for a pixel size between those of two tables of the same structure.

    Parameters
    ----------
    first, second : Taps
        Tables of the same material, stages and channels, for two pixel sizes.
    mm_per_pixel : float [mm]
        From the smaller to the larger of the two.

    Returns
    -------
    Taps
        Its spectral error is unknown (NaN).

    Raises
    ------
    KernelError
        The tables have other stages or channels, or the pixel size is not between theirs.
    """
    check_record("first", first, Taps, KernelError)
    check_record("second", second, Taps, KernelError)
    pitch = checked_pitch(mm_per_pixel)
    _check_alike(first, second)
    ends = first.mm_per_pixel, second.mm_per_pixel
    if not min(ends) <= pitch <= max(ends):
        raise KernelError(
            f"mm_per_pixel = {pitch:g}; expected {min(ends):g} to {max(ends):g}, between the "
            "tables' own: make one for a size beyond."
        )
    t = 0.0 if ends[0] == ends[1] else math.log(pitch / ends[0]) / math.log(ends[1] / ends[0])
    stages = [
        Stage(
            one.level,
            one.kind,
            np.exp((1.0 - t) * np.log(one.offsets_mm) + t * np.log(other.offsets_mm)),
            (1.0 - t) * one.weights + t * other.weights,
            one.angle_degrees,
        )
        for one, other in zip(first.stages, second.stages, strict=True)
    ]
    energy = (1.0 - t) * first.errors["energy"] + t * second.errors["energy"]
    return dataclasses.replace(
        first,
        mm_per_pixel=pitch,
        stages=tuple(stages),
        blend=(1.0 - t) * first.blend + t * second.blend,
        errors={"spectral": np.full(len(first.channels), np.nan), "energy": energy},
    )


def _check_alike(first: Taps, second: Taps) -> None:
    """Refuse tables whose numbers do not stand for the same."""
    for what, remedy in _ALIKE.items():
        own, other = getattr(first, what), getattr(second, what)
        if own != other:
            raise KernelError(
                f"one table has {what} {own} and the other {other}; expected the same: {remedy}."
            )
