"""What a choice found, in sentences: the table of taps, and what less and more would do."""

from collections.abc import Iterator

from sssfit.choose.choice import Choice, Step
from sssfit.choose.truth import PhotonNeed
from sssfit.messages import counted, filled

_KERNEL = (
    "{label}: {fetches:.4g#fetch} a pixel in {passes:#pass}, {loss}, {seconds:.2g} s a "
    "megapixel here"
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
    return f"{step.label}: {counted(step.fetches, 'fetch', '.4g')}, {_loss(step)}, {enough}"


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
    """Say what was chosen, and what less and more would do."""
    chosen, fit = choice.chosen, choice.fit
    if chosen is None or fit is None:
        return
    words = {"loss": _loss(chosen), "seconds": choice.seconds_per_megapixel}
    yield filled(_KERNEL, {**chosen.to_dict(), **words})
    if choice.cheaper:
        step, why = choice.cheaper, ""
        if choice.tolerance is not None and not step.within and step.error <= choice.tolerance:
            why = f", on a wider view, which may have {choice.wider_tolerance:.3g}"
        yield f"cheaper{_judged(choice, step)}: {_beside(step, chosen)}{why}"
    if choice.dearer:
        yield f"dearer{_judged(choice, choice.dearer)}: {_beside(choice.dearer, chosen)}"
    if choice.unfitted:
        yield f"cannot be fitted to this profile: {', '.join(choice.unfitted)}"
    if choice.photons is not None:
        yield _photons(choice.photons)


def _judged(choice: Choice, step: Step) -> str:
    """Say whether a step that was not taken is enough, where there is a tolerance."""
    if choice.tolerance is None:
        return ""
    return " is not needed" if step.within else " is not enough"


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


def _loss(step: Step) -> str:
    """Say how far colours are off: mean and percentiles of Delta E, and how many pixels show."""
    return filled(_LOSS, step.to_dict())


def _beside(step: Step, chosen: Step) -> str:
    """Compare a step with the chosen one."""
    price = "no fetches"
    if step.option:
        price = f"{counted(step.fetches, 'fetch', '.4g')} in {counted(step.passes, 'pass')}"
    if step.option and step.fetches != chosen.fetches:
        price += f", {step.fetches / chosen.fetches:.3g} times as many"
    return f"{step.label}, {_loss(step)} for {price}"
