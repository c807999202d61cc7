"""Write the section of docs/cascades.md on samples and banding, and draw docs/skin1-samples.png.

python docs/make_samples.py
"""

import numpy as np
from make_cascades import row, whole_profile
from matplotlib.lines import Line2D
from sections import DOCS, put_section

from sssfit.chart.looks import METHODS, tinted
from sssfit.chart.page import (
    LINE_STYLES,
    add_legend,
    draw_bar,
    name_axes,
    new_mosaic,
    new_page,
    put_difference,
    put_picture,
    save_figure,
    tick,
)
from sssfit.fit import fit_preintegrated, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.formats.colours import srgb_encode
from sssfit.measure.delta_e import auto_exposure, lab, shown
from sssfit.measure.score import measure
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene

PIXELS, MM = 320, 0.1
LIGHT_DEGREES = 75.0  # its border runs along the nose, nearly upright
LONGEST_MM = 4.0  # period that counts as a band
AMPLIFIED = 40.0
CROP = (slice(80, 240), slice(70, 230))  # what is drawn, of all that is measured
# Taps a pass of the pre-integrated pass: 9, 17 and 33 of figure 5 of RR-02-12, 13 and 65 of figure
# S.6 of Jimenez et al. 2015.
QUADRATIC, IMPORTANCE = (9, 17, 33), (13, 65)
FETCHES = (14, 24)

# The more samples or fetches, the darker is the method's colour; dashed by importance.
PASS, CASCADE = METHODS["preintegrated"].colour, METHODS["cascade"].colour
LINES = (
    *((tinted(PASS, share), "-") for share in (0.35, 0.65, 1.0)),
    *((tinted(PASS, share), LINE_STYLES[1]) for share in (0.65, 1.0)),
    *((tinted(CASCADE, 0.5), "-"), (CASCADE, "-")),
)

TEXT = """## Samples and bands

Figure 5 of RR-02-12 shows a face with 9, 17 and 33 samples a pass, figure S.6 of Jimenez et al.
(2015) an extreme close-up with 13 and 65: with few samples, harsh light leaves bands. Here is skin1
on the nose, 320 x 320 pixels of 0.1 mm, lit from the side. The samples of the pre-integrated pass
lie at quadratic distances, as in the report, or by importance (equal shares of the cube root of the
weights), as in the supplement:

![The nose with few and many samples, and by cascades, with errors and spectra](skin1-samples.png)

A band is what the error of lightness holds along x at periods from two pixels to {longest:g} mm, as
a root mean square of CIE L*:

| kernel | fetches | passes | bands, L* | 95th / 99th percentile of Delta E |
|---|---|---|---|---|
{rows}
"""


def kernels(profile):
    """Yield a label and a table of taps."""
    dense = fit_preintegrated(profile, mm_per_pixel=MM).kernel
    for count in QUADRATIC:
        taps = on_taps(dense, count, place="quadratic", profile=profile)
        yield f"{count} samples, quadratic", taps
    for count in IMPORTANCE:
        taps = on_taps(dense, count, place="cumulative", profile=profile)
        yield f"{count} samples, importance", taps
    for budget in FETCHES:
        taps = fit_taps(profile, fetches=budget, mm_per_pixel=MM).kernel
        yield f"cascade, {budget} fetches", taps


def lightness(picture, exposure):
    """Return CIE L* of a picture as a screen shows it."""
    flat = shown(picture.reshape(-1, 3), exposure)
    return lab(flat)[:, 0].reshape(picture.shape[:2])


def spectrum(error):
    """Return frequencies along x [1/mm] and the mean square of L* that each holds."""
    window = np.hanning(error.shape[1])
    rows = np.fft.rfft((error - error.mean(axis=1, keepdims=True)) * window, axis=1)
    square = 2.0 * np.mean(np.abs(rows) ** 2, axis=0) / (len(window) * np.sum(window**2))
    return np.fft.rfftfreq(error.shape[1], MM), square


