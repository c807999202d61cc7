"""Hard light: decompositions beside a highlight 1000 times as bright, and around single points.

Few terms leave lobes beside a highlight, and terms of negative sign could take a picture below 0;
around a point the kernel's own asymmetry shows, along the axes or along the diagonals.
"""

from typing import Any

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.compare.evaluate import asymmetry_of, true_asymmetry
from sssfit.kernel import Kernel
from sssfit.render.reference import render_reference
from sssfit.scene.record import Scene
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import SIDE, Subject, error_of, shown
from sssfit.stability.ways import Way

NEGATIVE_LIMIT = 1e-3  # of the pixels: what a display would show as black holes
_FLOOR = 1e-6  # of every measure, for logarithmic axes
ASYMMETRY_LIMIT = 0.1  # a tenth of the light at a radius
LIMIT = 2.0  # Delta E
RANKS = (1, 2, 3, 4, 5, 6, 8, 10)
_BRIGHT = 1000.0
_ADVICE = "more terms, or a cascade"


def stress(subject: Subject) -> list[Panel]:
    """Show a highlight of 1000 beside light of 1, and a point, by svd of 1 to 10 terms."""
    scene = highlight(subject.mm_per_pixel)
    truth = render_reference(scene, subject.profile, threads=1)
    axis = Axis("terms", mild=float(RANKS[-1]), is_log=False)
    settings: dict[str, dict[str, Any]] = {"svd": {}, "svd, energy kept": {"energy": "keep"}}
    kernels = {label: _fits(subject, own) for label, own in settings.items()}
    return [
        Panel(
            stress="hard-light",
            axis=axis,
            title="pixels below 0 beside a highlight of 1000",
            y_label="share of the pixels",
            limit=NEGATIVE_LIMIT,
            curves=[
                _curve(label, [_negative(shown(each, scene)) for each in own])
                for label, own in kernels.items()
            ],
            fails="negative light, black in the picture",
            floor=_FLOOR,
        ),
        Panel(
            stress="hard-light",
            axis=axis,
            title="error beside a highlight of 1000",
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=[
                _curve(
                    label, [error_of(_clipped(shown(each, scene)), _clipped(truth)) for each in own]
                )
                for label, own in kernels.items()
            ],
            fails="lobes around the highlight",
            floor=_FLOOR,
        ),
        Panel(
            stress="hard-light",
            axis=axis,
            title="asymmetry of one point, over the profile's",
            y_label="share of the light at a radius",
            limit=ASYMMETRY_LIMIT,
            curves=[
                _curve(label, [unround(subject, each) for each in own])
                for label, own in kernels.items()
            ],
            fails="a cross or a diamond in place of a disk",
            floor=_FLOOR,
        ),
    ]


def _fits(subject: Subject, settings: dict[str, Any]) -> list[Kernel]:
    """Return the kernel of each rank."""
    ways = [Way("svd", "svd", settings | {"rank": rank}) for rank in RANKS]
    return [subject.fit(each, subject.profile) for each in ways]


def highlight(mm_per_pixel: float) -> Scene:
    """Return light of 1 with a highlight of 1000, 5 pixels wide, in its middle."""
    light = np.ones((SIDE, SIDE, 1))
    middle = slice(SIDE // 2 - 2, SIDE // 2 + 3)
    light[middle, middle] = _BRIGHT
    return Scene("highlight", light, mm_per_pixel)


def unround(subject: Subject, kernel: Kernel) -> float:
    """Return by how much a kernel's asymmetry exceeds that of the profile on the same pixels."""
    more = asymmetry_of(kernel) - true_asymmetry(kernel, subject.profile)
    return float(np.nanmax(more, initial=0.0))


def _curve(label: str, values: list[float]) -> Curve:
    return Curve(label, np.array(RANKS), np.maximum(values, _FLOOR), advice=_ADVICE)


def _negative(picture: FloatArray) -> float:
    return float((picture < 0.0).any(axis=2).mean())


def _clipped(picture: FloatArray) -> FloatArray:
    """Return a picture as a camera exposed for the light of 1 sees it."""
    return np.clip(picture, 0.0, 1.0)
