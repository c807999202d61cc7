"""Write the figures of docs/cascades.md on jittered taps, and draw docs/skin1-jitter.png.

python docs/make_jitter.py
"""

from make_cascades import row, whole_profile
from make_samples import CROP, LIGHT_DEGREES, MM, PIXELS, bands, codes, lightness, name_rows
from sections import DOCS, put_section

from sssfit.chart.page import (
    draw_bar,
    new_mosaic,
    new_page,
    put_difference,
    put_picture,
    save_figure,
)
from sssfit.compare.frames import over_frames
from sssfit.fit import fit_preintegrated, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.measure.delta_e import auto_exposure
from sssfit.render.jitter import Jitter
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.scene.made import make_scene

AMPLIFIED = 40.0
JITTER = Jitter()  # the outer third of the taps, by a quarter and 30 degrees

TEXT = """The nose as above: bands, and error and noise of one frame and of 16 averaged (the newest
counts 1/8), 99th percentile of Delta E. Jitter turns the outer third of the taps by up to 30
degrees and scales their offsets by up to a quarter, by pixel and frame
(`sssfit.render.jitter`):

![The nose with 13 samples, jittered and not, and by a cascade](skin1-jitter.png)

| kernel | fetches | jitter | bands, L* | one frame | its noise | 16 frames | their noise |
|---|---|---|---|---|---|---|---|
{rows}
"""


def kernels(profile):
    """Yield a label and a table of taps."""
    dense = fit_preintegrated(profile, mm_per_pixel=MM).kernel
    for taps in (13, 25):
        yield f"{taps} samples", on_taps(dense, taps, place="cumulative", profile=profile)
    yield "cascade", fit_taps(profile, fetches=24, mm_per_pixel=MM).kernel


def main():
    """Write the section and the figure."""
    profile = whole_profile("skin1")
    scene = make_scene(
        "head", height=PIXELS, width=PIXELS, mm_per_pixel=MM, light_degrees=LIGHT_DEGREES
    )
    truth = render_reference(scene, profile)
    exposure = auto_exposure(truth, mask=scene.mask)
    rows, drawn = [], []
    for label, kernel in kernels(profile):
        for jitter in (None, JITTER):

            def picture(k, kernel=kernel, jitter=jitter):
                return render_taps(scene, kernel, frame=k, jitter=jitter)

            image = picture(0)
            error = lightness(image, exposure) - lightness(truth, exposure)
            frames = picture if jitter else lambda _, image=image: image
            one, _, sixteen = over_frames(frames, truth, mask=scene.mask)
            figures = one.error_p99, one.noise_p99, sixteen.error_p99, sixteen.noise_p99
            cells = [label, f"{kernel.fetches:.4g}", "on" if jitter else "off"]
            rows.append(row([*cells, f"{bands(error):.3f}", *(f"{each:.2f}" for each in figures)]))
            drawn.append((f"{label},\njitter {cells[2]}", image, error))
    put_section("cascades.md", "docs/make_jitter.py", TEXT.format(rows="\n".join(rows)))
    draw(drawn, exposure, truth)


def draw(drawn, exposure, truth):
    """Draw pictures over their errors."""
    note = (
        "The middle 16 mm of pictures of 32 mm, pixels of .1 mm. Below each picture its error of "
        f"lightness, amplified {AMPLIFIED:g} times: red is too bright, blue too dark. Samples are "
        "those of the pre-integrated pass, by importance."
    )
    title = "skin1: jittered samples and cascades on the nose"
    with new_page(4.3, title, "Exact profile, light from the side", [note]) as (figure, below):
        wide = 1.04
        axes = new_mosaic(below, wide * (len(drawn) + 1) - 0.04, 2.04)
        put_picture(axes, 0.0, 0.0, codes(exposure * truth))
        for k, (_, image, error) in enumerate(drawn, start=1):
            put_picture(axes, wide * k, 0.0, codes(exposure * image))
            put_difference(axes, wide * k, 1.04, error[CROP], AMPLIFIED)
        names = ["true kernel", *(label for label, *_ in drawn)]
        axes.set_xticks([wide * k + 0.5 for k in range(len(names))], names)
        name_rows(axes)
        draw_bar(below, axes, AMPLIFIED, "CIE L* less that of the true kernel")
    save_figure(figure, DOCS / "skin1-jitter.png")


if __name__ == "__main__":
    main()
