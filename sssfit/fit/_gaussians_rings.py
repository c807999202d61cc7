"""What a sum of Gaussians is fitted to: the profile's annuli, finer ones where the beam is steep.

Where R_d ~ 1/r the integral of r R^2 has no limit as the innermost annulus narrows: which Gaussians
are best depends on how finely one looks. Pixels look no finer than their half width, so there the
innermost annuli are cut to that. On the exact profile of skin1 at p = dr, where a pixel's half
width is half an annulus, that takes the error of six Gaussians on the kernel from 0.18 to 0.023
(cut into 4 and 8: 0.030 and 0.044); at p = 3 dr annuli are as they are, 0.016. Smooth profiles are
left alone, since no interpolation is as exact as their own annuli.
"""

import math

import numpy as np

from sssfit._disks import PARTS_PER_ANNULUS, SUBDIVIDED_ANNULI, annulus_areas
from sssfit.fit._target import FloatArray, Target

# Merging the first two annuli lowers int r R^2 dr by this share or more: 16 to 33 % where R_d ~ 1/r
# (the exact profiles of four materials), under 0.6 % for dipoles on grids five times too coarse.
_STEEP = 0.05


def is_steep(target: Target, channel: int) -> bool:
    """Whether the objective depends on how finely one looks at the beam; see ``_STEEP``."""
    energy = target.profile.annulus_energy[:, channel]
    energy = energy / energy.sum()  # else the squares of a faint profile are 0
    areas = annulus_areas(target.profile.r_edges_mm)
    norm = float(np.sum(energy**2 / areas))
    apart = float(np.sum(energy[:2] ** 2 / areas[:2]))
    together = float(energy[:2].sum() ** 2 / areas[:2].sum())
    return apart - together > _STEEP * norm


def rings(target: Target, channel: int) -> tuple[FloatArray, FloatArray]:
    """Return the edges (m+1,) [mm] and energies (m,) that a channel is fitted to.

    The profile's own, unless it is steep: then the ten innermost annuli are cut into equal parts no
    wider than half a pixel, by the profile's monotone interpolation of F.
    """
    profile = target.profile
    edges_mm, energy = profile.r_edges_mm, profile.annulus_energy[:, channel]
    parts = math.ceil(min(2.0 * edges_mm[1] / target.mm_per_pixel, PARTS_PER_ANNULUS) - 1e-9)
    if parts == 1 or not is_steep(target, channel):
        return edges_mm, energy
    split = min(SUBDIVIDED_ANNULI, profile.n_annuli)
    places = np.arange(split * parts + 1) / parts
    inner_mm = np.interp(places, np.arange(split + 1), edges_mm[: split + 1])
    inner = np.diff(profile.cumulative_at(inner_mm)[:, channel])
    return np.append(inner_mm, edges_mm[split + 1 :]), np.append(inner, energy[split:])
