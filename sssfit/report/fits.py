"""Fits the kernels of a page, each once, and counts the steps for a bar of progress."""

import shlex
from collections.abc import Callable, Collection, Sequence

from sssfit.errors import FitError
from sssfit.fit import FitResult, TapsFit, make_target
from sssfit.kernel import Taps
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.report.commands import command_of
from sssfit.report.kernels import Fitted, ShownKernel, shown_candidates

Watch = Callable[[int, int, str], None]


class Steps:
    """Counts the steps of a report as they begin; their number is known once fits are."""

    def __init__(self, report: Watch | None) -> None:
        self.report, self.done, self.total = report, 0, 16

    def __call__(self, name: str) -> None:
        """Say that a step begins."""
        if self.report is not None:
            self.report(min(self.done, self.total), self.total, name)
        self.done += 1


def fitted(
    profile: Profile,
    mm_per_pixel: float,
    named: Sequence[tuple[str, Taps]],
    only: Collection[str] | None,
    steps: Steps,
) -> list[Fitted]:
    """Fit the candidates, each once; what cannot be fitted is noted and left out."""
    pixels = 2 * make_target(profile, mm_per_pixel, None).half_pixels + 1
    wanted = shown_candidates(pixels, only)
    steps.total += len(wanted)
    found = [
        Fitted(label, taps.method, 0, {}, None, TapsFit(taps, 0, 0.0)) for label, taps in named
    ]
    dense: dict[str, FitResult] = {}
    for each in wanted:
        steps(each.label)
        try:
            if each.taps is not None and each.dense_label not in dense:
                dense[each.dense_label] = each.fit_dense(profile, mm_per_pixel, None)
            fit = each.fit(profile, mm_per_pixel, None, dense.get(each.dense_label))
        except FitError as error:
            note(f"{each.label} is left out: {error}")
            continue
        fields = (each.label, each.method, each.terms, each.settings, each.taps)
        found.append(Fitted(*fields, fit))
    if not found:
        raise FitError(f"{profile.material_name or 'profile'}: no kernel could be fitted.")
    return found


def shown_kernel(fit: Fitted, title: str, mm_per_pixel: float) -> ShownKernel:
    """Return a fit as the page has it."""
    assert fit.found is not None
    assert isinstance(fit.found.kernel, Taps)
    made = fit.settings or fit.taps
    command = (
        command_of(fit, shlex.quote(f"{title}.profile.npz"), mm_per_pixel)
        if made
        else "given as a file"
    )
    return ShownKernel(fit.label, fit.found.kernel, command)
