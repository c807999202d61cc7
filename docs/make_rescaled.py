"""Write a section of docs/how-to-choose.md: SVD rescaled, SVD kept and Gaussians as seen.

python docs/make_rescaled.py
"""

from sections import put_section

from sssfit.compare.candidates import Candidate
from sssfit.compare.references import border_of, evaluated_scene
from sssfit.compare.sheet import PIXELS, SCENES
from sssfit.fit import MM_PER_PIXEL, support_of
from sssfit.material import load_material
from sssfit.measure.score import auto_exposure, measure
from sssfit.render.reference import render_reference
from sssfit.render.separable import render_separable
from sssfit.scene.made import make_scene
from sssfit.simulate import simulate_exact

MATERIALS = ("skin1", "marble", "ketchup", "wholemilk")
RANKS = range(1, 7)

TEXT = """## Does rescaled SVD look better?

The supplement (section B) says that SVD rescaled to the profile's energy, though no longer the
best in the L2 sense, "still provides a perceptionally better match than the Gaussian
approximation with the same number of terms". It does not compare it with SVD that keeps its
energy. Mean Delta E 2000 against the 2D kernel, {pixels} x {pixels} pixels of {pitch:g} mm, N
terms: **rescaled / kept / Gaussians**.

{tables}

Rescaled SVD is better than the same number of Gaussians in {gaussians} of {count} cases:
{exceptions}. Rescaled is better than kept in {kept} of {count}; for each N, of {each}: {by_rank}.
With {most} terms the worst of all cases is {worst_rescaled:.2f} rescaled, {worst_kept:.2f} kept
and {worst_gaussians:.2f} with Gaussians.

**Light beyond the grid.** Rescaled kernels return this light too near to the beam; kept kernels
lose it. The true picture takes it from the mean of the picture, or from black around the disk. With
{most} terms, on the head:

| | energy beyond the grid, R G B | rescaled | kept |
|---|---|---|---|
{lost}
"""


def judged(material):
    """Mean Delta E by (scene, rank): rescaled, kept, Gaussians; shares of light off the grid."""
    profile = simulate_exact(load_material(material))
    support = support_of(profile)
    found = {}
    size = {"height": PIXELS, "width": PIXELS, "mm_per_pixel": MM_PER_PIXEL}
    scenes = [evaluated_scene(make_scene(each, **size), profile) for each in SCENES]
    truths = [render_reference(each, profile, border=border_of(each)) for each in scenes]
    for n in RANKS:
        kernels = [each.fit(profile, MM_PER_PIXEL, support).kernel for each in methods(n)]
        for scene, truth in zip(scenes, truths, strict=True):
            exposure = auto_exposure(truth, scene.mask)
            found[scene.name, n] = tuple(
                measure(
                    render_separable(scene, kernel, border=border_of(scene)),
                    truth,
                    exposure=exposure,
                    mask=scene.mask,
                ).delta_e_2000_mean
                for kernel in kernels
            )
    return found, profile.beyond_grid / profile.diffuse_reflectance


def methods(n):
    """Return the three kernels of n terms."""
    return (
        Candidate("rescaled", "svd", n, {"rank": n}),
        Candidate("kept", "svd", n, {"rank": n, "energy": "keep"}),
        Candidate("Gaussians", "gaussians", n, {"terms": n}),
    )


def table(material, found):
    """One material as a table."""
    rows = [f"| {material}, N | {' | '.join(SCENES)} |", f"|---|{'---|' * len(SCENES)}"]
    for n in RANKS:
        cells = [" / ".join(f"{each:.2f}" for each in found[name, n]) for name in SCENES]
        rows.append(f"| {n} | {' | '.join(cells)} |")
    return "\n".join(rows)


def lost_row(material, found, lost):
    """Say what lies beyond the grid, and what that does to the head."""
    shares = " ".join(f"{100.0 * each:.2f} %" for each in lost)
    values = found["head", RANKS[-1]]
    return f"| {material} | {shares} | {values[0]:.2f} | {values[1]:.2f} |"


def section():
    """Return the section's text."""
    by_material = {each: judged(each) for each in MATERIALS}
    cases = {
        (material, *key): values
        for material, (found, _) in by_material.items()
        for key, values in found.items()
    }
    worse = [
        f"{material}, {scene}, N = {n}" for (material, scene, n), v in cases.items() if v[0] > v[2]
    ]
    ranks = {n: [v for key, v in cases.items() if key[2] == n] for n in RANKS}
    worst = [max(values[k] for values in ranks[RANKS[-1]]) for k in range(3)]
    return TEXT.format(
        pixels=PIXELS,
        pitch=MM_PER_PIXEL,
        tables="\n\n".join(table(each, found) for each, (found, _) in by_material.items()),
        lost="\n".join(lost_row(each, *found) for each, found in by_material.items()),
        gaussians=sum(v[0] < v[2] for v in cases.values()),
        kept=sum(v[0] < v[1] for v in cases.values()),
        count=len(cases),
        each=len(ranks[1]),
        exceptions=f"not for {'; '.join(worse)}" if worse else "the claim holds",
        by_rank=", ".join(str(sum(v[0] < v[1] for v in each)) for each in ranks.values()),
        most=RANKS[-1],
        worst_rescaled=worst[0],
        worst_kept=worst[1],
        worst_gaussians=worst[2],
    )


def main():
    """Put the section in its place."""
    put_section("how-to-choose.md", "docs/make_rescaled.py", section())


if __name__ == "__main__":
    main()
