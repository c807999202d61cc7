"""Distance and slope: one table on pixels of other sizes than those it was made for.

A table's offsets are millimetres, and a shader divides them by each pixel's own size. Near by,
fetches lie so far apart that points of light fall apart; far away the whole kernel is smaller than
a pixel. Two more changes of size are those within a picture. On a tilted surface a pixel is longer
along the slope. And where pixels grow from one side of the picture to the other, a cascade reads
what neighbours have blurred by their sizes; the truth there is the exact kernel of each pixel's own
size.
"""

import functools

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.kernel import Kernel, SeparableKernel
from sssfit.render.reference import render_reference
from sssfit.render.screen import render_screen
from sssfit.render.screen_taps import render_screen_taps
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import PICTURES, SIDE, Subject, attempted, error_of
from sssfit.stability.ways import CASCADE, Way, cascade

LIMIT = 1.0  # Delta E
# Of skin1's kernel for .3 mm, 161 pixels wide, 1 288 at the first and about one at the last.
_TIMES = 2.0 ** np.arange(-3.0, 7.5)
_COLUMNS = (1, 2, 3, 4, 6)  # of square pixels that one on the slope covers: 0 to 80 degrees
_RATIOS = (1.0, 2.0, 4.0, 16.0)
_BANDS = 16  # of equal pixels, in a picture whose pixels grow
_FAR_MM = 1e7  # seen from so far that a slope is the same for all pixels
_DENSE = Way("pre-integrated", "preintegrated", {})
_PAIR = Way("pre-integrated, 25 taps", "preintegrated", {}, taps=25)
_DISK = Way("disk 24, one frame", "disk", {"taps": 24})
_CASCADES = (CASCADE, cascade(14))
KERNELS = (*_CASCADES, _PAIR, _DISK, _DENSE)
_NEAREST = "a table for each octave of pixel sizes"


