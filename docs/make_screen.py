"""Write the figures of docs/screen-space.md: skin1's artist kernel on slopes and at steps.

python docs/make_screen.py
"""

import numpy as np
from sections import put_section

from sssfit.fit import fit_artist
from sssfit.material import load_material
from sssfit.render.screen import lerp_falloff, render_screen
from sssfit.scene.record import Scene
from sssfit.shapes import gaussian_line_integral
from sssfit.simulate import simulate_exact

SLOPES = (0, 15, 30, 45, 60, 75)
STEPS_MM = (0.2, 0.5, 1, 2, 5, 10)
FAR_MM = 1e7  # seen from so far that a slope is the same for all pixels
WAYS = (
    ("gaussian, none", {"follow": "gaussian", "lost": "none"}),
    ("gaussian, middle", {"follow": "gaussian", "lost": "middle"}),
    ("gaussian, mean", {"follow": "gaussian", "lost": "mean"}),
    ("lerp", {"follow": "lerp"}),
    ("no following", {"follow": "none"}),
)

TEXT = """skin1, exact profile, `artist` at {pitch:.3g} mm per pixel: near and far variances
R {v[R]}, G {v[G]}, B {v[B]} mm^2, weight of the near Gaussian {w[R]:.2f} {w[G]:.2f} {w[B]:.2f}.

**Slopes.** The response of one pass to a lit line on a plane tilted by an angle, compared with
the exact form per area of surface, sum w G(x, v cos^2): sum of absolute differences over the sum,
R G B in percent.

| angle | {heads} |
|---|{rules}|
{slopes}

The share of even light that one pass with "gaussian, none" keeps, R G B in percent (all others
keep 100):

| angle | exact form: the cosine | factor |
|---|---|---|
{kept}

The factor is nowhere smaller than the exact form, so the difference between the two columns is
also the sum of absolute differences, as a share of the flat pass.

**Energy on a slope in perspective.** A lit disk 20 mm wide on the screen, on a plane tilted about
the vertical through its middle, 300 mm away, 0.5 mm per pixel (both passes; pixels are weighted
by the surface they show, d^3). Outgoing energy over incoming energy times diffuse reflectance,
less 1, R G B in percent:

| angle | {heads} |
|---|{rules}|
{drift}

**Steps.** Of the light beyond a step of height dz the exact form keeps w exp(-dz^2 / 2 v_near) +
(1 - w) exp(-dz^2 / 2 v_far), and the factor keeps exp(-dz^2 / 2 v_far); R G B in percent. The
difference between them is the error:

| step mm | exact form | factor | lerp |
|---|---|---|---|
{steps}
"""


def figures(kernel):
    """Return near and far variances and the near one's share, each (C,)."""
    found = [kernel.parameters[name] for name in kernel.channels]
    return (np.array([each[key] for each in found]) for key in ("near_mm2", "far_mm2", "weight"))


def response(kernel, degrees, settings):
    """Return what a pass makes of a lit pixel on the slope (P, C), of a flat sum of 1."""
    h, pitch = kernel.half_pixels, kernel.mm_per_pixel
    width = 4 * h + 1
    lit = np.zeros((1, width, 1))
    lit[0, 2 * h] = 1.0
    x_mm = pitch * (np.arange(width) - 2 * h)
    depth_mm = FAR_MM + np.tan(np.radians(degrees)) * x_mm[None]
    scene = Scene("slope", lit, pitch, distance_mm=FAR_MM, depth_mm=depth_mm)
    # One row, mirrored: the vertical pass only multiplies by its sum.
    row = render_screen(scene, kernel, border="mirror", **settings)[0]
    return row[h : 3 * h + 1] / (kernel.energy * kernel.scale)


