"""The options of a choice: tables of taps with what each costs, and the error to expect of it.

Cascades of known structures, and the pre-integrated pass on few taps, which is nearer where there
is room for one stage or for two passes. On taps no other published method came nearer than that at
any number of fetches (docs/how-to-choose.md).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sssfit.errors import RenderError
from sssfit.fit import TapsFit, fit_result, support_of
from sssfit.fit.structures import STRUCTURES, between
from sssfit.kernel.structure import cost_of_chain, parse
from sssfit.messages import counted, shown
from sssfit.profile import Profile

# Taps of the pre-integrated pass, and what each number leaves, as `STRUCTURES` has it.
PREINTEGRATED: Mapping[int, tuple[float, float]] = {
    3: (35.8, 41),
    5: (26.4, 28.5),
    9: (18.4, 23.2),
    13: (12.9, 20.4),
    17: (10.7, 18.5),
    25: (7.91, 14.3),
    33: (7.03, 12.5),
    49: (6.83, 10.4),
}
_FEWEST = 2 * min(PREINTEGRATED)  # below any cascade


@dataclass(frozen=True, slots=True)
class Option:
    """A table of taps that can be fitted.

    Parameters
    ----------
    label : str
        For reports: "cascade 1-1|2-2|2-2", "pre-integrated on 5 taps".
    method : str
    fetches : float
        A pixel. What decides.
    passes : int
        Passes of its stages.
    known : float
        The error to expect, from that of the known kernels.
    settings : mapping
        Keywords of the fit.
    """

    label: str
    method: str
    fetches: float
    passes: int
    known: float
    settings: Mapping[str, Any] = field(default_factory=dict)

    def fit(self, profile: Profile, mm_per_pixel: float) -> TapsFit | None:
        """Fit a profile; on pixels wider than its reach there is no kernel, None."""
        settings = dict(self.settings)
        if "taps" in settings:
            pixels = 2 * half_pixels(support_of(profile), mm_per_pixel) + 1
            settings["taps"] = min(settings["taps"], pixels)
            if pixels == 1:
                return None
        found = fit_result(profile, self.method, mm_per_pixel=mm_per_pixel, **settings)
        assert isinstance(found, TapsFit)  # all options make tables of taps
        return found


def half_pixels(support_mm: float, mm_per_pixel: float) -> int:
    """Pixels on either side of the middle, as the fits count them."""
    return math.floor(support_mm / mm_per_pixel + 1e-9)


def check_caps(fetches: float | None, passes: int | None) -> None:
    """Refuse budgets that nothing can keep.

    Raises
    ------
    RenderError
    """
    if fetches is not None and not fetches >= _FEWEST:
        raise RenderError(f"fetches = {shown(fetches)}; expected a number from {_FEWEST} up.")
    if passes is not None and passes < 1:
        raise RenderError(f"passes = {shown(passes)}; expected a whole number from 1 up.")


def options(width: float, fetches: float | None = None, passes: int | None = None) -> list[Option]:
    """Return the options within a budget that no cheaper one is expected to beat, cheapest first.

    Parameters
    ----------
    width : float
        Width of the kernel, in pixels; see `sssfit.fit.structures.width_pixels`.
    fetches : float, optional
        The most fetches a pixel.
    passes : int, optional
        The most passes of the stages.

    Raises
    ------
    RenderError
        There is none.
    """
    most = math.inf if fetches is None else fetches + 1e-9
    kept = [
        each
        for each in (*_cascades(width), *_preintegrated(width))
        if each.fetches <= most and (passes is None or each.passes <= passes)
    ]
    found: list[Option] = []
    for each in sorted(kept, key=lambda each: (each.fetches, each.passes, each.known)):
        if not found or each.known < found[-1].known:
            found.append(each)
    if not found:
        limits = [] if fetches is None else [counted(fetches, "fetch", "g")]
        limits += [] if passes is None else [counted(passes, "pass")]
        raise RenderError(
            f"no known table has at most {' and '.join(limits)}; allow more of either."
        )
    return found


def _cascades(width: float) -> list[Option]:
    costs = {text: cost_of_chain(parse(text)) for text in STRUCTURES}
    return [
        Option(
            f"cascade {text}",
            method="cascade",
            fetches=costs[text].fetches,
            passes=costs[text].passes,
            known=between(known, width),
            settings={"stages": text},
        )
        for text, known in STRUCTURES.items()
    ]


def _preintegrated(width: float) -> list[Option]:
    return [
        Option(
            f"pre-integrated on {taps} taps",
            method="preintegrated",
            fetches=2.0 * taps,
            passes=2,
            known=between(known, width),
            settings={"taps": taps},
        )
        for taps, known in PREINTEGRATED.items()
    ]