def stress(subject: Subject) -> list[Panel]:
    """Show the subject's tables near by, far away, on slopes and where pixels grow."""
    flat = subject.true_kernels((*_CASCADES, _PAIR, _DISK))
    screen = subject.true_kernels((*_CASCADES, _PAIR, _DENSE))
    return [
        Panel(
            stress="distance",
            title="one table on other pixels",
            axis=Axis("pixel (times the table's)", mild=1.0),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_at_distances(subject, flat),
            fails="fetches show apart near by, whole pixels far away",
        ),
        Panel(
            stress="distance",
            title="a plane at a grazing angle",
            axis=Axis("angle (degrees)", mild=0.0, is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_tilted(subject, screen),
            fails="the slope's own pixels are too long for the table",
        ),
        Panel(
            stress="distance",
            title="pixels that grow over the picture",
            axis=Axis("largest over smallest pixel", mild=1.0),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_growing(subject, screen),
            fails="stages mix blurs of several sizes",
        ),
    ]


def _at_distances(subject: Subject, tables: dict[str, Kernel]) -> list[Curve]:
    """Return the error on pixels of other sizes, for each table."""
    errors = subject.each(functools.partial(_at_distance, tables), _TIMES.tolist())
    return _curves(tables, _TIMES, errors, _NEAREST)


def _at_distance(tables: dict[str, Kernel], subject: Subject, times: float) -> list[float]:
    pitch_mm = times * subject.mm_per_pixel
    truths = subject.truths(pitch_mm)
    works = [functools.partial(subject.error, each, truths, pitch_mm) for each in tables.values()]
    return [max(attempted(each), 1e-4) for each in works]


def _curves(
    tables: dict[str, Kernel], x: FloatArray, errors: list[list[float]], advice: str
) -> list[Curve]:
    """Return a curve for each table of errors by place and table."""
    by_table = zip(*errors, strict=True)
    return [
        Curve(label, x, np.array(y), advice=advice)
        for label, y in zip(tables, by_table, strict=True)
    ]


def _tilted(subject: Subject, tables: dict[str, Kernel]) -> list[Curve]:
    """Return the error on a plane that turns away from the eye, depth followed."""
    angles = np.degrees(np.arccos(1.0 / np.array(_COLUMNS)))
    errors = subject.each(functools.partial(_at_angle, tables), _COLUMNS)
    return _curves(
        tables, angles, errors, "offsets by each axis' own pixel, as a shader with tilt has them"
    )


def _at_angle(tables: dict[str, Kernel], subject: Subject, columns: int) -> list[float]:
    return _mean_errors(
        tables, [_on_slope(subject, each, columns) for each in PICTURES], "gaussian"
    )


def _mean_errors(
    tables: dict[str, Kernel], own: list[tuple[Scene, FloatArray]], follow: str
) -> list[float]:
    """Return each table's error, the mean over pictures with their truths."""
    return [
        float(np.mean([error_of(_on_screen(each, plane, follow), true) for plane, true in own]))
        for each in tables.values()
    ]


def _on_slope(subject: Subject, name: str, columns: int) -> tuple[Scene, FloatArray]:
    """Return a lit plane whose pixels are so many times as wide as high, and its true picture."""
    pitch_mm = subject.mm_per_pixel
    wide = make_scene(name, height=SIDE, width=SIDE * columns, mm_per_pixel=pitch_mm).irradiance
    light = wide.reshape(SIDE, SIDE, columns, -1).mean(axis=2)
    across_mm = pitch_mm * (np.arange(SIDE) - SIDE // 2)
    depth_mm = np.broadcast_to(_FAR_MM + np.sqrt(columns**2 - 1.0) * across_mm, (SIDE, SIDE))
    plane = Scene(name, light, pitch_mm, distance_mm=_FAR_MM, depth_mm=depth_mm)
    square = Scene(name, np.repeat(light, columns, axis=1), pitch_mm)
    true = render_reference(square, subject.profile, threads=1)
    return plane, true.reshape(SIDE, SIDE, columns, -1).mean(axis=2)


def _growing(subject: Subject, tables: dict[str, Kernel]) -> list[Curve]:
    """Return the error where pixels grow by a factor from the left to the right."""
    errors = subject.each(functools.partial(_with_ratio, tables), _RATIOS)
    return _curves(tables, np.array(_RATIOS), errors, _NEAREST)


def _with_ratio(tables: dict[str, Kernel], subject: Subject, ratio: float) -> list[float]:
    own = [_with_growth(subject, each, ratio) for each in subject.scenes()]
    return _mean_errors(tables, own, "none")


def _with_growth(subject: Subject, scene: Scene, ratio: float) -> tuple[Scene, FloatArray]:
    """Return a picture of pixels that grow, and what each pixel's own exact kernel makes of it.

    The pixels' sizes have the subject's as their geometric middle, in bands of a few columns.
    """
    bands = np.geomspace(ratio**-0.5, ratio**0.5, _BANDS if ratio > 1.0 else 1)
    columns = SIDE // len(bands)
    times = np.repeat(bands, columns)
    true = np.empty((SIDE, SIDE, len(subject.profile.channels)))
    for k, each in enumerate(bands.tolist()):
        own = slice(k * columns, (k + 1) * columns)
        pixels = Scene(scene.name, scene.irradiance, each * scene.mm_per_pixel)
        true[:, own] = render_reference(pixels, subject.profile, threads=1)[:, own]
    depth_mm = np.broadcast_to(_FAR_MM * times, (SIDE, SIDE))
    plane = Scene(
        scene.name, scene.irradiance, scene.mm_per_pixel, distance_mm=_FAR_MM, depth_mm=depth_mm
    )
    return plane, true


def _on_screen(kernel: Kernel, scene: Scene, follow: str) -> FloatArray:
    """Return the picture of a scene with depth."""
    if isinstance(kernel, SeparableKernel):
        return np.asarray(render_screen(scene, kernel, follow=follow, threads=1), dtype=np.float64)
    return np.asarray(render_screen_taps(scene, kernel, follow=follow, threads=1), dtype=np.float64)
