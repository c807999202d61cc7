"""Write the section of docs/cascades.md on all eleven materials and on pictures of other kinds.

python docs/make_untuned.py
"""

import numpy as np
from make_cascades import row, scenes, whole_profile
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse, PathPatch
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D
from sections import put_section

from sssfit.fit import fit_taps
from sssfit.material import material_names
from sssfit.measure.score import measure
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene
from sssfit.scene.record import Scene

PIXELS, MM = 256, 0.3
BUDGETS = (14, 17, 24)
FINE = 8  # samples a pixel along either axis, where shapes are drawn
STRIPES_MM = (2.0, 6.0, 18.0)  # whole periods

TEXT = """The same mean over the eight pictures for all of the paper's materials, and the 99th
percentile of Delta E on pictures that no figure above was chosen by: hard stripes with periods of
2, 6 and 18 mm at 17 degrees, noise with amplitudes of 1/f, text of 3 mm, and shadows of leaves:

| material | {budgets} | {names}, all at {most} | the worst of them |
|---|{rules}|
{rows}

The worst of all, {most} fetches: {worst}. With {least} fetches: {worst_least}.
"""


def drawn(name, patches):
    """Return a scene of white shapes on black, averaged over each pixel's area.

    The patches' coordinates are pixels, y up.
    """
    figure = Figure(figsize=(PIXELS * FINE / 100, PIXELS * FINE / 100), dpi=100)
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, PIXELS), ylim=(0, PIXELS))
    axes.set_axis_off()
    for each in patches:
        each.set(antialiased=False, linewidth=0.0, facecolor="black")
        axes.add_patch(each)
    canvas.draw()
    light = 1.0 - np.asarray(canvas.buffer_rgba())[..., 0] / 255.0
    cells = light.reshape(PIXELS, FINE, PIXELS, FINE).mean(axis=(1, 3))
    return Scene(name, cells[..., None], MM)


def stripes(period_mm):
    """Return hard stripes, as wide as the gaps between them."""
    at = (np.arange(PIXELS * FINE) + 0.5) / FINE - 0.5 * PIXELS
    turn = np.radians(17.0)
    phase = (at * np.cos(turn) + at[:, None] * np.sin(turn)) * MM / period_mm
    light = (np.floor(2.0 * phase) % 2.0).reshape(PIXELS, FINE, PIXELS, FINE).mean(axis=(1, 3))
    return Scene(f"stripes {period_mm:g} mm", light[..., None], MM)


def text():
    """Return lines of letters about 3 mm tall."""
    words = "Light scatters below the surface of skin, marble, wax and milk & 0123456789 "
    turned = Affine2D().rotate_deg(5.0)
    shifts = [13 * k % len(words) for k in range(16)]
    lines = [words[k:] + words[:k] for k in shifts]
    paths = [TextPath((-10, 16 * k + 4), line, size=14) for k, line in enumerate(lines)]
    return drawn("text", [PathPatch(each.transformed(turned)) for each in paths])


def leaves():
    """Return light between the shadows of 160 leaves, ellipses of 2 to 12 mm."""
    rng = np.random.default_rng(5)
    sizes = rng.uniform(2.0, 12.0, 160) / MM
    covered = drawn("leaves", [leaf(size, rng) for size in sizes])
    return Scene("leaves", 1.0 - covered.irradiance, MM)


def leaf(size, rng):
    """Return an ellipse somewhere in the picture, .3 to .6 times as wide as long."""
    middle, width = rng.uniform(0.0, PIXELS, 2), rng.uniform(0.3, 0.6) * size
    return Ellipse(middle, size, width, angle=rng.uniform(0.0, 180.0))


def untuned():
    """Return the pictures of other kinds."""
    noise = make_scene("noise", height=PIXELS, width=PIXELS, mm_per_pixel=MM)
    return [*map(stripes, STRIPES_MM), noise, text(), leaves()]


def p99s(kernel, pictures):
    """Return the 99th percentile of Delta E of each picture beside its truth."""
    return [
        measure(render(each, kernel), truth, mask=each.mask).delta_e_2000_p99
        for each, truth in pictures
    ]


def main():
    """Write the section."""
    others = untuned()
    rows, every = [], {budget: [] for budget in BUDGETS}
    for name in material_names(paper=True):
        profile = whole_profile(name)
        known, other = (
            [(each, render_reference(each, profile)) for each in pictures]
            for pictures in (scenes(MM), others)
        )
        kernels = [fit_taps(profile, fetches=budget).kernel for budget in BUDGETS]
        means = [float(np.mean(p99s(each, known))) for each in kernels]
        for budget, kernel in zip(BUDGETS, kernels, strict=True):
            shown = p99s(kernel, other)
            every[budget] += [(e, f"{name}, {s.name}") for e, s in zip(shown, others, strict=True)]
        most = max((e, s.name) for e, s in zip(shown, others, strict=True))
        cells = [*(f"{each:.2f}" for each in means), *(f"{each:.2f}" for each in shown)]
        rows.append(row([name, *cells, f"{most[0]:.2f} ({most[1]})"]))
        print(rows[-1], flush=True)
    worst = {budget: max(each) for budget, each in every.items()}
    names = [each.name for each in others]
    text = TEXT.format(
        budgets=" | ".join(f"{budget} fetches" for budget in BUDGETS),
        names=" | ".join(names),
        rules="---|" * (len(BUDGETS) + len(names)) + "---",
        rows="\n".join(rows),
        most=BUDGETS[-1],
        least=BUDGETS[0],
        worst="{1}: {0:.2f}".format(*worst[BUDGETS[-1]]),
        worst_least="{1}: {0:.2f}".format(*worst[BUDGETS[0]]),
    )
    put_section("cascades.md", "docs/make_untuned.py", text)


if __name__ == "__main__":
    main()
