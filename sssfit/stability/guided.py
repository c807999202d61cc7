"""Guided: the one-pass fit over its guide's k and b and over its number of pixels.

The paper draws k = 1.55, sees nothing beyond 4, and calls moderate changes of b harmless.
"""

import functools
from collections.abc import Callable

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit import FitResult, fit_guided
from sssfit.fit._result import fit_channels
from sssfit.fit.guided import extents_of, fit_one_pass, guided_target
from sssfit.stability.curve import Axis, Curve
from sssfit.stability.panel import Panel
from sssfit.stability.subject import PICTURES, Subject, attempted

LIMIT = 1.0  # Delta E
DRAWN_K, DRAWN_B = 1.55, 50.0
STOPPED_LIMIT = 0.0  # channels that stop before they converge
_KS = (0.0, 0.5, 1.0, 1.55, 2.0, 3.0, 4.0, 5.0, 6.0)
_BS = (5.0, 12.5, 25.0, 50.0, 100.0, 200.0, 500.0)
_PIXELS = (9, 17, 33, 65, 129, 257, 513)
_SPREADS, _STARTS = (0.1, 1.0, 10.0), 8
_FLOOR, _LEAST_ENERGY = 1e-3, 1e-12  # Delta E and a share, for logarithmic axes
_ADVICE_K, _ADVICE_B = "k between 1 and 4", "b near 50"


def stress(subject: Subject) -> list[Panel]:
    """Change k from 0 to 6, b from 5 to 500, the start, and fit 9 to 513 pixels."""
    own = subject.shows(_fit(subject, DRAWN_K, DRAWN_B).kernel)
    by_k, by_b = (
        np.array(subject.each(functools.partial(_change, own), given))
        for given in ([(k, DRAWN_B) for k in _KS], [(DRAWN_K, b) for b in _BS])
    )
    starts = [(each, number) for each in _SPREADS for number in range(_STARTS)]
    by_start = np.array(subject.each(functools.partial(_from_start, own), starts))
    by_pixels = subject.each(_on_pixels, reversed(_PIXELS))[::-1]
    misses = [abs(float(each.energy_error[0])) for each in by_pixels]
    early = [_stopped_early(each) for each in by_pixels]
    return [
        Panel(
            stress="guided",
            title="what another k changes",
            axis=Axis("k", mild=DRAWN_K, is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_by_picture(_KS, by_k, _ADVICE_K),
            fails="near and far light trade places",
            floor=_FLOOR,
        ),
        Panel(
            stress="guided",
            title="what another b changes",
            axis=Axis("b", mild=DRAWN_B),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=_by_picture(_BS, by_b, _ADVICE_B),
            fails="the guide's cross widens or vanishes",
            floor=_FLOOR,
        ),
        Panel(
            stress="guided",
            title=f"what {_STARTS} other starts change",
            axis=Axis("standard deviation of the start's logarithms", mild=_SPREADS[0]),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=[_by_start(by_start.reshape(len(_SPREADS), _STARTS))],
            fails="the search ends elsewhere",
            floor=_FLOOR,
        ),
        Panel(
            stress="guided",
            title="energy that the constraint misses",
            axis=Axis("pixels of the pass", mild=float(_PIXELS[2])),
            y_label="share of the energy",
            limit=1e-6,
            curves=[Curve("guided", np.array(_PIXELS), np.maximum(misses, _LEAST_ENERGY))],
            fails="the constraint is violated",
            floor=_LEAST_ENERGY,
        ),
        Panel(
            stress="guided",
            title="channels that stop before they converge",
            axis=Axis("pixels of the pass", mild=float(_PIXELS[2])),
            y_label="channels",
            limit=STOPPED_LIMIT,
            curves=[Curve("guided", np.array(_PIXELS), np.array(early), advice="fewer pixels")],
            fails="the search runs out of steps",
            is_log=False,
        ),
    ]


def _fit(
    subject: Subject,
    k: float,
    b: float,
    begin: Callable[[FloatArray], FloatArray] | None = None,
) -> FitResult:
    """Fit as `fit_guided` does, which refuses a k above the paper's 4."""
    target = guided_target(subject.profile, subject.mm_per_pixel, None)
    extents_mm = extents_of(target)
    return fit_channels(
        target,
        "guided",
        lambda channel: fit_one_pass(target, channel, extents_mm[channel], k, b, 1.0, begin),
        settings={"k": k, "b": b},
    )


def _change(own: list[FloatArray], subject: Subject, given: tuple[float, float]) -> list[float]:
    """Return what k and b change of each picture."""
    return subject.errors(_fit(subject, *given).kernel, own)


def _from_start(own: list[FloatArray], subject: Subject, given: tuple[float, int]) -> float:
    """Return what a start changes whose pixels are each off by a random factor."""
    spread, number = given
    rng = np.random.default_rng((subject.seed, number))

    def begin(line: FloatArray) -> FloatArray:
        started: FloatArray = line * np.exp(spread * rng.standard_normal(line.size))
        return started

    return attempted(lambda: subject.error(_fit(subject, DRAWN_K, DRAWN_B, begin).kernel, own))


def _by_picture(x: tuple[float, ...], changes: FloatArray, advice: str) -> list[Curve]:
    """Return the mean over the pictures, and each of them, of changes (N, pictures)."""
    labels = ("guided", *(f"guided, {each}" for each in PICTURES))
    values = np.column_stack((changes.mean(axis=1), changes))
    return [
        Curve(label, np.array(x), np.maximum(y, _FLOOR), advice=advice)
        for label, y in zip(labels, values.T, strict=True)
    ]


def _by_start(changes: FloatArray) -> Curve:
    """Return the median over starts, and the range, of changes (N, starts)."""
    changes = np.maximum(changes, _FLOOR)
    ends = changes.min(axis=1), changes.max(axis=1)
    return Curve("guided", np.array(_SPREADS), np.median(changes, axis=1), *ends)


def _on_pixels(subject: Subject, pixels: int) -> FitResult:
    """Fit the middle of the profile, on the subject's pixels as far as they reach."""
    support_mm = pixels // 2 * subject.mm_per_pixel
    reach_mm = float(subject.profile.r_edges_mm[-1])
    pitch_mm = subject.mm_per_pixel * min(1.0, reach_mm / support_mm)
    support_mm = pixels // 2 * pitch_mm
    return fit_guided(subject.profile, mm_per_pixel=pitch_mm, support_mm=support_mm)


def _stopped_early(found: FitResult) -> float:
    return float(sum("converged" not in each for each in found.stop_reasons))
