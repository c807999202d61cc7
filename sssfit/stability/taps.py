"""Taps and stages: few fetches, jitter, short numbers between passes and in tables, a firefly."""

import functools

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.compare._budget_causes import stored
from sssfit.kernel import Kernel, Taps
from sssfit.render.jitter import Jitter
from sssfit.render.taps import render_taps
from sssfit.scene.record import Scene
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import SIDE, Subject, attempted, error_of, shown
from sssfit.stability.ways import CASCADE, Way, cascade

LIMIT = 1.0  # Delta E
_FLOOR, _LEAST_GRAIN = 1e-6, 1e-3  # Delta E, for logarithmic axes
_TAPS = (5, 9, 17, 33, 65)  # a pass
_FETCHES = (7, 12, 17, 24)  # a pixel
_FETCHES_OF_PAPERS = (7, 10, 12, 14, 17, 20, 24, 36, 60)
_FORMATS = {"float32": 23, "half": 10, "r11g11b10": 6}  # bits of the fraction; blue has one less
_STORAGES = {"float64": 52, "float32": 23, "half": 10, "8-bit": 8}
_EIGHT_BITS = ("srgb8", "rgba8")
_STOPS = (0.0, 1.0, 2.0, 4.0, 6.0)  # by which the brightest light lies below 1
_STRENGTHS = (0.0, 0.5, 1.0)  # of the jitter that `Jitter` has by default
_FRAMES = 8
_BRIGHTNESS = tuple(10.0**k for k in range(7))
_THINNED = (
    Way("pre-integrated on taps", "preintegrated", {}),
    Way("svd 3 on taps", "svd", {"rank": 3}),
    Way("gaussians 4 on taps", "gaussians", {"terms": 4}),
)
_PASS = Way("pre-integrated, 25 taps", "preintegrated", {}, taps=25)
KERNELS = (CASCADE, _PASS, *(cascade(each) for each in reversed(_FETCHES)))


