"""Grid: rings and radius of the profile from coarse to fine; where the kernel stops changing.

The measure is the difference between the pictures of a kernel from a coarser or shorter grid and of
the kernel from the subject's own, by the same method. Annuli are the subject's, gathered or left
out, so energies are those of the subject's profile on every grid.
"""

import dataclasses

import numpy as np

from sssfit.methods import TAPS
from sssfit.profile import Profile
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import Subject
from sssfit.stability.ways import WAYS, Way

LIMIT = 1.0  # Delta E
_FLOOR = 1e-3  # Delta E, for logarithmic axes
_RINGS = (1.0, 4.0, 16.0, 64.0, 256.0)  # times the width of the subject's annuli
_RADII = (1.0, 0.5, 0.25, 0.125, 0.06, 0.03)  # of the subject's


def stress(subject: Subject) -> list[Panel]:
    """Gather annuli into wider ones, and end the grid sooner."""
    ways = [each for each in WAYS if each.method not in TAPS or subject.is_whole]
    annuli = subject.profile.n_annuli
    wide = [gathered(subject.profile, int(each), annuli) for each in _RINGS]
    short = [gathered(subject.profile, 1, max(round(each * annuli), 1)) for each in _RADII]
    by_ring, by_radius = subject.changes(ways, [wide, short], LIMIT)
    return [
        Panel(
            stress="grid",
            title="what wider annuli change",
            axis=Axis("annulus (times the default)", mild=1.0),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_curves(ways, _RINGS, by_ring, "finer annuli"),
            fails="the middle of the kernel is unresolved",
            floor=_FLOOR,
        ),
        Panel(
            stress="grid",
            title="what a shorter radius changes",
            axis=Axis("radius (share of the default)", mild=1.0),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_curves(ways, _RADII, by_radius, "a larger radius"),
            fails="light beyond the grid is lost or gathered",
            floor=_FLOOR,
        ),
    ]


def gathered(profile: Profile, together: int, annuli: int) -> Profile:
    """Return so many of a profile's annuli, several to one; the last has what is left of them."""
    first = np.arange(0, annuli, together)
    edges = np.append(first, annuli)
    energy = np.add.reduceat(profile.annulus_energy[:annuli], first, axis=0)
    unknown = np.full(energy.shape, np.nan)
    return dataclasses.replace(
        profile,
        r_edges_mm=profile.r_edges_mm[edges],
        annulus_energy=energy,
        annulus_energy_stderr=unknown,
        beyond_grid=profile.beyond_grid + profile.annulus_energy[annuli:].sum(axis=0),
        beyond_grid_stderr=np.full(profile.n_channels, np.nan),
    )


def _curves(
    ways: list[Way], factors: tuple[float, ...], changes: list[list[float]], advice: str
) -> list[Curve]:
    """Return curves that end behind the first measure beyond the limit, ascending."""
    found = []
    for way, own in zip(ways, changes, strict=True):
        x = np.array(factors[: len(own)])
        order = np.argsort(x)
        y = np.maximum(own, _FLOOR)[order]
        found.append(Curve(way.label, x[order], y, advice=advice))
    return found
