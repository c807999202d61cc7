"""The options of a choice: tables of taps with what each costs, and what it leaves of skin1.

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
from sssfit.fit.cascade import FEWEST, STRUCTURES
from sssfit.kernel.structure import cost_of_chain, parse
from sssfit.messages import counted, shown
from sssfit.profile import Profile

# Taps of the pre-integrated pass, and the mean over eight pictures of the 99th percentile of Delta
# E that each leaves of skin1 on pixels of .3 mm, as `STRUCTURES` has it.
PREINTEGRATED: Mapping[int, float] = {
    3: 35.8,
    5: 26.4,
    9: 18.4,
    13: 12.9,
    17: 10.7,
    25: 7.91,
    33: 7.03,
    49: 6.83,
}


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
        Of its stages.
    known : float
        What it leaves of skin1.
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
    if fetches is not None and not fetches >= FEWEST:
        raise RenderError(f"fetches = {shown(fetches)}; expected a number from {FEWEST} up.")
    if passes is not None and passes < 1:
        raise RenderError(f"passes = {shown(passes)}; expected a whole number from 1 up.")


def options(fetches: float | None = None, passes: int | None = None) -> list[Option]:
    """Return the options within a budget that none cheaper beats on skin1, cheapest first.

    Parameters
    ----------
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
        for each in (*_cascades(), *_preintegrated())
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


def _cascades() -> list[Option]:
    found = []
    for text, known in STRUCTURES.items():
        cost = cost_of_chain(parse(text))
        settings = {"stages": text}
        found.append(
            Option(f"cascade {text}", "cascade", cost.fetches, cost.passes, known, settings)
        )
    return found


def _preintegrated() -> list[Option]:
    return [
        Option(
            f"pre-integrated on {taps} taps", "preintegrated", 2.0 * taps, 2, known, {"taps": taps}
        )
        for taps, known in PREINTEGRATED.items()
    ]
