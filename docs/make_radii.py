"""Write the section of docs/motion.md on a map of mean free paths, and draw docs/skin1-radii.png.

python docs/make_radii.py
"""

import dataclasses
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from make_motion import PITCH_MM, row, skin1
from sections import put_section

from sssfit.chart.page import (
    draw_bar,
    new_mosaic,
    new_page,
    put_difference,
    put_picture,
    save_figure,
)
from sssfit.fit import fit_separable, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.formats.colours import srgb_encode
from sssfit.measure.delta_e import auto_exposure, lab, shown
from sssfit.motion.adaptive import AdaptiveRenderer
from sssfit.motion.run import FRAMES, make_frames
from sssfit.render import render
from sssfit.render.adaptive import make_sampler, render_samples
from sssfit.render.reference import render_reference
from sssfit.scene.load import load_scenes

DOCS = Path(__file__).parent
TARGET_VARIANCE, COLD = 4e-4, 25
LEVELS, PERIOD = 3, 128  # 2^(k/3), k = -3..3; pixels
FETCHES, TAPS = 14, 7
AMPLIFIED = 10.0

TEXT = """Every pixel has its own mean free path: a map of factors from 1/2 to 2 in {steps} steps,
waves of {period} pixels over the head. The true picture renders each pixel with the profile scaled
by that pixel's factor. skin1 under the strobe, {frames} frames, target variance {target:g}. Errors
are shares of the root mean square of the true frames: of single frames after the first {cold}, and
of their mean over time:

| renderer | fetches a pixel | error of a frame | error of the mean of {warm} frames |
|---|---|---|---|
{rows}

Samples follow the map at the cost of one multiplication each. A cascade that was fitted once is
{wrong:.1f} % off in every frame, and no number of frames mends it. In a single frame that is still
the error of {like_once:.0f} fixed samples a pixel; over time, where noise falls with the square
root of the number of frames, the sampler with variates does better after {frames_once} frames. A
cascade for each step of the map has the error of {like_steps} samples, for {fetches:.0f} fetches.
With variates the sampler takes {saved:.0f} % fewer samples than without.

![The head with a map of mean free paths, by a cascade and by samples](skin1-radii.png)
"""


def factors(height, width):
    """Return the map (H, W), a number of steps."""
    y, x = np.mgrid[:height, :width] * (2.0 * np.pi / PERIOD)
    return 2.0 ** (np.round(LEVELS * np.sin(y) * np.sin(x)) / LEVELS)


def by_steps(scale, rendered):
    """Return a picture whose pixels are those of their own step."""
    found = 0.0
    for factor in np.unique(scale):
        found = found + np.where((scale == factor)[..., None], rendered(float(factor)), 0.0)
    return found


def widened(profile, factor):
    """Return a profile of other mean free paths, and the same reflectance."""
    return dataclasses.replace(profile, r_edges_mm=factor * profile.r_edges_mm)


def cascade(profile):
    """Return a cascade."""
    return fit_taps(profile, fetches=FETCHES, mm_per_pixel=PITCH_MM).kernel


def still_pictures(profile, scene, scale):
    """Yield label, fetches, and picture at the intensity 1, of kernels without noise."""
    dense = fit_separable(profile, "preintegrated", mm_per_pixel=PITCH_MM).kernel
    once, separable = cascade(profile), on_taps(dense, TAPS)
    yield "separable, fitted once", separable.fetches, render(scene, separable)
    yield "cascade, fitted once", once.fetches, render(scene, once)
    own = {float(each): cascade(widened(profile, each)) for each in np.unique(scale)}
    fetches = sum(each.fetches for each in own.values())
    yield "a cascade a step", fetches, by_steps(scale, lambda factor: render(scene, own[factor]))


def samplers(profile, scale, counts):
    """Yield label, and what renders a frame; ``counts`` receives the samples of the first two."""
    for label, has_variates in (("adaptive, no control variates", False), ("adaptive", True)):
        renderer = AdaptiveRenderer(
            profile, PITCH_MM, target_variance=TARGET_VARIANCE, has_variates=has_variates
        )

        def adaptive(_k, frame, renderer=renderer, label=label):
            picture = renderer.render(frame, scale=scale)
            counts.setdefault(label, []).append(float(renderer.counts.mean()))
            return picture

        yield label, adaptive
    sampler, many = make_sampler(profile, PITCH_MM), round(np.mean(counts["adaptive"][COLD:]))
    counts["fixed sampling"] = [many] * FRAMES

    def fixed(k, frame):
        return render_samples(frame, sampler, many, scale=scale, frame=FRAMES + k)

    yield "fixed sampling", fixed


