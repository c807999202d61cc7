"""Pixel size: from a thousandth of a mean free path, where R_d ~ 1/r is steep, to ten of them.

The measure is by how much the error grows over that on the subject's own pixels. Kernels have at
most 513 pixels, what the guided fit takes and no shader exceeds, so near-by pixels also cut them
off; of cascades only the picture's part is seen.
"""

import functools
from collections.abc import Mapping, Sequence

import numpy as np

from sssfit.errors import FitError
from sssfit.fit._target import support_of
from sssfit.methods import TAPS
from sssfit.profile.bins import mean_free_paths_mm
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import Subject, attempted
from sssfit.stability.ways import WAYS, Way

LIMIT = 1.0  # Delta E more than on the subject's pixels
_LEAST, _MOST, _STEPS = 1e-3, 10.0, 9
_STEPS_OF_CASCADES = 5
_HALF_PIXELS = 256
_FLOOR = 0.01  # Delta E, which no eye and no display shows
_ADVICE = "larger pixels near by, or a profile with finer annuli; nothing to blur far away"


def stress(subject: Subject) -> list[Panel]:
    """Fit and show the profile on pixels of .001 to 10 mean free paths.

    Raises
    ------
    FitError
        The profile's mean free path is unknown.
    """
    paths_mm = mean_free_paths_mm(subject.profile)
    if paths_mm is None:
        raise FitError("pixel-size: the profile does not say its mean free path.")
    path_mm = float(paths_mm.min())
    slow = [each for each in WAYS if each.method in TAPS]
    quick = [each for each in WAYS if each.method not in TAPS]
    work = [([way], size) for way in slow for size in _sizes(subject, way, path_mm)]
    work += [(quick, size) for size in _sizes(subject, quick[0], path_mm)]
    subject.prepare(slow)
    found = subject.each(functools.partial(_errors, path_mm), work)
    errors = {
        (way.label, size): error
        for (ways, size), own in zip(work, found, strict=True)
        for way, error in zip(ways, own, strict=True)
    }
    curves = [_curve(subject, way, path_mm, errors) for way in WAYS]
    return [
        Panel(
            stress="pixel-size",
            title="what another pixel size adds to the error",
            axis=Axis("pixel (mean free paths)", mild=subject.mm_per_pixel / path_mm),
            y_label="more p99 of Delta E 2000",
            limit=LIMIT,
            curves=curves,
            fails="points of light spread or sharpen",
        )
    ]


def _sizes(subject: Subject, way: Way, path_mm: float) -> list[float]:
    """Return pixel sizes in mean free paths, beside the subject's."""
    steps = _STEPS if way.method not in TAPS or subject.is_whole else _STEPS_OF_CASCADES
    own = subject.mm_per_pixel / path_mm
    return [each for each in np.geomspace(_LEAST, _MOST, steps).tolist() if each != own]


def _curve(
    subject: Subject, way: Way, path_mm: float, errors: Mapping[tuple[str, float], float]
) -> Curve:
    """Return what each pixel size adds to the error on the subject's pixels."""
    own = attempted(lambda: subject.error(subject.true_kernel(way), subject.truths()))
    more = {size: errors[way.label, size] - own for size in _sizes(subject, way, path_mm)}
    more[subject.mm_per_pixel / path_mm] = 0.0
    sizes = sorted(more)
    return Curve(
        way.label,
        np.array(sizes),
        np.maximum([more[each] for each in sizes], _FLOOR),
        advice=_ADVICE,
    )


def _errors(path_mm: float, subject: Subject, given: tuple[Sequence[Way], float]) -> list[float]:
    """Return the errors of methods on pixels of a size; Gaussians begin with fewer of them."""
    ways, paths = given
    return [attempted(functools.partial(_error, subject, way, paths * path_mm)) for way in ways]


def _error(subject: Subject, way: Way, pitch_mm: float) -> float:
    support_mm = min(support_of(subject.profile), _HALF_PIXELS * pitch_mm)
    reach = {} if way.method in TAPS else {"support_mm": support_mm}
    kernel = subject.fit(way, subject.profile, pitch_mm, **reach)
    return subject.error(kernel, subject.truths(pitch_mm))
