"""Pixel size: from a thousandth of a mean free path, where R_d ~ 1/r is steep, to ten of them.

The measure is by how much the error grows over that on the subject's own pixels. Kernels have at
most 513 pixels, what the guided fit takes and no shader exceeds, so near-by pixels also cut them
off; of cascades only the picture's part is seen.
"""

import numpy as np

from sssfit.errors import FitError
from sssfit.fit._target import support_of
from sssfit.methods import TAPS
from sssfit.profile.bins import mean_free_paths_mm
from sssfit.stability.record import Axis, Curve, Panel
from sssfit.stability.subject import WAYS, Subject, Way, attempted

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
    curves = [_curve(subject, way, path_mm) for way in WAYS]
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


def _curve(subject: Subject, way: Way, path_mm: float) -> Curve:
    """Return what each pixel size adds to the error on the subject's pixels."""
    steps = _STEPS if way.method not in TAPS or subject.is_whole else _STEPS_OF_CASCADES
    sizes = np.unique([*np.geomspace(_LEAST, _MOST, steps), subject.mm_per_pixel / path_mm])
    own = _error(subject, way, subject.mm_per_pixel)
    errors = subject.each(lambda size: _error(subject, way, size * path_mm), sizes.tolist())
    more = np.maximum(np.array(errors) - own, _FLOOR)
    return Curve(way.label, sizes, more, advice=_ADVICE)


def _error(subject: Subject, way: Way, pitch_mm: float) -> float:
    def found() -> float:
        support_mm = min(support_of(subject.profile), _HALF_PIXELS * pitch_mm)
        reach = {} if way.method in TAPS else {"support_mm": support_mm}
        kernel = way.fit(subject.profile, pitch_mm, **reach)
        return subject.error(kernel, subject.truths(pitch_mm))

    return attempted(found)
