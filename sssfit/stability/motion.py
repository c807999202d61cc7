"""Motion of the camera: how the error of a point changes as it moves over the pixels.

Halved pictures see a point by its place among their texels, so light crawls. The measure is the
change of the 99th percentile of Delta E, cascade beside exact kernel, from that of the point at
rest (`sssfit.compare.motion` has its largest over all places).

A camera that nears changes the size of every pixel. From a frame to the next the picture may change
as the truth does and no more: the measure is the 99th percentile of Delta E between a frame, and
the true frame with the error that the frame before had.
"""

import functools

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.compare.motion import motion
from sssfit.kernel import Kernel, Taps
from sssfit.render.jitter import Jitter
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import SIDE, Subject, error_of, shown
from sssfit.stability.ways import CASCADE, Way, cascade

LIMIT = 0.85  # docs/cascades.md asks it of two stages before the first halving
_FLOOR = 1e-4  # Delta E, for logarithmic axes
_FETCHES = (14, 17, 24)
_SHIFTS = np.arange(0.0, 4.01, 0.5)
_SPEEDS = (0.001, 0.003, 0.01, 0.03, 0.1)  # of a pixel's size, a frame
_FRAMES = 5
# Middles of four spots of light (right, down) in pixels of the first frame, their deviation one.
_SPOTS = ((0.0, 0.0), (21.3, 7.1), (-16.4, 23.7), (9.6, -27.2))
_PAIR = Way("pre-integrated, 25 taps", "preintegrated", {}, taps=25)
_CASCADES = (
    cascade(14),
    CASCADE,
    Way("cascade 24, still", "cascade", {"fetches": 24, "still": True}),
)
_WAYS = (
    Way("pre-integrated", "preintegrated", {}),
    Way("svd 3", "svd", {"rank": 3}),
    *_CASCADES,
)
KERNELS = (*_WAYS, _PAIR, *(cascade(each) for each in _FETCHES))


def stress(subject: Subject) -> list[Panel]:
    """Move a point by half pixels, over a whole texel of the coarsest picture but one."""
    scenes = [_point(subject.mm_per_pixel, each) for each in _SHIFTS.tolist()]
    truths = [render_reference(each, subject.profile, threads=1) for each in scenes]
    kernels = subject.true_kernels(_WAYS)
    return [
        Panel(
            stress="motion",
            title="a point moved over the pixels",
            axis=Axis("moved (pixels)", mild=0.0, is_log=False),
            y_label="change of p99 of Delta E 2000",
            limit=LIMIT,
            curves=[_curve(each.label, kernels[each.label], scenes, truths) for each in _WAYS],
            fails="light crawls as the camera moves",
            is_log=False,
        ),
        Panel(
            stress="motion",
            title="a point moved by a pixel, and back",
            axis=Axis("fetches of a cascade", mild=float(_FETCHES[-1]), is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=[_moved(subject)],
            fails="one stage before the first halving: light crawls",
            is_log=False,
        ),
        Panel(
            stress="motion",
            title="a camera that nears: flicker a frame",
            axis=Axis("nearer by a frame (% of a pixel's size)", mild=100.0 * _SPEEDS[0]),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_nearing(subject),
            fails="blurs jump as texels change places",
            floor=_FLOOR,
        ),
    ]


def _nearing(subject: Subject) -> list[Curve]:
    """Return by how much errors change from frame to frame, the largest of some frames."""
    tables = subject.true_kernels((*_CASCADES, _PAIR))
    moving = {f"{each.label}, jitter": tables[each.label] for each in (CASCADE, _PAIR)}
    flickers = subject.each(functools.partial(_at_speed, tables, moving), _SPEEDS)
    percent = 100.0 * np.array(_SPEEDS)
    advice = "two stages before the first halving; no jitter"
    return [
        Curve(label, percent, np.maximum(y, _FLOOR), advice=advice)
        for label, y in zip((*tables, *moving), zip(*flickers, strict=True), strict=True)
    ]


def _at_speed(
    tables: dict[str, Kernel], moving: dict[str, Kernel], subject: Subject, speed: float
) -> list[float]:
    """Return the flicker of tables, and of those with jitter."""
    scenes = [_spots(subject.mm_per_pixel, (1.0 - speed) ** k) for k in range(_FRAMES)]
    truths = [render_reference(each, subject.profile, threads=1) for each in scenes]
    frames = [[shown(kernel, each) for each in scenes] for kernel in tables.values()]
    frames += [
        [_jittered(kernel, each, k) for k, each in enumerate(scenes)] for kernel in moving.values()
    ]
    return [_flicker(each, truths) for each in frames]


def _flicker(frames: list[FloatArray], truths: list[FloatArray]) -> float:
    """Return the largest change of the error from a frame to the next."""
    return max(
        error_of(frames[k], np.maximum(truths[k] + frames[k - 1] - truths[k - 1], 0.0))
        for k in range(1, len(frames))
    )


def _jittered(kernel: Kernel, scene: Scene, frame: int) -> FloatArray:
    assert isinstance(kernel, Taps)
    picture = render_taps(scene, kernel, jitter=Jitter(), frame=frame, threads=1)
    return np.asarray(picture, dtype=np.float64)


def _spots(mm_per_pixel: float, times: float) -> Scene:
    """Return spots of light that stay in place in mm, on pixels of so many times a size."""
    at = times * (np.arange(SIDE) + 0.5 - 0.5 * SIDE)
    light = sum(
        np.exp(-0.5 * ((at[:, None] - down) ** 2 + (at - right) ** 2)) for right, down in _SPOTS
    )
    return Scene("spots", np.asarray(light)[..., None], times * mm_per_pixel)


def _moved(subject: Subject) -> Curve:
    """Return what whole pixels change, by fetches: where stages before the first halving grow."""
    kernels = subject.true_kernels(cascade(each) for each in _FETCHES)
    changes = subject.each(_change, kernels.values())
    advice = "24 fetches, or `still`"
    return Curve("cascade", np.array(_FETCHES), np.array(changes), advice=advice)


def _change(subject: Subject, kernel: Kernel) -> float:
    return motion(kernel, subject.profile, positions=1).moved


def _curve(label: str, kernel: Kernel, scenes: list[Scene], truths: list[FloatArray]) -> Curve:
    pairs = zip(scenes, truths, strict=True)
    errors = np.array([error_of(shown(kernel, scene), truth) for scene, truth in pairs])
    advice = "two stages before the first halving, or `still`"
    return Curve(label, _SHIFTS, np.abs(errors - errors[0]), advice=advice)


def _point(mm_per_pixel: float, moved: float) -> Scene:
    """Return a point of a pixel's size, moved right and down, by the parts of pixels it covers."""
    whole, part = int(moved), moved - int(moved)
    line = np.zeros(SIDE)
    line[SIDE // 2 + whole : SIDE // 2 + whole + 2] = 1.0 - part, part
    return Scene("point", (line[:, None] * line)[..., None], mm_per_pixel)
