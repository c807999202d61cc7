"""Speed against accuracy: every kernel that can be fitted, evaluated on the same pictures.

A row is one kernel on one picture. Errors are against the picture by the profile's whole 2D kernel;
`sssfit.compare.comparison` says which rows are worth their cost, `sssfit.chart` draws them.
"""

import dataclasses
from collections.abc import Callable, Collection, Sequence
from time import perf_counter
from typing import Any

import numpy as np
import numpy.typing as npt

from sssfit.compare.candidates import Candidate, every_candidate, missing
from sssfit.compare.comparison import COSTS, ERRORS, Comparison, KernelRow, Picture, pareto_front
from sssfit.compare.evaluate import Evaluation, evaluate
from sssfit.compare.references import Reference, check_one_pitch, references
from sssfit.errors import FitError, RenderError
from sssfit.fit import FitResult, TapsFit, make_target
from sssfit.measure.delta_e import selected_pixels, selection
from sssfit.measure.score import COLOUR_FIGURES
from sssfit.process import thread_count
from sssfit.profile import Profile
from sssfit.render import render
from sssfit.render.borders import check_channels
from sssfit.scene.record import Scene

Report = Callable[[int, int, str], None]
Fit = FitResult | TapsFit
_Evaluated = tuple[Candidate, Fit, Sequence[Evaluation]]

_COST_FIGURES = ("fetches", "passes", "all_passes", "bytes_per_pixel", "kernel_bytes")
# Turns in which kernels are timed: two at least, then until so much time has gone.
_LEAST_TURNS, _MOST_TURNS, TIMED_SECONDS = 2, 12, 8.0


def compare_kernels(
    profile: Profile,
    scenes: Sequence[Scene],
    *,
    support_mm: float | None = None,
    candidates: Sequence[Candidate] | None = None,
    only: Collection[str] | None = None,
    timed_seconds: float = TIMED_SECONDS,
    threads: int | None = None,
    progress: Report | None = None,
) -> Comparison:
    """Fit every candidate once, and evaluate each on every picture.

    Parameters
    ----------
    profile : Profile
        What is fitted, and what the true pictures are made from.
    scenes : sequence of Scene
        Scenes of different names and of one pixel size, which the kernels have; `evaluated_scene`
        says what counts of them.
    support_mm : float, optional [mm]
        As `make_target`.
    candidates : sequence of Candidate, optional
        By default all that ``sssfit.compare.candidates`` knows for these pixels, dense kernels
        before those that are thinned from them.
    only : collection of str, optional
        Methods of the default candidates.
    timed_seconds : float [s]
        How long kernels are timed in turn, after two turns at least.
    threads : int, optional
        By default all cores; only the seconds depend on it.
    progress : callable, optional
        Called with how many candidates are done, of how many, and the label of the next; at the
        end with "timing".

    Returns
    -------
    Comparison

    Raises
    ------
    FitError
        The profile cannot be used, or no candidate could be fitted.
    RenderError
        As `check_scenes`, or as `evaluate`.
    """
    check_scenes(scenes, profile.n_channels)
    target = make_target(profile, scenes[0].mm_per_pixel, support_mm)
    pixels = 2 * target.half_pixels + 1
    wanted = every_candidate(pixels, only) if candidates is None else tuple(candidates)
    left_out = missing(pixels, target.mm_per_pixel, only) if candidates is None else []
    if not wanted:
        reason = left_out[0][1] if left_out else "there are none; give one or more."
        raise FitError(f"{target.name}: no kernel to compare: {reason}")
    true = references(scenes, profile, threads=threads)
    evaluated: list[_Evaluated] = []
    dense: dict[str, FitResult] = {}
    for done, candidate in enumerate(wanted):
        if progress is not None:
            progress(done, len(wanted), candidate.label)
        try:
            known = dense.get(candidate.dense_label)
            fit = candidate.fit(profile, target.mm_per_pixel, support_mm, known)
        except FitError as error:
            left_out.append((candidate.label, str(error)))
            continue
        if isinstance(fit, FitResult):
            dense[candidate.label] = fit
        evaluated.append((candidate, fit, [_evaluated(each, fit, threads) for each in true]))
    if not evaluated:
        reason = left_out[-1][1]
        raise FitError(f"{target.name}: no kernel of {len(wanted)} could be fitted: {reason}")
    if progress is not None:
        progress(len(wanted), len(wanted), "timing")
    seconds = _timed_in_turn([fit for _, fit, _ in evaluated], scenes, timed_seconds, threads)
    rows = [
        row
        for each, price in zip(evaluated, seconds, strict=True)
        for row in _rows(*each, scenes, price)
    ]
    return Comparison(
        profile=profile,
        mm_per_pixel=target.mm_per_pixel,
        pixels=pixels,
        threads=thread_count(threads),
        pictures=tuple(
            Picture(scene.name, scene.width, scene.height, each.exposure)
            for scene, each in zip(scenes, true, strict=True)
        ),
        rows=_with_fronts(rows),
        left_out=tuple(left_out),
    )