def bands(error):
    """Return the root mean square of L* in bands."""
    frequency, square = spectrum(error)
    return float(np.sqrt(square[frequency >= 1.0 / LONGEST_MM].sum()))


def codes(picture):
    """Return what is drawn of a picture, in sRGB."""
    return srgb_encode(np.clip(picture[CROP], 0.0, 1.0))


def name_rows(axes):
    """Write what the two rows of a mosaic are."""
    axes.set_yticks([0.5, 1.54], ["picture", "its error"])


def draw(found, exposure, truth):
    """Draw pictures, errors and spectra."""
    note = (
        "The middle 16 mm of pictures of 32 mm, pixels of .1 mm. Below each picture its error of "
        f"lightness, amplified {AMPLIFIED:g} times: red is too bright, blue too dark. Curves: "
        "amplitude of that error at each frequency along x, of its mean square over all rows, Hann "
        "window. Samples are those of the pre-integrated pass, at quadratic distances or by "
        "importance."
    )
    title = "skin1: samples, bands and cascades on the nose"
    with new_page(6.6, title, "Exact profile, light from the side", [note]) as (figure, below):
        upper, lower = below.subfigures(2, 1, height_ratios=(1.15, 1.0))
        wide = 1.04
        axes = new_mosaic(upper, wide * (len(found) + 1) - 0.04, 2.04)
        put_picture(axes, 0.0, 0.0, codes(exposure * truth))
        for k, (_, _, image, error) in enumerate(found, start=1):
            put_picture(axes, wide * k, 0.0, codes(exposure * image))
            put_difference(axes, wide * k, 1.04, error[CROP], AMPLIFIED)
        names = ["true kernel", *(label.replace(", ", "\n") for label, *_ in found)]
        axes.set_xticks([wide * k + 0.5 for k in range(len(names))], names)
        name_rows(axes)
        draw_bar(upper, axes, AMPLIFIED, "CIE L* less that of the true kernel")
        labels = [label for label, *_ in found]
        handles = [Line2D([], [], color=each, ls=style) for each, style in LINES]
        panel = add_legend(lower, handles, labels).subplots()
        for (colour, style), (*_, error) in zip(LINES, found, strict=True):
            frequency, square = spectrum(error)
            panel.plot(frequency[1:], np.sqrt(square[1:]), color=colour, ls=style)
        panel.set_yscale("log")
        panel.set_xlim(0.0, 0.5 / MM)
        longest = 1.0 / LONGEST_MM
        panel.axvline(longest, color="#666666", lw=0.8, ls=(0, (1, 2)))
        words = {"textcoords": "offset points", "size": 7.5, "color": "#444444", "va": "top"}
        panel.annotate(f"period of {LONGEST_MM:g} mm", (longest, 0.5), (3, 0), **words)
        panel.set_ylim(None, 0.6)
        tick(panel.xaxis)
        name_axes(panel, "", "frequency along x (cycles a millimetre)", "amplitude (CIE L*)")
    save_figure(figure, DOCS / "skin1-samples.png")


def main():
    """Write the section and the figure."""
    profile = whole_profile("skin1")
    scene = make_scene(
        "head", height=PIXELS, width=PIXELS, mm_per_pixel=MM, light_degrees=LIGHT_DEGREES
    )
    truth = render_reference(scene, profile)
    exposure = auto_exposure(truth, mask=scene.mask)
    found, rows = [], []
    for label, kernel in kernels(profile):
        image = render(scene, kernel)
        error = lightness(image, exposure) - lightness(truth, exposure)
        score = measure(image, truth, mask=scene.mask)
        found.append((label, kernel, image, error))
        seen = f"{score.delta_e_2000_p95:.2f} / {score.delta_e_2000_p99:.2f}"
        cost = f"{kernel.fetches:.4g}", str(kernel.passes)
        rows.append(row([label, *cost, f"{bands(error):.3f}", seen]))
    text = TEXT.format(rows="\n".join(rows), longest=LONGEST_MM)
    put_section("cascades.md", "docs/make_samples.py", text)
    draw(found, exposure, truth)


if __name__ == "__main__":
    main()
