"""The figures of ``sssfit choose``, for people and for programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from sssfit.messages import number, of_material

if TYPE_CHECKING:
    from sssfit.choose.choice import Choice, PhotonNeed, Step

_FIGURES = {"p95": "95th percentile", "p99": "99th percentile", "mean": "mean"}


def step_line(step: Step) -> str:
    """Write a step as a line: what it is, what it costs, what it loses."""
    return (
        f"{_what(step)}: {step.taps_per_pixel} weights, {_loss(step)}, "
        f"{'within' if step.within else 'not enough'}"
    )


def text_of(choice: Choice, written: Sequence[str], figures: Mapping[str, Any]) -> str:
    """Write the choice first, then why neither less nor more."""
    where = (
        f"{of_material(figures['material'])} at {figures['distance_mm'] / 1000.0:g} m, "
        f"{choice.mm_per_pixel:.4g}"
        f" mm per pixel, {_FIGURES[choice.tolerance_of]} of Delta E within {choice.tolerance:g}:"
    )
    lines = [where, *(_no_blur(choice) if choice.fit is None else _kernel(choice)), *_seen(choice)]
    wrote = f"Wrote {', '.join(written)}" if written else "No kernel is written."
    return "\n".join([*lines, wrote])


def _no_blur(choice: Choice) -> list[str]:
    """Say why no blur is needed."""
    if choice.chosen is not None:
        return [
            "no blur is needed: irradiance times diffuse reflectance has "
            f"{_loss(choice.chosen)}; any kernel would cost more."
        ]
    if choice.scenes:
        return ["no blur is needed: the head is under a pixel."]
    return [
        f"no blur is needed: the profile is under a pixel, 99.9 % of it within "
        f"{choice.support_mm:.3g} mm."
    ]


def _kernel(choice: Choice) -> list[str]:
    """Say what was chosen, what else would do, and what would not."""
    chosen, fit = choice.chosen, choice.fit
    if chosen is None or fit is None:
        return []
    lines = [
        f"{_what(chosen)}: {fit.kernel.rank} term{'s' * (fit.kernel.rank > 1)}, "
        f"{chosen.taps_per_pixel} weights a pixel, {_loss(chosen)}, "
        f"{choice.seconds_per_megapixel:.2g} s a megapixel here",
    ]
    if choice.runner_up:
        lines.append(f"runner-up: {_beside(choice.runner_up, chosen)}")
    if choice.cheaper:
        why = _why(choice, choice.cheaper)
        lines.append(f"cheaper is not enough: {_beside(choice.cheaper, chosen)}{why}")
    lines += [
        f"dearer {'is not needed' if each.within else 'is not enough'}: {_beside(each, chosen)}"
        for each in choice.dearer
    ]
    return [*lines, *_untried(choice), *_photon_lines(choice.photons)]


def _why(choice: Choice, step: Step) -> str:
    """Say why a step is out although its error is within: wider views have 95 % of it."""
    if step.within or step.error > choice.tolerance:
        return ""
    return f", on a wider view, which may have {choice.wider_tolerance:.3g}"


def _untried(choice: Choice) -> list[str]:
    """Say which supports and guided fits were left out."""
    tried = [each.option for each in choice.steps if each.option]
    lines = []
    if choice.too_narrow:
        lines.append(
            f"not tried: kernels of {', '.join(map(str, choice.too_narrow))} pixels, to which even "
            "the true one cannot be cut"
        )
    if choice.unfitted:
        lines.append(f"cannot be fitted to this profile: {', '.join(choice.unfitted)}")
    if not any(each.candidate.method == "guided" for each in tried):
        lines.append(
            "not tried: guided fits, for their time, where another pass will do or one is wide"
        )
    return lines


def _photon_lines(need: PhotonNeed | None) -> list[str]:
    """Say how many photons a walk would need, and what the truth took."""
    if need is None:
        return []
    if need.photons is None:
        enough = f"{need.counts[-1]:.2g} photons are not enough for a walk"
    else:
        enough = f"a walk of {need.photons:.2g} photons would do"
    tried = ", ".join(
        f"{count:.2g} Delta E {error:.3g} in {seconds:.1f} s"
        for count, error, seconds in zip(need.counts, need.errors, need.seconds, strict=True)
    )
    by = "needs none" if need.truth_method == "exact" else "is the truth here"
    text = f"photons: {enough} ({tried}); {need.truth_method} {by}, {need.truth_seconds:.1f} s"
    return [text.replace("e+0", "e")]


def _seen(choice: Choice) -> list[str]:
    """Say what it was judged on."""
    return [
        f"judged on {each.name}, {each.width} x {each.height} pixels of {each.mm_per_pixel:.4g} mm"
        for each in choice.scenes
    ]


def _what(step: Step) -> str:
    """Name a step with its pixels."""
    if step.option is None:
        return step.label
    half_mm = step.option.pixels // 2 * step.mm_per_pixel
    return f"{step.label} on {step.option.pixels} pixels (+-{half_mm:.3g} mm)"


def _loss(step: Step) -> str:
    """Say how far colours are off: mean and percentiles of Delta E, and how many pixels show."""
    return (
        f"Delta E {step.delta_e_2000_mean:.3g} (95 % of pixels within {step.delta_e_2000_p95:.3g}, "
        f"99 % within {step.delta_e_2000_p99:.3g}; {number(step.share_above_1, '.2g%')} above 1)"
    )


def _beside(step: Step, chosen: Step) -> str:
    """Hold a step against the chosen one."""
    times = step.taps_per_pixel / chosen.taps_per_pixel
    if step.option is None:
        price = "no weights"
    else:
        price = "as many weights" if times == 1.0 else f"{times:.3g} times the weights"
    return f"{_what(step)}, {_loss(step)} for {price}"
