"""Write the section of docs/cascades.md on mask borders in engines and here.

python docs/make_borders.py
"""

import numpy as np
from make_shading import PITCH_MM, PIXELS, flat_plane, objects, row, shown, true_within
from sections import put_section

from sssfit.fit import fit_preintegrated, fit_taps
from sssfit.fit.on_taps import on_taps
from sssfit.material import load_material
from sssfit.render.screen_taps import render_screen_taps
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact

FETCHES = 25
BEST = "1-1|2-2|2-2"
FOREIGN = 0.001  # coverage of a fetch below which Godot's loop ends
RULES = {"stops": "stops at the first foreign fetch", "sums": "divided by the weights used"}

TEXT = """The edge of light at 30 degrees on the disk, halves and strip above (skin1, exact profile,
0.3 mm), nothing but black around them. The same pre-integrated pair of {fetches} fetches a pass by
three rules, and last a cascade:

- **stops at the first foreign fetch**: on either side the loop ends where a fetch finds no coverage
  (below {foreign}), and the pixel is divided by the weights it got, as in Godot's
  `subsurface_scattering.glsl`, `do_filter`.
- **divided by the weights used**: fetches whose nearest texel is foreign are left out, and each of
  the others counts with its whole weight.
- **divided by coverage**: ours, sum w A E / sum w A; a fetch that is half black counts half.

Mean / 99th percentile of Delta E 2000 against the true kernel; and of constant light 1 the darkest
value on the object, which with a kernel of energy 1 should be 1:

| kernel and rule | disk | halves | strip | light 1, disk | halves | strip |
|---|---|---|---|---|---|---|
{rows}

A bilinear fetch at an outline is partly black, and the rules that ship count it in full, so the
outline darkens in both passes. A loop that stops also misses the light beyond the gap between the
halves. In the strip, narrower than the blur, no rule stands out.
"""


def fetched(picture, axis, offset):
    """Return bilinear fetches so many pixels away along an axis, clamped at the border."""
    size = picture.shape[axis]
    whole = int(np.floor(offset))
    near, far = (np.clip(np.arange(size) + whole + k, 0, size - 1) for k in (0, 1))
    part = offset - whole
    return (1.0 - part) * picture.take(near, axis) + part * picture.take(far, axis)


def one_pass(light, coverage, stage, axis, rule):
    """Return a pass on light (H, W, C), black outside the object, by an engine's rule."""
    total = stage.weights[0] * light
    part = np.broadcast_to(stage.weights[0], light.shape).copy()
    for side in (-1.0, 1.0):
        used = np.ones(coverage.shape, bool)
        for away, weight in zip(stage.offsets_mm / PITCH_MM, stage.weights[1:], strict=True):
            there = fetched(coverage, axis, side * away)
            used = used & (there >= FOREIGN) if rule == "stops" else there >= 0.5
            total += used[..., None] * weight * fetched(light, axis, side * away)
            part += used[..., None] * weight
    return coverage[..., None] * total / part


def by_engines(irradiance, coverage, taps, rule):
    """Return what a single pair shows of an object by an engine's rule."""
    light = np.repeat(irradiance, len(taps.channels), axis=2) * coverage[..., None]
    for axis in (1, 0):
        light = one_pass(light, coverage, taps.stages[0], axis, rule)
    return light * taps.energy


def by_coverage(irradiance, coverage, taps):
    """Return what a table of taps shows of an object, divided by coverage."""
    shown = render_screen_taps(flat_plane(irradiance, coverage), taps, follow="none")
    return np.where(coverage[..., None] > 0.0, shown, 0.0)


def ways(profile):
    """Yield a label and what a kernel by a rule makes of irradiance and coverage, of energy 1."""
    pair = on_taps(fit_preintegrated(profile).kernel, FETCHES)
    for rule, words in RULES.items():
        yield words, pair.energy, lambda e, a, rule=rule: by_engines(e, a, pair, rule)
    yield "divided by coverage", pair.energy, lambda e, a: by_coverage(e, a, pair)
    cascade = fit_taps(profile, stages=BEST).kernel
    yield f"{BEST}, by coverage", cascade.energy, lambda e, a: by_coverage(e, a, cascade)


def border_rows(profile):
    """Return a row for each way."""
    size = {"height": PIXELS, "width": PIXELS, "mm_per_pixel": PITCH_MM}
    lit = make_scene("edge", **size, angle_degrees=30.0)
    cases = [(each, true_within(lit, each, profile)) for each in objects()]
    for label, energy, make in ways(profile):
        errors = [shown(make(lit.irradiance, each), truth, each) for each, truth in cases]
        ones = np.ones((PIXELS, PIXELS, 1))
        darkest = [(make(ones, each) / energy)[each > 0.0].min() for each, _ in cases]
        yield row(label, *errors, *(f"{each:.2f}" for each in darkest))


def main():
    """Write the section."""
    rows = "\n".join(border_rows(simulate_exact(load_material("skin1"))))
    text = TEXT.format(rows=rows, fetches=FETCHES, foreign=FOREIGN)
    put_section("cascades.md", "docs/make_borders.py", text)


if __name__ == "__main__":
    main()
