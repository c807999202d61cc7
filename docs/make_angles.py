"""Write the table of docs/theory.md on exit angles, and its figure, skin1.angles.png.

    python docs/make_angles.py

Is the light that leaves Lambertian times Fresnel's transmittance, as shaders take it for? The exact
solver says it without noise, of all annuli together; a walk says it by annulus.
"""

import numpy as np
from sections import DOCS, put_section

from sssfit.chart.angles import angles_figure
from sssfit.chart.page import save_figure
from sssfit.material import load_material, material_names
from sssfit.profile.directions import angular_reflectance, solid_angles
from sssfit.simulate import simulate_exact, simulate_montecarlo

BINS = 90
AT = (0.5, 30.5, 60.5, 80.5)  # degrees, middles of bins
NEAR_MFP, PHOTONS = 1.0, 40_000_000

HEAD = """\
Made by `python docs/make_angles.py`: R_d by exit angle of the exact solver, over that of a medium
that returns the same light, Lambertian inside, through Fresnel's transmittance (`sssfit simulate
NAME --method exact --angles 90`). Misplaced is half the sum of the differences by angle, as a share
of the light: what leaves at another angle than in a shader. The albedo is that of single
scattering.

| material | albedo | at 0° | 30° | 60° | 80° | misplaced |
|---|---|---|---|---|---|---|
"""
NEAR = """
Far from the beam the angular distribution differs more than near it. The table gives the share of
skin1's light that is misplaced in angle, from the walk ({photons:,} photons, `--angles 30`) and
with its noise included:

| skin1, light | R | G | B |
|---|---|---|---|
"""


def rows():
    """Return the ratio at four angles and what is misplaced, a row for each channel."""
    for name in material_names(paper=True):
        material = load_material(name)
        curve = angular_reflectance(simulate_exact(material, angles=BINS))
        for c, channel in enumerate(material.channels):
            at = [np.interp(angle, curve.angles_deg, curve.ratio[:, c]) for angle in AT]
            ratios = " | ".join(f"{each:.3f}" for each in at)
            albedo, misplaced = material.layers[0].albedo[c], 100.0 * curve.misplaced[c]
            yield f"| {name} {channel} | {albedo:.4f} | {ratios} | {misplaced:.2f} % |"


def near_rows(profile):
    """Return what is misplaced of the light within a mean free path of the beam, and beyond."""
    within, beyond = [], []
    for c in range(profile.n_channels):
        mfp = float(profile.material.layers[0].mean_free_path_mm[c])
        last = int(np.searchsorted(profile.r_edges_mm, NEAR_MFP * mfp))
        for part, found in ((slice(0, last), within), (slice(last, None), beyond)):
            found.append(_misplaced(profile, part, c))
    yield "| within a mean free path | " + " | ".join(within) + " |"
    yield "| beyond it | " + " | ".join(beyond) + " |"


def _misplaced(profile, part, c):
    energy = profile.angle_reflected[part, :, c].sum(axis=0)
    curve = angular_reflectance(profile)
    shares = curve.lambertian[:, c] * solid_angles(curve.edges_rad)
    lambertian = shares / shares.sum() * energy.sum()
    return f"{50.0 * np.abs(energy - lambertian).sum() / energy.sum():.1f} %"


def main():
    """Write both."""
    profile = simulate_montecarlo(load_material("skin1"), photons=PHOTONS, angles=30)
    save_figure(angles_figure(angular_reflectance(profile)), DOCS / "skin1.angles.png")
    page = HEAD + "\n".join(rows()) + "\n" + NEAR.format(photons=PHOTONS)
    put_section("theory.md", "docs/make_angles.py", page + "\n".join(near_rows(profile)))


if __name__ == "__main__":
    main()
