"""Fits the kernels of a page, each once, and counts the steps for a bar of progress."""

import shlex
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial

from sssfit.compare.candidates import Candidate
from sssfit.errors import FitError, KernelError
from sssfit.fit import FitResult, TapsFit, make_target
from sssfit.kernel import Taps
from sssfit.messages import note
from sssfit.profile import Profile
from sssfit.report.aside import Aside
from sssfit.report.commands import command_of
from sssfit.report.kernels import Fitted, ShownKernel, shown_candidates

Watch = Callable[[int, int, str], None]
Fit = FitResult | TapsFit


class Steps:
    """Counts the steps of a report as they begin; their number is known once fits are."""

    def __init__(self, report: Watch | None) -> None:
        self.report, self.done, self.total = report, 0, 17

    def __call__(self, name: str) -> None:
        """Say that a step begins."""
        if self.report is not None:
            self.report(min(self.done, self.total), self.total, name)
        self.done += 1


def begun_fits(
    profile: Profile,
    mm_per_pixel: float,
    labels: Sequence[str],
    only: Collection[str] | None,
    aside: Aside,
) -> list[tuple[Candidate, Callable[[], Fit]]]:
    """Return candidates, each with a function that returns its fit.

    Chains of stages, which take seconds, are begun aside; others are fitted when they are called.

    Raises
    ------
    KernelError
        Two of the candidates and of the user's own ``labels`` are the same.
    """
    pixels = 2 * make_target(profile, mm_per_pixel, None).half_pixels + 1
    wanted = shown_candidates(pixels, only)
    for method in sorted({*(only or ())}.difference(each.method for each in wanted)):
        note(f"{method} is left out: no shader runs a kernel of it on {pixels} x {pixels} pixels.")
    _check_labels(labels, [each.label for each in wanted])
    dense: dict[str, FitResult] = {}

    def thinned(each: Candidate) -> Fit:
        if each.dense_label not in dense:
            dense[each.dense_label] = each.fit_dense(profile, mm_per_pixel, None)
        return each.fit(profile, mm_per_pixel, None, dense[each.dense_label])

    return [
        (
            each,
            aside.begin(partial(each.fit, profile, mm_per_pixel, None))
            if each.taps is None
            else partial(thinned, each),
        )
        for each in wanted
    ]


def given_kernels(named: Sequence[tuple[str, Taps]]) -> list[Fitted]:
    """Return tables of a user's own with their labels, as if they were fitted."""
    return [Fitted(label, taps.method, 0, {}, None, TapsFit(taps, 0, 0.0)) for label, taps in named]


def finished_fits(
    begun: Iterable[tuple[Candidate, Callable[[], Fit]]], steps: Steps
) -> list[Fitted]:
    """Return what was fitted; what cannot be fitted is noted and left out."""
    found = []
    for each, fit in begun:
        steps(each.label)
        try:
            fields = (each.label, each.method, each.terms, each.settings, each.taps)
            found.append(Fitted(*fields, fit()))
        except FitError as error:
            note(f"{each.label} is left out: {error}")
    return found


def _check_labels(own: Sequence[str], others: Sequence[str]) -> None:
    """Refuse kernels that could not be told apart in the page."""
    for k, label in enumerate(own):
        if label in own[:k] or label in others:
            raise KernelError(
                f"two kernels are called {label}; rename a file, so that the page tells them apart."
            )


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
