"""Guided: the one-pass fit over its guide's k and b and over its number of pixels.

The paper draws k = 1.55, sees nothing beyond 4, and calls moderate changes of b harmless.
"""

import functools

import numpy as np

from sssfit.arrays import FloatArray
from sssfit.fit import FitResult, fit_guided
from sssfit.fit._result import fit_channels
from sssfit.fit.guided import extents_of, fit_one_pass, guided_target
from sssfit.stability.record import Axis, Curve, Panel
from sssfit.stability.subject import Subject

LIMIT = 1.0  # Delta E
DRAWN_K, DRAWN_B = 1.55, 50.0
STOPPED_LIMIT = 0.0  # channels that stop before they converge
_KS = (0.0, 0.5, 1.0, 1.55, 2.0, 3.0, 4.0, 5.0, 6.0)
_BS = (5.0, 12.5, 25.0, 50.0, 100.0, 200.0, 500.0)
_PIXELS = (9, 17, 33, 65, 129, 257, 513)
_ADVICE_K, _ADVICE_B = "k between 1 and 4", "b near 50"


def stress(subject: Subject) -> list[Panel]:
    """Change k from 0 to 6, b from 5 to 500, and fit 9 to 513 pixels."""
    own = subject.shows(_fit(subject, DRAWN_K, DRAWN_B).kernel)
    nearest = functools.partial(_change, subject, own)
    by_k = subject.each(lambda k: nearest(_fit(subject, k, DRAWN_B)), _KS)
    by_b = subject.each(lambda b: nearest(_fit(subject, DRAWN_K, b)), _BS)
    by_pixels = subject.each(functools.partial(_on_pixels, subject), _PIXELS)
    misses = [abs(float(each.energy_error[0])) for each in by_pixels]
    early = [_stopped_early(each) for each in by_pixels]
    return [
        Panel(
            stress="guided",
            title="what another k changes",
            axis=Axis("k", mild=DRAWN_K, is_log=False),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=[Curve("guided", np.array(_KS), np.maximum(by_k, 1e-3), advice=_ADVICE_K)],
            fails="near and far light trade places",
        ),
        Panel(
            stress="guided",
            title="what another b changes",
            axis=Axis("b", mild=DRAWN_B),
            y_label="p99 of Delta E 2000",
            limit=LIMIT,
            curves=[Curve("guided", np.array(_BS), np.maximum(by_b, 1e-3), advice=_ADVICE_B)],
            fails="the guide's cross widens or vanishes",
        ),
        Panel(
            stress="guided",
            title="energy that the constraint misses",
            axis=Axis("pixels of the pass", mild=float(_PIXELS[2])),
            y_label="share of the energy",
            limit=1e-6,
            curves=[Curve("guided", np.array(_PIXELS), np.maximum(misses, 1e-12), advice="")],
            fails="the constraint is violated",
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


def _fit(subject: Subject, k: float, b: float) -> FitResult:
    """Fit as `fit_guided` does, which refuses a k above the paper's 4."""
    target = guided_target(subject.profile, subject.mm_per_pixel, None)
    extents_mm = extents_of(target)
    return fit_channels(
        target,
        "guided",
        lambda channel: fit_one_pass(target, channel, extents_mm[channel], k, b, 1.0),
        settings={"k": k, "b": b},
    )


def _on_pixels(subject: Subject, pixels: int) -> FitResult:
    """Fit the middle of the profile, on the subject's pixels as far as they reach."""
    support_mm = pixels // 2 * subject.mm_per_pixel
    reach_mm = float(subject.profile.r_edges_mm[-1])
    pitch_mm = subject.mm_per_pixel * min(1.0, reach_mm / support_mm)
    support_mm = pixels // 2 * pitch_mm
    return fit_guided(subject.profile, mm_per_pixel=pitch_mm, support_mm=support_mm)


def _change(subject: Subject, own: list[FloatArray], found: FitResult) -> float:
    return subject.error(found.kernel, own)


def _stopped_early(found: FitResult) -> float:
    return float(sum("converged" not in each for each in found.stop_reasons))
