"""Write the guided fit's comparison of extents in docs/fits.md.

python docs/make_guided.py

Minutes: 66 fits for each of three rules that say where x = 1 in the guide function.
"""

import datetime
import warnings

import numpy as np
from sections import put_section
from threadpoolctl import threadpool_limits

from sssfit.errors import SssfitWarning
from sssfit.fit import make_target, support_of
from sssfit.fit._result import fit_channels
from sssfit.fit.guided import extents_of, fit_one_pass
from sssfit.material import load_material, material_names
from sssfit.measure.score import measure
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact

KS = (0.0, 0.5, 1.0, 1.55, 2.0, 3.0, 4.0)
SCORED_KS = (0.0, 0.5, 1.0, 1.55, 2.0, 4.0)
HALF = 72  # pixels at least .3 mm wide; no guided fit here takes a second
PICTURES = {
    "disk": {},
    "edge": {"angle_degrees": 30.0},
    "head": {},
}
SIZE = 256


def reach(target):
    """Half width of the support, to the outer edge of its pixels [mm]."""
    return target.mm_per_pixel * (target.half_pixels + 0.5)


def shared(target):
    """One extent for all channels: the support, as the supplement reads."""
    return np.full(target.profile.n_channels, reach(target))


def by_energy(target):
    """Return the radius that keeps 99.9 % of each channel's energy."""
    cumulative = target.profile.cumulative
    return target.profile.r_edges_mm[np.argmax(cumulative >= 0.999 * cumulative[-1], axis=0)]


RULES = {"the support, shared": shared, "mean free path": extents_of, "energy": by_energy}


def target_of(material, support_mm=None):
    """Exact profile on pixels of .3 mm, or wider where the support is."""
    profile = simulate_exact(material)
    return make_target(profile, max(0.3, support_of(profile) / HALF), support_mm)


def nearest_row(target, extent_mm, channel):
    """By k, half the sum over pixels of |pass - pre-integrated pass|, both of sum 1."""
    line = target.half_line()[:, channel]
    line = line / (target.copies @ line)
    apart = []
    for k in KS:
        half = fit_one_pass(target, channel, extent_mm, k, 50.0, 1.0).half[0]
        half = half / (target.copies @ half)
        apart.append(0.5 * target.copies @ np.abs(half - line))
    return apart


def nearest_table(material):
    """Rows of skin1: support, rule, channel, and how far each k is from the pre-integrated pass."""
    rows = []
    for support_mm in (6.0, 12.0, None):
        target = target_of(material, support_mm)
        for name, rule in RULES.items():
            extents = rule(target)
            for c, channel in enumerate(target.profile.channels):
                apart = nearest_row(target, extents[c], c)
                best = KS[int(np.argmin(apart))]
                figures = " | ".join(f"{each:.3f}" for each in apart)
                rows.append(
                    f"| {reach(target):.1f} | {name} | {channel}, {extents[c]:.1f} | {figures} "
                    f"| {best:g} |"
                )
    return rows


def scores(material):
    """Mean and 99th percentile of Delta E over the pictures (rule, k, picture, 2)."""
    target = target_of(material)
    scenes = [
        make_scene(name, height=SIZE, width=SIZE, mm_per_pixel=target.mm_per_pixel, **options)
        for name, options in PICTURES.items()
    ]
    truths = [render_reference(each, target.profile) for each in scenes]
    found = np.empty((len(RULES), len(SCORED_KS), len(scenes), 2))
    for r, rule in enumerate(RULES.values()):
        extents = rule(target)
        for i, k in enumerate(SCORED_KS):
            fit = fit_channels(
                target,
                "guided",
                lambda c, e=extents, k=k: fit_one_pass(target, c, e[c], k, 50.0, 1.0),
                settings={},
            )
            for s, (scene, truth) in enumerate(zip(scenes, truths, strict=True)):
                score = measure(render_separable(scene, fit.kernel), truth, mask=scene.mask)
                found[r, i, s] = score.delta_e_2000_mean, score.delta_e_2000_p99
    return found


def score_table(found):
    """Rows of means over the materials (material, rule, k, picture, 2)."""
    rows = []
    for r, name in enumerate(RULES):
        for i, k in enumerate(SCORED_KS):
            cells = [*found[:, r, i].mean(axis=0), found[:, r, i].mean(axis=(0, 1))]
            figures = " | ".join(f"{mean:.2f}, {most:.1f}" for mean, most in cells)
            rows.append(f"| {name} | {k:g} | {figures} |")
    best = found.mean(axis=3).min(axis=2).mean(axis=0)
    words = [
        f"{name} {mean:.3f}, {most:.2f}" for name, (mean, most) in zip(RULES, best, strict=True)
    ]
    return [*rows, "", f"With the best k for each material: {'; '.join(words)}."]


TEXT = """### What k and b refer to

Made on {date} by `python docs/make_guided.py`. Exact profiles, pixels of .3 mm, or wider where the
support requires it. The table shows how far the pass of each k is from the pre-integrated pass
(half the sum of absolute differences, both passes scaled to sum 1), for skin1 on three supports
(outer edge, mm). The extent, where x = 1 in Gamma, follows the channel's name (mm):

| support | x = 1 by | channel, extent | {ks} | nearest k |
|---|---|---|{bars}---|
{nearest}

Mean and 99th percentile of Delta E 2000 against the true kernel, averaged over all {materials}
materials:

| x = 1 by | k | {pictures} | all |
|---|---|{picture_bars}---|
{scored}
"""


def section():
    """Return the section's text."""
    names = material_names(paper=True)
    with warnings.catch_warnings(), threadpool_limits(1, user_api="blas"):
        warnings.simplefilter("ignore", SssfitWarning)
        found = np.stack([scores(load_material(name)) for name in names])
        nearest = nearest_table(load_material("skin1"))
    return TEXT.format(
        date=datetime.date.today().isoformat(),
        ks=" | ".join(f"k = {k:g}" for k in KS),
        bars="---|" * len(KS),
        nearest="\n".join(nearest),
        materials=len(names),
        pictures=" | ".join(PICTURES),
        picture_bars="---|" * len(PICTURES),
        scored="\n".join(score_table(found)),
    )


def main():
    """Put the section in its place."""
    put_section("fits.md", "docs/make_guided.py", section())


if __name__ == "__main__":
    main()
