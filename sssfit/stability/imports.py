"""Bad but plausible profiles: gaps, coarse rings, a saturated middle and a camera's noise.

Each defect is put into the subject's own profile, as measurements and other programs have it, and
the kernel's picture is compared with that of the whole profile's kernel.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.methods import TAPS
from sssfit.profile import Profile
from sssfit.profile.pixels import annulus_areas
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import Subject
from sssfit.stability.ways import WAYS, Way

LIMIT = 1.0  # Delta E
_FLOOR = 1e-3  # Delta E, for logarithmic axes
_NONE = 1e-3  # of a share, for logarithmic axes
_SHARES = (_NONE, 0.01, 0.03, 0.1, 0.3, 0.6)
_DEVIATIONS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
_RATIOS = (1.0, 1.1, 1.3, 1.6, 2.0, 4.0)

Defect = Callable[[Subject, float], Profile]


def stress(subject: Subject) -> list[Panel]:
    """Put four defects into the profile, from slight to gross."""
    defects: dict[str, tuple[Defect, tuple[float, ...], str, str]] = {
        "annuli lost in gaps": (_with_gaps, _SHARES, "share of the annuli", "fill the gaps"),
        "unequal radii": (
            _unequal,
            _RATIOS,
            "a radius over the one before",
            "finer radii near the beam",
        ),
        "a saturated middle": (
            _saturated,
            _SHARES,
            "share of the energy cut off",
            "expose shorter",
        ),
        "a camera's noise, clipped at 0": (
            _noisy,
            _DEVIATIONS,
            "deviation / peak",
            "average pictures",
        ),
    }
    ways = [each for each in WAYS if each.method not in TAPS or subject.is_whole]
    series = [[make(subject, each) for each in steps] for make, steps, *_ in defects.values()]
    changes = subject.changes(ways, series, LIMIT)
    return [
        _panel(title, ways, own, *each[1:])
        for (title, each), own in zip(defects.items(), changes, strict=True)
    ]


def _panel(
    title: str,
    ways: list[Way],
    changes: list[list[float]],
    steps: tuple[float, ...],
    label: str,
    advice: str,
) -> Panel:
    """Return what one defect changes, step by step, until the limit."""
    return Panel(
        stress="imports",
        title=title,
        axis=Axis(label, mild=steps[0]),
        y_label="p99 of Delta E 2000",
        limit=LIMIT,
        curves=[
            Curve(way.label, np.array(steps[: len(own)]), np.maximum(own, _FLOOR), advice=advice)
            for way, own in zip(ways, changes, strict=True)
        ],
        fails="the import shows in the picture, or is refused",
        floor=_FLOOR,
    )


def _with_energy(profile: Profile, energy: FloatArray) -> Profile:
    unknown = np.full(energy.shape, np.nan)
    return dataclasses.replace(profile, annulus_energy=energy, annulus_energy_stderr=unknown)


def _with_gaps(subject: Subject, share: float) -> Profile:
    """Lose every k-th run of ten annuli; nothing was written there, which reads as no light."""
    profile = subject.profile
    run, annuli = 10, profile.n_annuli
    every = max(round(run / share), run)
    lost = np.arange(annuli) % every >= every - run
    return _with_energy(profile, np.where(lost[:, None], 0.0, profile.annulus_energy))


def _unequal(subject: Subject, ratio: float) -> Profile:
    """Read annuli as one so that each radius is this many times the one before, or the next."""
    profile = subject.profile
    edges = [0, 1]
    while edges[-1] < profile.n_annuli:
        edges.append(max(edges[-1] + 1, round(ratio * edges[-1])))
    edges = edges[:-1]
    energy = np.add.reduceat(profile.annulus_energy, edges, axis=0)
    r_edges_mm = np.append(profile.r_edges_mm[edges], profile.r_edges_mm[-1])
    unknown = np.full(energy.shape, np.nan)
    return dataclasses.replace(
        profile, r_edges_mm=r_edges_mm, annulus_energy=energy, annulus_energy_stderr=unknown
    )


def _saturated(subject: Subject, share: float) -> Profile:
    """Clip R_d so that each channel loses a share of its energy in the middle."""
    profile = subject.profile
    density = profile.reflectance_per_mm2
    areas = annulus_areas(profile.r_edges_mm)[:, None]
    energy = np.empty_like(density)
    for c in range(density.shape[1]):
        levels = np.geomspace(density[:, c].max(), max(density[:, c].max() * 1e-9, 1e-300), 400)
        kept = np.array([(np.minimum(density[:, c], each) * areas[:, 0]).sum() for each in levels])
        k = int(np.searchsorted(-kept, -(1.0 - share) * kept[0]))
        level = levels[min(k, len(levels) - 1)]
        energy[:, c] = np.minimum(density[:, c], level) * areas[:, 0]
    return _with_energy(profile, energy)


def _noisy(subject: Subject, share: float) -> Profile:
    """Add noise of one deviation to R_d, as a camera's floor; below 0 fits refuse it, so clip."""
    profile = subject.profile
    rng = np.random.default_rng(subject.seed)
    density = profile.reflectance_per_mm2
    areas = annulus_areas(profile.r_edges_mm)[:, None]
    noise = share * density.max(axis=0) * rng.standard_normal(density.shape)
    return _with_energy(profile, np.maximum(density + noise, 0.0) * areas)