def exact(kernel, degrees):
    """Return the exact form per area of surface, integrated over the pixels (P, C)."""
    near, far, share = figures(kernel)
    h, cosine = kernel.half_pixels, np.cos(np.radians(degrees))
    edges = (kernel.mm_per_pixel * (np.arange(2 * h + 2) - h - 0.5))[:, None]
    narrow, wide = (
        gaussian_line_integral(edges[:-1], edges[1:], v * cosine**2) for v in (near, far)
    )
    return share * narrow + (1.0 - share) * wide


def percent(values):
    """Return a value per channel as text."""
    return " ".join(f"{100.0 * each:.1f}".replace("-0.0", "0.0") for each in values)


def slope_row(kernel, degrees, responses):
    """Return a slope's errors, in each of the ways, as a line of the table."""
    truth = exact(kernel, degrees)
    truth = truth / truth.sum(axis=0)  # as the pass: all of the energy within the support
    errors = [percent(np.abs(each - truth).sum(axis=0)) for each in responses]
    return f"| {degrees} | {' | '.join(errors)} |"


def kept_row(degrees, responses):
    """Return what is kept where lost light stays lost, the first of the ways."""
    kept = responses[0].sum(axis=0)
    return f"| {degrees} | {100.0 * np.cos(np.radians(degrees)):.1f} | {percent(kept)} |"


def drift_row(kernel, degrees):
    """Return how much energy both passes gain or lose on a slope seen in perspective."""
    pitch, distance_mm = 0.5, 300.0
    u = pitch * (np.arange(129) - 64)
    lit = (np.hypot(u[:, None], u) < 10.0)[..., None].astype(float)
    # The ray through u meets the plane z = distance + x tan at this depth.
    depth_mm = distance_mm**2 / (distance_mm - np.tan(np.radians(degrees)) * u)
    depth_mm = np.broadcast_to(depth_mm, (len(u), len(u)))
    scene = Scene("disk", lit, pitch, distance_mm=distance_mm, depth_mm=depth_mm)
    area = depth_mm[..., None] ** 3
    energy_in = (area * lit).sum(axis=(0, 1)) * kernel.energy * kernel.scale
    drifts = [
        (area * render_screen(scene, kernel, **each)).sum(axis=(0, 1)) / energy_in - 1.0
        for _, each in WAYS
    ]
    return f"| {degrees} | {' | '.join(percent(each) for each in drifts)} |"


def step_row(kernel, dz_mm, falloff_per_mm):
    """Return what three forms keep beyond a step."""
    near, far, share = figures(kernel)
    narrow, wide = (np.exp(-(dz_mm**2) / (2.0 * v)) for v in (near, far))
    lerp = np.full(len(near), 1.0 - min(falloff_per_mm * dz_mm, 1.0))
    texts = (percent(each) for each in (share * narrow + (1.0 - share) * wide, wide, lerp))
    return f"| {dz_mm:g} | {' | '.join(texts)} |"


def section(slopes=SLOPES):
    """Return the section's text, with tables of some slopes."""
    profile = simulate_exact(load_material("skin1"))
    kernel = fit_artist(profile, mm_per_pixel="profile").kernel
    near, far, share = figures(kernel)
    names = kernel.channels
    wide_pixels = fit_artist(profile, mm_per_pixel=0.5).kernel
    responses = {each: [response(kernel, each, way) for _, way in WAYS] for each in slopes}
    return TEXT.format(
        pitch=kernel.mm_per_pixel,
        v={each: f"{near[c]:.3g} and {far[c]:.3g}" for c, each in enumerate(names)},
        w=dict(zip(names, share, strict=True)),
        heads=" | ".join(name for name, _ in WAYS),
        rules="|".join("---" for _ in WAYS),
        slopes="\n".join(slope_row(kernel, *each) for each in responses.items()),
        kept="\n".join(kept_row(*each) for each in responses.items()),
        drift="\n".join(drift_row(wide_pixels, each) for each in slopes),
        steps="\n".join(step_row(kernel, each, lerp_falloff(kernel)) for each in STEPS_MM),
    )


def main():
    """Put the section in its place."""
    put_section("screen-space.md", "docs/make_screen.py", section())


if __name__ == "__main__":
    main()
