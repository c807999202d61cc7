"""Grid: rings and radius of the profile from coarse to fine; where the kernel stops changing.

The measure is the difference between the pictures of a kernel from a coarser or shorter grid and of
the kernel from the subject's own, by the same method. Profiles are exact on every grid.
"""

import numpy as np

from sssfit.errors import FitError
from sssfit.methods import TAPS
from sssfit.profile import Profile
from sssfit.simulate import simulate_exact
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import Subject
from sssfit.stability.ways import WAYS, Way

LIMIT = 1.0  # Delta E
_RINGS = (1.0, 4.0, 16.0, 64.0, 256.0)  # times the width of the subject's annuli
_RADII = (0.03, 0.06, 0.125, 0.25, 0.5, 1.0)  # of the subject's


def stress(subject: Subject) -> list[Panel]:
    """Solve on wider annuli and on shorter grids.

    Raises
    ------
    FitError
        The profile's material is unknown.
    """
    if subject.material is None:
        raise FitError("grid: the profile does not say its material; give the material.")
    width_mm, radius_mm = (float(subject.profile.r_edges_mm[k]) for k in (1, -1))
    ways = [each for each in WAYS if each.method not in TAPS or subject.is_whole]
    wide = [_profile(subject, factor * width_mm, radius_mm) for factor in _RINGS]
    short = [_profile(subject, width_mm, share * radius_mm) for share in _RADII]
    return [
        Panel(
            stress="grid",
            title="what wider annuli change",
            axis=Axis("annulus (times the default)", mild=1.0),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_curves(subject, ways, _RINGS, wide, "finer annuli"),
            fails="the middle of the kernel is unresolved",
        ),
        Panel(
            stress="grid",
            title="what a shorter radius changes",
            axis=Axis("radius (share of the default)", mild=1.0),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_curves(subject, ways, _RADII, short, "a larger radius"),
            fails="light beyond the grid is lost or gathered",
        ),
    ]


def _profile(subject: Subject, dr_mm: float, radius_mm: float) -> Profile:
    assert subject.material is not None
    threads = subject.threads
    return simulate_exact(subject.material, dr_mm=dr_mm, radius_mm=radius_mm, threads=threads)


def _curves(
    subject: Subject,
    ways: list[Way],
    factors: tuple[float, ...],
    profiles: list[Profile],
    advice: str,
) -> list[Curve]:
    return [
        Curve(way.label, np.array(factors), np.maximum(errors, 1e-3), advice=advice)
        for way, errors in zip(ways, subject.changes(ways, profiles), strict=True)
    ]