def _evaluated(true: Reference, fit: Fit, threads: int | None) -> Evaluation:
    """Compare a kernel's picture with the true one."""
    return evaluate(
        true.scene,
        fit.kernel,
        truth=true.truth,
        border=true.border,
        exposure=true.exposure,
        is_timed=False,
        threads=threads,
    )


def check_scenes(scenes: Sequence[Scene], channels: int) -> None:
    """Refuse pictures that say nothing, before anything is fitted.

    Raises
    ------
    RenderError
        No picture, two of one name, of several pixel sizes or other channels, or one colour all
        over.
    """
    names = [scene.name for scene in scenes]
    if not scenes or len(set(names)) < len(names):
        raise RenderError(f"pictures {', '.join(names) or '-'}; expected one or more, each once.")
    check_one_pitch(scenes)
    for scene in scenes:
        check_channels(scene.channels, channels)
        lit = selected_pixels(scene.irradiance, selection(scene.mask, scene.irradiance))
        if not np.ptp(lit, axis=0).any():
            raise RenderError(
                f"{scene.name} is of one colour: blurred it is the same, and no kernel can be told "
                "from another; give a picture with edges in it."
            )


def _timed_in_turn(
    fits: Sequence[Fit], scenes: Sequence[Scene], timed_seconds: float, threads: int | None
) -> npt.NDArray[np.float64]:
    """Return the least seconds per megapixel of each kernel, on the largest picture (n,).

    All kernels in turn, again and again, and not each some times in a row: what other programs
    take then falls on all alike. In a row, kernels of equal work differed by a factor of two.
    """
    scene = max(scenes, key=lambda each: each.height * each.width)
    least = np.full(len(fits), np.inf)
    begun = perf_counter()
    for done in range(_MOST_TURNS):
        if done >= _LEAST_TURNS and perf_counter() - begun > timed_seconds:
            break
        for k, fit in enumerate(fits):
            start = perf_counter()
            render(scene, fit.kernel, threads=threads)
            least[k] = min(least[k], perf_counter() - start)
    return least * 1e6 / (scene.height * scene.width)


def _rows(
    candidate: Candidate,
    fit: Fit,
    evaluated: Sequence[Evaluation],
    scenes: Sequence[Scene],
    seconds: float,
) -> list[KernelRow]:
    """Return the rows of one kernel, yet without fronts."""
    cost, found = evaluated[0].cost, []
    for scene, each in zip(scenes, evaluated, strict=True):
        assert each.score is not None  # a truth was given
        found.append(
            KernelRow(
                label=candidate.label,
                method=candidate.method,
                **_shape(fit),
                settings=candidate.settings,
                picture=scene.name,
                **{key: getattr(each.score, key) for key in COLOUR_FIGURES},
                relative_l2=each.score.relative_l2,
                rmse=each.score.rmse,
                psnr_db=each.score.psnr_db,
                energy_drift=each.score.energy_drift,
                radial_asymmetry=each.asymmetry,
                **{key: getattr(cost, key) for key in _COST_FIGURES},
                seconds_per_megapixel=float(seconds),
                fit_seconds=fit.seconds,
            )
        )
    return found


def _shape(fit: Fit) -> dict[str, Any]:
    """Return what a row says of the kernel's form, and of how its channels were fitted."""
    if isinstance(fit, FitResult):
        return {
            "rank": fit.kernel.rank,
            "taps": None,
            "structure": None,
            "relative_frobenius_error": fit.relative_frobenius_error,
            "stop_reasons": fit.stop_reasons,
        }
    kernel = fit.kernel
    if kernel.chained:
        rank, taps, structure = None, None, kernel.structure
    else:
        rank, taps, structure = len(kernel.stages), 2 * len(kernel.stages[0].offsets_mm) + 1, None
    return {
        "rank": rank,
        "taps": taps,
        "structure": structure,
        "relative_frobenius_error": np.full(len(kernel.channels), np.nan),
        "stop_reasons": (),
    }


def _with_fronts(rows: Sequence[KernelRow]) -> tuple[KernelRow, ...]:
    """Say of each row which fronts of its picture it is on."""
    fronts: list[set[tuple[str, str]]] = [set() for _ in rows]
    for picture in dict.fromkeys(row.picture for row in rows):
        places = [i for i, row in enumerate(rows) if row.picture == picture]
        for error in ERRORS:
            for cost in COSTS:
                points = [(rows[i].rounded_cost(cost), rows[i].error(error)) for i in places]
                on_front = pareto_front(*zip(*points, strict=True))
                for i, is_on in zip(places, on_front, strict=True):
                    if is_on:
                        fronts[i].add((error, cost))
    return tuple(
        dataclasses.replace(row, fronts=frozenset(own))
        for row, own in zip(rows, fronts, strict=True)
    )
