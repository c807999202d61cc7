"""What a choice found, in sentences: the kernel, and why neither less nor more will do."""

from collections.abc import Iterator

from sssfit.choose.choice import Choice, Step
from sssfit.choose.truth import PhotonNeed
from sssfit.messages import filled

_KERNEL = (
    "{what}: {rank} term{s}, {taps_per_pixel} weights a pixel, {loss}, {seconds:.2g} s a megapixel "
    "here"
)
_LOSS = (
    "Delta E {delta_e_2000_mean:.3g} (95 % of pixels within {delta_e_2000_p95:.3g}, 99 % within "
    "{delta_e_2000_p99:.3g}; {share_above_1:.2g%} above 1)"
)


def sentences(choice: Choice) -> list[str]:
    """Say what was chosen, what else would do, what would not, and what it was judged on."""
    found = list(_no_blur(choice) if choice.fit is None else _kernel(choice))
    found += [
        f"judged on {each.name}, {each.width} x {each.height} pixels of {each.mm_per_pixel:.4g} mm"
        for each in choice.scenes
    ]
    return found


def step_line(step: Step) -> str:
    """Say what a step is, what it costs and what it loses."""
    enough = "within" if step.within else "not enough"
    return f"{_what(step)}: {step.taps_per_pixel} weights, {_loss(step)}, {enough}"


def _no_blur(choice: Choice) -> Iterator[str]:
    """Say why no blur is needed."""
    if choice.chosen is not None:
        yield (
            "no blur is needed: irradiance times diffuse reflectance has "
            f"{_loss(choice.chosen)}; any kernel would cost more."
        )
    elif choice.scenes:
        yield "no blur is needed: the head is under a pixel."
    else:
        yield (
            "no blur is needed: the profile is under a pixel, 99.9 % of it within "
            f"{choice.support_mm:.3g} mm."
        )


def _kernel(choice: Choice) -> Iterator[str]:
    """Say what was chosen, what else would do, and what would not."""
    chosen, fit = choice.chosen, choice.fit
    if chosen is None or fit is None:
        return
    rank, seconds = fit.kernel.rank, choice.seconds_per_megapixel
    words = {"what": _what(chosen), "loss": _loss(chosen), "s": "s" * (rank > 1)}
    yield filled(_KERNEL, {**chosen.to_dict(), **words, "rank": rank, "seconds": seconds})
    if choice.runner_up:
        yield f"runner-up: {_beside(choice.runner_up, chosen)}"
    if choice.cheaper:
        step, why = choice.cheaper, ""
        if not step.within and step.error <= choice.tolerance:
            why = f", on a wider view, which may have {choice.wider_tolerance:.3g}"
        yield f"cheaper is not enough: {_beside(step, chosen)}{why}"
    for each in choice.dearer:
        needed = "is not needed" if each.within else "is not enough"
        yield f"dearer {needed}: {_beside(each, chosen)}"
    yield from _untried(choice)
    if choice.photons is not None:
        yield _photons(choice.photons)


def _untried(choice: Choice) -> Iterator[str]:
    """Say which supports and guided fits were left out."""
    if choice.too_narrow:
        pixels = ", ".join(map(str, choice.too_narrow))
        yield f"not tried: kernels of {pixels} pixels, to which even the true one cannot be cut"
    if choice.unfitted:
        yield f"cannot be fitted to this profile: {', '.join(choice.unfitted)}"
    tried = [each.option.candidate.method for each in choice.steps if each.option]
    if "guided" not in tried:
        yield "not tried: guided fits, for their time, where another pass will do or one is wide"


def _photons(need: PhotonNeed) -> str:
    """Say how many photons a walk would need, and what the truth took."""
    tried = ", ".join(
        f"{count:.2g} Delta E {error:.3g} in {seconds:.1f} s"
        for count, error, seconds in zip(need.counts, need.errors, need.seconds, strict=True)
    )
    enough = f"a walk of {need.photons or 0:.2g} photons would do"
    if need.photons is None:
        enough = f"{need.counts[-1]:.2g} photons are not enough for a walk"
    by = "needs none" if need.truth_method == "exact" else "is the truth here"
    text = f"photons: {enough} ({tried}); {need.truth_method} {by}, {need.truth_seconds:.1f} s"
    return text.replace("e+0", "e")


def _what(step: Step) -> str:
    """Name a step with its pixels."""
    if step.option is None:
        return step.label
    return f"{step.label} on {step.option.pixels} pixels (+-{step.option.half_mm:.3g} mm)"


def _loss(step: Step) -> str:
    """Say how far colours are off: mean and percentiles of Delta E, and how many pixels show."""
    return filled(_LOSS, step.to_dict())


def _beside(step: Step, chosen: Step) -> str:
    """Compare a step with the chosen one."""
    times = step.taps_per_pixel / chosen.taps_per_pixel
    price = "as many weights" if times == 1.0 else f"{times:.3g} times the weights"
    if step.option is None:
        price = "no weights"
    return f"{_what(step)}, {_loss(step)} for {price}"
