"""Write a section of docs/how-to-choose.md: SVD rescaled, SVD kept and Gaussians as seen.

python docs/make_rescaled.py
"""

import dataclasses
from pathlib import Path

from sssfit.compare.candidates import Candidate
from sssfit.compare.metrics import auto_exposure, measure
from sssfit.compare.sheet import MM_PER_PIXEL, PIXELS, SCENES
from sssfit.fit import support_of
from sssfit.material import load_material
from sssfit.render.irradiance import make_scene
from sssfit.render.reference import reference_quadrant, render_reference
from sssfit.render.separable import render_separable
from sssfit.simulate import simulate_exact

ROOT = Path(__file__).parents[1]
MATERIALS = ("skin1", "marble", "ketchup", "wholemilk")
RANKS = range(1, 7)
START, END = "<!-- made by docs/make_rescaled.py -->", "<!-- end of make_rescaled.py -->"

TEXT = """## Is SVD rescaled the better one to look at?

The supplement (section B) says that SVD rescaled to the profile's energy, though no longer best in
the L2 sense, "still provides a perceptionally better match than the Gaussian approximation with
the same number of terms". It says nothing of rescaled against kept. Mean Delta E 2000 against the
2D kernel, {pixels} x {pixels} pixels of {pitch:g} mm, N terms: **rescaled / kept / Gaussians**.
Rescaled and Gaussians have the energy of the truth's pixels.

{tables}

Rescaled is nearer than the same number of Gaussians in {gaussians} of {count} cases: {exceptions}.
Rescaled is nearer than kept in {kept} of {count}; N by N, of {each} each: {by_rank}.
With {most} terms the worst of all cases is {worst_rescaled:.2f} rescaled, {worst_kept:.2f} kept and
{worst_gaussians:.2f} by Gaussians.

**Whose energy.** `sssfit fit` rescales to all of the diffuse reflectance, what lies beyond the grid
too, and the truth on a picture holds the light of its own pixels only. Where much is lost that is
all that the head's Delta E shows, whatever the rank; as fitted, {most} terms:

| | energy not in the truth, R G B | Delta E on the head, as fitted | with the truth's energy |
|---|---|---|---|
{lost}
"""


def judged(material):
    """Mean Delta E by (scene, rank): rescaled, kept, Gaussians, rescaled as fitted; light lost."""
    profile = simulate_exact(load_material(material))
    support = support_of(profile)
    found = {}
    scenes = [
        make_scene(each, height=PIXELS, width=PIXELS, mm_per_pixel=MM_PER_PIXEL) for each in SCENES
    ]
    truths = [render_reference(each, profile) for each in scenes]
    left_out = reference_quadrant(profile, MM_PER_PIXEL, PIXELS, PIXELS)[1]
    energy = profile.diffuse_reflectance - left_out
    for n in RANKS:
        rescaled, kept, gaussians = (
            each.fit(profile, MM_PER_PIXEL, support).kernel for each in methods(n)
        )
        kernels = (with_energy(rescaled, energy), kept, with_energy(gaussians, energy), rescaled)
        for scene, truth in zip(scenes, truths, strict=True):
            exposure = auto_exposure(truth, scene.mask)
            found[scene.name, n] = tuple(
                measure(
                    render_separable(scene, kernel), truth, exposure=exposure, mask=scene.mask
                ).delta_e_2000_mean
                for kernel in kernels
            )
    return found, left_out / profile.diffuse_reflectance


def with_energy(kernel, energy):
    """Return the kernel with another sum over its pixels (C,)."""
    return dataclasses.replace(kernel, scale=energy / kernel.energy)


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
        cells = [" / ".join(f"{each:.2f}" for each in found[name, n][:3]) for name in SCENES]
        rows.append(f"| {n} | {' | '.join(cells)} |")
    return "\n".join(rows)


def lost_row(material, found, lost):
    """Say what the truth lacks, and what that does to the head."""
    shares = " ".join(f"{100.0 * each:.2f} %" for each in lost)
    values = found["head", RANKS[-1]]
    return f"| {material} | {shares} | {values[3]:.2f} | {values[0]:.2f} |"


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
    path = ROOT / "docs" / "how-to-choose.md"
    before, _, rest = path.read_text(encoding="utf-8").partition(START)
    after = rest.partition(END)[2] or "\n"
    text = f"{before.rstrip()}\n\n{START}\n\n{section()}\n{END}{after}"
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
