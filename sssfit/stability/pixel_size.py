"""Pixel size: from a thousandth of a mean free path, where R_d ~ 1/r is steep, to ten of them.

The measure is by how much the error grows over that on the subject's own pixels. Kernels have at
most 513 pixels, what the guided fit takes and no shader exceeds, so near-by pixels also cut them
off; of cascades only the picture's part is seen. Sizes are tried from the subject's own outward,
each method's as far as its first beyond the limit.
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
KERNELS = WAYS
_LEAST, _MOST, _STEPS = 1e-3, 10.0, 9
_STEPS_OF_CASCADES = 5
_HALF_PIXELS = 256
_FLOOR = 0.01  # Delta E, which no eye and no display shows
_ADVICE = "larger pixels near by, or a profile with finer annuli; nothing to blur far away"


def check(subject: Subject) -> None:
    """Raise FitError if the profile's mean free path is unknown."""
    _least_path_mm(subject)


def stress(subject: Subject) -> list[Panel]:
    """Fit and show the profile on pixels of .001 to 10 mean free paths."""
    path_mm = _least_path_mm(subject)
    slow = [each for each in WAYS if each.method in TAPS]
    quick = [each for each in WAYS if each.method not in TAPS]
    own = {each.label: _own_error(subject, each) for each in WAYS}
    start = subject.mm_per_pixel / path_mm
    groups = [([each], _sizes(subject, each, start)) for each in slow]
    groups.append((quick, _sizes(subject, quick[0], start)))
    work = [(ways, outward) for ways, sizes in groups for outward in _outward(sizes, start)]
    errors: dict[str, dict[float, float]] = {each.label: {start: 0.0} for each in WAYS}
    for found in subject.each(functools.partial(_more, path_mm, own), work):
        for label, more in found.items():
            errors[label].update(more)
    curves = [_curve(label, more) for label, more in errors.items()]
    return [
        Panel(
            stress="pixel-size",
            title="what another pixel size adds to the error",
            axis=Axis("pixel (mean free paths)", mild=start),
            y_label="more p99 of Delta E 2000",
            limit=LIMIT,
            curves=curves,
            fails="points of light spread or sharpen",
            floor=_FLOOR,
        )
    ]


def _least_path_mm(subject: Subject) -> float:
    paths_mm = mean_free_paths_mm(subject.profile)
    if paths_mm is None:
        raise FitError("pixel-size: the profile does not say its mean free path.")
    return float(paths_mm.min())


def _sizes(subject: Subject, way: Way, start: float) -> list[float]:
    """Return pixel sizes in mean free paths, beside the subject's."""
    steps = _STEPS if way.method not in TAPS or subject.is_whole else _STEPS_OF_CASCADES
    return [each for each in np.geomspace(_LEAST, _MOST, steps).tolist() if each != start]


def _outward(sizes: Sequence[float], start: float) -> tuple[list[float], list[float]]:
    """Return the sizes below the start and those above it, the nearest first."""
    return [each for each in sizes if each < start][::-1], [each for each in sizes if each > start]


def _curve(label: str, more: Mapping[float, float]) -> Curve:
    sizes = sorted(more)
    y = np.maximum([more[each] for each in sizes], _FLOOR)
    return Curve(label, np.array(sizes), y, advice=_ADVICE)


def _own_error(subject: Subject, way: Way) -> float:
    return attempted(lambda: subject.error(subject.true_kernel(way), subject.truths()))


def _more(
    path_mm: float,
    own: Mapping[str, float],
    subject: Subject,
    given: tuple[Sequence[Way], Sequence[float]],
) -> dict[str, dict[float, float]]:
    """Return what sizes add to methods' errors, until the limit; Gaussians begin with fewer."""
    ways, sizes = given
    found: dict[str, dict[float, float]] = {each.label: {} for each in ways}
    for size in sizes:
        for way in ways:
            error = attempted(functools.partial(_error, subject, way, size * path_mm))
            found[way.label][size] = error - own[way.label]
        ways = [each for each in ways if found[each.label][size] <= LIMIT]
    return found


def _error(subject: Subject, way: Way, pitch_mm: float) -> float:
    support_mm = min(support_of(subject.profile), _HALF_PIXELS * pitch_mm)
    reach = {} if way.method in TAPS else {"support_mm": support_mm}
    kernel = subject.fit(way, subject.profile, pitch_mm, **reach)
    return subject.error(kernel, subject.truths(pitch_mm))