def stress(subject: Subject) -> list[Panel]:
    """Give kernels fewer fetches, fewer bits and brighter points."""
    tables = subject.true_kernels((CASCADE, _PASS))
    return [
        _few_fetches(subject),
        Panel(
            stress="taps",
            title="what rounding between passes adds",
            axis=Axis("bits of the fraction", mild=23.0, is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=subject.each(_rounded_pictures, tables.items()),
            fails="steps of colour in smooth light",
            floor=_FLOOR,
        ),
        Panel(
            stress="taps",
            title="what 8 bits between passes add",
            axis=Axis("brightest light (stops below 1)", mild=0.0, is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=subject.each(
                _eight_bits, [(*each, form) for each in tables.items() for form in _EIGHT_BITS]
            ),
            fails="steps of colour where light is dim",
            floor=_FLOOR,
        ),
        Panel(
            stress="taps",
            title="what jitter adds",
            axis=Axis("jitter (of the default's)", mild=0.0, is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=subject.each(
                _jittered, [(*each, frames) for each in tables.items() for frames in (1, _FRAMES)]
            ),
            fails="grain",
            floor=_LEAST_GRAIN,
        ),
        Panel(
            stress="taps",
            title="what rounding of the table adds",
            axis=Axis("bits of the fraction", mild=52.0, is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=subject.each(_rounded_table, tables.items()),
            fails="the kernel changes its energy or its width",
            floor=_FLOOR,
        ),
        Panel(
            stress="taps",
            title="one pixel brighter, half floats between passes",
            axis=Axis("brightness of one pixel", mild=1.0),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=subject.each(_firefly, tables.items()),
            fails="the pixel's light exceeds 65504 or drowns its neighbours",
            floor=_FLOOR,
        ),
    ]


def _few_fetches(subject: Subject) -> Panel:
    """Return the error over the fetches of a pixel."""
    truths = subject.truths()
    budgets = _FETCHES_OF_PAPERS if subject.is_whole else _FETCHES
    cascades = [cascade(each) for each in budgets]
    subject.prepare(reversed(cascades))

    def error(way: Way) -> float:
        return attempted(lambda: subject.error(subject.true_kernel(way), truths))

    curves = [Curve("cascade", np.array(budgets), np.array([error(each) for each in cascades]))]
    for way in _THINNED:
        thinned = [Way(way.label, way.method, way.settings, taps=n) for n in _TAPS]
        kernels = [subject.fit(each, subject.profile) for each in thinned]
        fetches = [each.fetches for each in kernels if isinstance(each, Taps)]
        errors = [subject.error(kernel, truths) for kernel in kernels]
        curves.append(Curve(way.label, np.array(fetches), np.array(errors), advice="a cascade"))
    return Panel(
        stress="taps",
        title="error of few fetches",
        axis=Axis("fetches a pixel", mild=1000.0),
        y_label="p99 of Delta E 2000",
        limit=LIMIT,
        curves=curves,
        fails="points of light fall apart",
    )


def _rounded_pictures(subject: Subject, given: tuple[str, Kernel]) -> Curve:
    label, taps = given
    assert isinstance(taps, Taps)
    scenes = subject.scenes()
    plain = subject.shows(taps)

    def error(form: str) -> float:
        pictures = [_through(each, taps, form) for each in scenes]
        return float(np.mean([error_of(a, b) for a, b in zip(pictures, plain, strict=True)]))

    forms = sorted(_FORMATS, key=lambda each: _FORMATS[each])
    errors = np.maximum([attempted(functools.partial(error, each)) for each in forms], _FLOOR)
    bits = np.array([_FORMATS[each] for each in forms])
    return Curve(label, bits, errors, advice="half floats")


def _eight_bits(subject: Subject, given: tuple[str, Kernel, str]) -> Curve:
    """Return what 255 steps add to light that uses fewer and fewer of them."""
    label, taps, form = given
    assert isinstance(taps, Taps)
    plain = subject.shows(taps)

    def error(stops: float) -> float:
        found = []
        for scene, wanted in zip(subject.scenes(), plain, strict=True):
            dim = 0.5**stops / float(scene.irradiance.max())
            light = Scene(scene.name, dim * scene.irradiance, scene.mm_per_pixel)
            found.append(error_of(_through(light, taps, form) / dim, wanted))
        return float(np.mean(found))

    errors = [attempted(functools.partial(error, each)) for each in _STOPS]
    advice = "half floats; or sRGB codes, and light near 1"
    return Curve(f"{label}, {form}", np.array(_STOPS), np.maximum(errors, _FLOOR), advice=advice)


def _jittered(subject: Subject, given: tuple[str, Kernel, int]) -> Curve:
    """Return what moved taps add to a frame, or to the mean of several."""
    label, taps, frames = given
    assert isinstance(taps, Taps)
    plain = subject.shows(taps)
    usual = Jitter()

    def error(strength: float) -> float:
        jitter = Jitter(usual.share, strength * usual.scale, strength * usual.degrees)
        pictures = [_with_jitter(scene, taps, jitter, frames) for scene in subject.scenes()]
        return float(np.mean([error_of(a, b) for a, b in zip(pictures, plain, strict=True)]))

    errors = [_LEAST_GRAIN, *(max(error(each), _LEAST_GRAIN) for each in _STRENGTHS[1:])]
    advice = "no jitter for cascades; for pairs more frames in the mean"
    name = label if frames == 1 else f"{label}, mean of {frames} frames"
    return Curve(name, np.array(_STRENGTHS), np.array(errors), advice=advice)


def _with_jitter(scene: Scene, taps: Taps, jitter: Jitter, frames: int) -> FloatArray:
    shots = [render_taps(scene, taps, jitter=jitter, frame=k, threads=1) for k in range(frames)]
    return np.asarray(np.mean(shots, axis=0), dtype=np.float64)


def _rounded_table(subject: Subject, given: tuple[str, Kernel]) -> Curve:
    label, taps = given
    plain = subject.shows(taps)
    forms = sorted(_STORAGES, key=lambda each: _STORAGES[each])
    errors = [subject.error(stored(taps, each), plain) for each in forms]
    bits = np.array([_STORAGES[each] for each in forms])
    return Curve(label, bits, np.maximum(errors, _FLOOR), advice="half floats or more")


def _firefly(subject: Subject, given: tuple[str, Kernel]) -> Curve:
    """Return what half floats do to light of 1 with one brighter pixel."""
    label, taps = given
    assert isinstance(taps, Taps)

    def error(brightness: float) -> float:
        scene = _with_firefly(subject.mm_per_pixel, brightness)
        return error_of(_through(scene, taps, "half"), shown(taps, scene))

    errors = [attempted(functools.partial(error, each)) for each in _BRIGHTNESS]
    advice = "clamp the light before the first pass"
    return Curve(label, np.array(_BRIGHTNESS), np.maximum(errors, _FLOOR), advice=advice)


def _through(scene: Scene, taps: Taps, form: str) -> FloatArray:
    """Return a picture whose passes hand it on in a format."""
    return np.asarray(render_taps(scene, taps, intermediate=form, threads=1), dtype=np.float64)


def _with_firefly(mm_per_pixel: float, brightness: float) -> Scene:
    light: FloatArray = np.full((SIDE, SIDE, 1), 0.5)
    light[SIDE // 2, SIDE // 2] = brightness
    return Scene("firefly", light, mm_per_pixel)
