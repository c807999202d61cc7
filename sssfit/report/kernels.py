"""The kernels of a page: tables of taps with the source that runs in it, and a plan of its passes.

Only what a shader runs is compared here; a dense kernel has a weight for every pixel.
"""

import dataclasses
import math
from collections.abc import Collection
from typing import Any

from sssfit.compare.candidates import Candidate, every_candidate, on_budgets
from sssfit.export import kernel_text
from sssfit.export.passes import Pass, pass_list
from sssfit.fit import FitResult, TapsFit
from sssfit.kernel import Taps
from sssfit.methods import TAPS
from sssfit.profile import Profile
from sssfit.report.pack import packed_text

FORMS = ("hlsl", "glsl", "wgsl", "json")
# Of the methods with stages, those that are fitted in 7 s at most; a cascade of 17 takes 16.
CHAINS = ("cascade 12", "cascade 24", "pyramid 12", "disk 24", "disk 40")
MOST_FETCHES = 50  # of a thinned kernel; more cost twice a cascade, and are no better
_MOVED = ("pair", "line")


@dataclasses.dataclass(frozen=True, slots=True)
class Fitted(Candidate):
    """A candidate that is fitted already, so that its kernel is at hand after a comparison."""

    found: FitResult | TapsFit | None = None

    def fit(
        self,
        profile: Profile,  # noqa: ARG002 (the signature of a candidate)
        mm_per_pixel: float,  # noqa: ARG002
        support_mm: float | None,  # noqa: ARG002
        dense: FitResult | None = None,  # noqa: ARG002
    ) -> FitResult | TapsFit:
        """Return the fit at hand."""
        assert self.found is not None
        return self.found


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class ShownKernel:
    """A table of taps of the page.

    Parameters
    ----------
    label : str
        As in the comparison's rows.
    taps : Taps
    command : str
        What makes it again.
    """

    label: str
    taps: Taps
    command: str

    def text(self, form: str, **settings: Any) -> str:
        """Return its export, the same text that ``sssfit export`` writes."""
        return kernel_text(self.taps, form, **settings)[0]

    @property
    def can_jitter(self) -> bool:
        """Whether it has outer taps that a pixel may move."""
        return any(each.kind in _MOVED for each in self.taps.stages)

    def to_dict(self) -> dict[str, Any]:
        """Return what the page reads."""
        taps, can_jitter = self.taps, self.can_jitter
        return {
            "label": self.label,
            "structure": taps.structure,
            "method": taps.method,
            "fetches": taps.fetches,
            "passes": taps.passes,
            "mm_per_pixel": taps.mm_per_pixel,
            "channels": list(taps.channels),
            "albedo": taps.energy.tolist(),
            "command": self.command,
            "texts": {form: packed_text(self.text(form)) for form in FORMS},
            "jittered": packed_text(self.text("glsl", jitter=True)) if can_jitter else None,
            "plan": plan(taps),
            "jitter_plan": plan(taps, jitter=True) if can_jitter else None,
        }


def plan(taps: Taps, *, jitter: bool = False) -> list[dict[str, Any]]:
    """Return the passes of exported GLSL as a page draws them.

    Each has ``call``, an expression of the pictures t0, t1, ..., ``position``, ``texel``, ``mm``
    and ``frame``; ``reads`` and ``writes``, names of pictures; ``level``, how often the target is
    halved; and ``added``, whether the target keeps what it holds.
    """
    return [_planned(each, jitter=jitter) for each in pass_list(taps, normalized=True)]


def _planned(each: Pass, *, jitter: bool) -> dict[str, Any]:
    """Return one pass."""
    words = [f"t{k}" for k in range(len(each.pictures))]
    words += ["position", "texel"]
    if each.takes_stage:
        axis = [] if each.axis is None else [f"vec2({each.axis[0]!r}, {each.axis[1]!r})"]
        words = [f"{each.stages[0]}u", *axis, *words]
    words += ["mm"] if each.kind not in ("halve", "sum") else []
    words += ["frame"] if each.takes_frame(jitter=jitter) else []
    return {
        "call": f"SSS_{each.name}({', '.join(words)})",
        "label": _label(each),
        "reads": list(each.pictures),
        "writes": list(each.writes),
        "level": each.level,
        "fetches": each.fetches,
        "added": each.is_added,
    }


_WORDS = {"halve": "halved", "sum": "sum of the stages", "disk": "disk", "star": "star"}
_ALONG = {(1.0, 0.0): "across", (0.0, 1.0): "down"}


def _label(each: Pass) -> str:
    """Return what a pass writes, in words: its stage from 1, its direction, its size."""
    stages = ", ".join(str(k + 1) for k in each.stages)
    words = _WORDS.get(each.kind, "")
    if each.axis is not None:
        x, y = each.axis
        words = _ALONG.get(each.axis, f"{words or 'blur'} along ({x:.2g}, {y:.2g})")
    of_stage = "" if each.kind in ("halve", "sum") else f"stage {stages}, "
    size = f", 1/{2**each.level} of the size" if each.level else ""
    return f"{of_stage}{words}{size}"


def shown_candidates(pixels: int, only: Collection[str] | None = None) -> list[Candidate]:
    """Return the kernels of a page by default: the thinned ones, and `CHAINS`.

    Parameters
    ----------
    pixels : int
        Pixels of a pass, as in `every_candidate`.
    only : collection of str, optional
        Names of methods; then all of their kernels that a shader runs. A method whose kernels are
        dense in `every_candidate`, such as burley, has them thinned here.
    """
    every = [each for each in every_candidate(pixels, only) if is_shown(each)]
    if only is not None:
        lacking = {*only}.difference(each.method for each in every)
        every += on_budgets(every_candidate(pixels, lacking), pixels)
        return every
    return [each for each in every if _fetches(each) <= MOST_FETCHES or each.label in CHAINS]


def _fetches(candidate: Candidate) -> float:
    """Return the fetches of a thinned kernel, whose terms share their first pass."""
    return math.inf if candidate.taps is None else candidate.taps * (candidate.terms + 1)


def is_shown(candidate: Candidate) -> bool:
    """Return whether a shader runs what a candidate makes."""
    return candidate.taps is not None or candidate.method in TAPS