@dataclass
class Found:
    """A renderer, with what it showed after the first frames."""

    label: str
    truth: np.ndarray
    fetches: float = 0.0
    square: float = 0.0
    light: float = 0.0
    seen: float | np.ndarray = 0.0
    intensity: float = 0.0
    picture: np.ndarray | None = None

    def add(self, picture, intensity):
        """Take a frame in."""
        self.square += np.square(picture - intensity * self.truth).mean()
        self.light += np.square(intensity * self.truth).mean()
        self.seen, self.intensity = self.seen + picture, self.intensity + intensity
        self.picture = picture / intensity

    @property
    def mean(self):
        """Mean of the frames, at the intensity 1."""
        return self.seen / self.intensity

    def samples_for(self, error):
        """Return the samples a pixel that bring fixed sampling to an error of a frame."""
        return self.fetches * (self.errors[0] / error) ** 2

    @property
    def errors(self):
        """Of a frame, and of the mean of the frames, over the light."""
        off = np.square(self.mean - self.truth).mean() / np.square(self.truth).mean()
        return np.sqrt(self.square / self.light), np.sqrt(off)


def measured(profile, scene, scale, truth):
    """Yield what every renderer shows."""
    frames = make_frames(profile, scene, light="strobe", length=FRAMES)
    counts = {}
    for label, rendered in samplers(profile, scale, counts):
        found = Found(label, truth)
        for k in frames:
            picture = rendered(k, frames.at(k))
            if k >= COLD:
                found.add(picture, frames.intensity[k])
        found.fetches = float(np.mean(counts[label][COLD:]))
        yield found
    for label, fetches, picture in still_pictures(profile, scene, scale):
        found = Found(label, truth, fetches)
        for intensity in frames.intensity[COLD:]:
            found.add(intensity * picture, intensity)
        yield found


def lightness(picture, exposure):
    """Return CIE L* of a picture as a screen shows it."""
    return lab(shown(picture.reshape(-1, 3), exposure))[:, 0].reshape(picture.shape[:2])


def draw(pictures, scale, truth, mask):
    """Draw pictures, and their errors of lightness under them."""
    exposure = auto_exposure(truth, mask=mask)
    note = (
        f"Under each picture its CIE L* less that of the true one, amplified {AMPLIFIED:g} times: "
        "red is too bright, blue too dark. Map: factors of the mean free path, 1/2 dark, 2 bright."
    )
    title = "skin1: a mean free path for every pixel"
    where = "Exact profile, pixels of .3 mm, a lit frame of the strobe"
    with new_page(6.1, title, where, [note]) as (figure, below):
        wide = 1.04
        axes = new_mosaic(below, wide * (len(pictures) + 1) - 0.04, 2.04)
        put_picture(axes, 0.0, 0.0, srgb_encode(np.clip(exposure * truth, 0.0, 1.0)))
        grey = 0.5 + 0.5 * np.log2(scale)[..., None] * np.ones(3)
        put_picture(axes, 0.0, 1.04, grey)
        for k, (_, picture) in enumerate(pictures, start=1):
            codes = srgb_encode(np.clip(exposure * picture, 0.0, 1.0))
            put_picture(axes, wide * k, 0.0, codes)
            off = lightness(picture, exposure) - lightness(truth, exposure)
            put_difference(axes, wide * k, 1.04, off, AMPLIFIED)
        names = ["true picture,\nmap", *(label for label, _ in pictures)]
        axes.set_xticks([wide * k + 0.5 for k in range(len(names))], names)
        draw_bar(below, axes, AMPLIFIED, "CIE L* less that of the true picture")
    save_figure(figure, DOCS / "skin1-radii.png")


def main():
    """Write the section and the figure."""
    profile = skin1()
    (scene,) = load_scenes(["head"], PITCH_MM)
    scale = factors(scene.height, scene.width)
    truth = by_steps(scale, lambda f: render_reference(scene, widened(profile, f)))
    found = {each.label: each for each in measured(profile, scene, scale, truth)}
    rows = []
    for each in found.values():
        single, mean = each.errors
        cells = [f"{each.fetches:.1f}", f"{100.0 * single:.2g} %", f"{100.0 * mean:.2g} %"]
        rows.append(row([each.label, *cells]))
    plain, adaptive = found["adaptive, no control variates"], found["adaptive"]
    once, steps = found["cascade, fitted once"], found["a cascade a step"]
    like_steps = found["fixed sampling"].samples_for(steps.errors[0])
    text = TEXT.format(
        steps=len(np.unique(scale)),
        period=PERIOD,
        frames=FRAMES,
        target=TARGET_VARIANCE,
        cold=COLD,
        warm=FRAMES - COLD,
        rows="\n".join(rows),
        wrong=100.0 * once.errors[0],
        like_once=found["fixed sampling"].samples_for(once.errors[0]),
        like_steps=f"{float(f'{like_steps:.2g}'):,.0f}",
        frames_once=int(np.ceil((adaptive.errors[0] / once.errors[0]) ** 2)),
        fetches=steps.fetches,
        saved=100.0 * (1.0 - adaptive.fetches / plain.fetches),
    )
    put_section("motion.md", "docs/make_radii.py", text)
    pictures = [
        ("cascade,\nfitted once", once.picture),
        ("adaptive,\none frame", adaptive.picture),
        (f"adaptive,\nmean of {FRAMES - COLD} frames", adaptive.mean),
    ]
    draw(pictures, scale, truth, scene.mask)


if __name__ == "__main__":
    main()
