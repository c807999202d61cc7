"""Light by exit angle, all radii together: the radiance that the solver has at k = 0.

The nodes of a panel are Gauss's in a variable t (``nodes``), so that the light between two angles
is the integral of Legendre's series through them, exact for the polynomial. Where the medium above
has the least index, t is 1 - 2 alpha / pi.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.polynomial import legendre

from sssfit.arrays import FloatArray
from sssfit.material import Material
from sssfit.optics import gauss_legendre
from sssfit.simulate.stack.assembly import Assembly, leaving_by_node
from sssfit.simulate.stack.sampling import Family, KnownModes, Sampler
from sssfit.simulate.stack.slabs import SlabStack, stacks_of
from sssfit.simulate.stack.tails import Tail

# Directions; the difference of two numbers is the error that is claimed. More are used until it is
# within the tolerance; at k = 0 even the most take a tenth of a second.
_COUNTS = (28, 36, 48, 64, 96)
_GRAZING = 1e-300  # square of a cosine


def energies_by_angle(
    material: Material, edges_rad: FloatArray, tolerance: float
) -> dict[str, FloatArray]:
    """Return the fields of a profile by exit angle, (1, A, C): of all annuli together.

    Their errors are differences between two numbers of directions, or more (`tails`).

    Parameters
    ----------
    material : Material
    edges_rad : array (A+1,) [rad]
        From 0 to pi/2.
    tolerance : float
        Largest error of an angle's light that more directions are used for, a share of the light
        that leaves on a side.
    """
    stacks = stacks_of(material)
    found = {"exit_angle_edges_rad": edges_rad}
    sides = [("angle_reflected", False)]
    sides += [("angle_transmitted", True)] if stacks[0].has_bottom else []
    for name, is_below in sides:
        known = [_within(each, edges_rad, tolerance, is_below=is_below) for each in stacks]
        light, stderr = (np.stack(each, axis=1) for each in zip(*known, strict=True))
        if not is_below:
            light[0] -= material.specular_reflectance
        found |= {name: np.maximum(light, 0.0)[None], f"{name}_stderr": stderr[None]}  # rounding
    return found


def _within(
    stack: SlabStack, edges_rad: FloatArray, tolerance: float, *, is_below: bool
) -> tuple[FloatArray, FloatArray]:
    """Return light between the angles and its errors, by as many directions as are needed."""
    coarse = _by_angle(stack, _COUNTS[0], edges_rad, is_below=is_below)
    for before, count in pairwise(_COUNTS):
        fine = _by_angle(stack, count, edges_rad, is_below=is_below)
        apart, tail = fine - coarse, Tail.of(stack).over(count - before)
        off = float(np.max(tail.left(np.cumsum(apart), np.zeros_like(apart))))
        if off <= tolerance * float(np.sum(fine)):
            break
        coarse = fine
    return fine, tail.left(apart, np.zeros_like(apart))


def _by_angle(stack: SlabStack, count: int, edges_rad: FloatArray, *, is_below: bool) -> FloatArray:
    """Return the light of one side between the angles (A,), with the beam in the first."""
    sampler = Sampler(Family((stack,)), count)
    assembly = sampler.assemblies[0].mirrored if is_below else sampler.assemblies[0]
    beam = assembly.beam.transmitted if is_below else assembly.beam.reflected
    found = np.zeros(len(edges_rad) - 1)
    if stack.scattering:
        for weight, k in sampler.family.near_zero:
            modes = KnownModes(k, sampler.azimuth(k))
            leaving = leaving_by_node(assembly, k, modes.azimuth, modes)
            found += weight * _between(assembly, leaving, edges_rad)
    found[0] += beam
    return found


def _between(assembly: Assembly, leaving: FloatArray, edges_rad: FloatArray) -> FloatArray:
    """Integrate light at the nodes of the first layer over the angles outside."""
    nodes, low = assembly.nodes, 0.0
    p = assembly.eta_above * np.sin(edges_rad)
    found = np.zeros(len(edges_rad) - 1)
    for number, eta in enumerate(np.unique(nodes.lightest[: len(leaving)]).tolist()):
        if eta > assembly.eta_above + 1e-9:
            break
        own = leaving[nodes.lightest[: len(leaving)] == eta][::-1]  # ascending in t
        within = _antiderivative(own)
        x = 2.0 * _place(p, eta, low, is_first=number == 0) - 1.0
        found -= 0.5 * np.diff(within(x))
        low = eta
    return found


def _place(p: FloatArray, eta: float, low: float, *, is_first: bool) -> FloatArray:
    """Return t of invariants p in the panel from ``low`` to ``eta``; ends outside it."""
    cosine = np.sqrt(np.maximum(1.0 - (p / eta) ** 2, _GRAZING))
    if is_first:
        t = np.arcsin(np.clip(cosine, 0.0, 1.0)) * (2.0 / math.pi)
    else:
        t = cosine / math.sqrt(1.0 - (low / eta) ** 2)
    found: FloatArray = np.clip(t, 0.0, 1.0)
    return found


def _antiderivative(light: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return the integral of Legendre's series of a density, over x, from its light at nodes."""
    t, _ = gauss_legendre(light.size)
    order = np.arange(light.size)
    series = (2.0 * order + 1.0) * (light @ legendre.legvander(2.0 * t - 1.0, light.size - 1))
    whole = legendre.legint(series)

    def integral(x: FloatArray) -> FloatArray:
        found: FloatArray = np.asarray(legendre.legval(x, whole), np.float64)
        return found

    return integral
