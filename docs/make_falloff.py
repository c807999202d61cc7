"""Write the 2012 model's section of docs/fits.md: its unit of length, and table 1 beside our fit.

python docs/make_falloff.py
"""

import math

import numpy as np
from scipy.optimize import minimize_scalar
from sections import put_section

from sssfit.fit import fit_falloff, make_target
from sssfit.fit.falloff import (
    STRETCH,
    sampled_misfit,
    sampled_pixels,
    scale_of,
    stretched_skin,
)
from sssfit.simulate import simulate_deon_skin

TABLE_1 = {"width": 0.014, "strength": (0.78, 0.70, 0.75), "falloff": (0.57, 0.13, 0.08)}
PITCHES_MM = (0.1, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)
PITCH_MM = 0.5  # in smaller pixels the delta of table 1 is too dense for any length
SUPPORT_MM = 8.0

TEXT = """## The 2012 model's unit of length

The report gives x no unit. Its width w, strength t and falloff f of table 1 (.014; .78 .70 .75;
.57 .13 .08) are compared here with the six-Gaussian skin by its eq. 3, the sum of squares over
sampled pixels of the three channels, on a support of {support:g} mm. The only length scale is
STRETCH: a channel is m = STRETCH w (0.001 + f) times as wide as red skin. The table gives the
remaining share of the sum of squares of the kernel, for the best STRETCH at each pixel size and
for the best of all parameters:

| mm per pixel | best STRETCH | m of R G B | remainder, table 1 | remainder, our fit |
|---|---|---|---|---|
{scan}

The delta peak is one pixel wide, so the strength depends on the pixel size: with pixels of 0.1 mm
the best strength is almost 1, and no length scale suits table 1. From 0.4 mm on the best length
scale hardly depends on the pixel size, and table 1's red channel is then p itself (m = {red:.2f}),
as it should be. **STRETCH = {stretch:g}**, the figure at {pitch:g} mm. Widths enter only as a
product with 0.001 + f: our fit gives the widest channel the falloff 1, and one column shows the
same kernel at table 1's width.

| at {pitch:g} mm | width | strength R G B | falloff R G B | falloff at w = .014 | remainder |
|---|---|---|---|---|---|
{sets}
"""


def left_by(quadrants, edges_mm, strengths, scales):
    """Eq. 3's sum over the channels, as a share of that of no kernel at all."""
    left = whole = 0.0
    for quadrant, t, m in zip(quadrants, strengths, scales, strict=True):
        half, _ = stretched_skin(np.array((t, math.log(m))), edges_mm)
        nothing = square(quadrant)
        left += nothing * sampled_misfit(half, quadrant)[0]
        whole += nothing
    return left / whole


def square(quadrant):
    """Sum of the squares of the sampled pixels: eq. 3 for no kernel at all, in energy squared."""
    at = sampled_pixels(len(quadrant))
    copies = np.where(at == 0, 1.0, 2.0)
    return copies @ (quadrant[np.ix_(at, at)] ** 2 @ copies)


def quadrants_at(profile, pitch_mm):
    """Pixels of each channel (unit energy), and their edges."""
    target = make_target(profile, pitch_mm, SUPPORT_MM)
    quadrants = [target.quadrant(c) / target.total[c] for c in range(profile.n_channels)]
    return quadrants, target.edges_mm()


def best_stretch(profile, pitch_mm):
    """Return the STRETCH that makes table 1 fit best, and what it leaves."""
    quadrants, edges = quadrants_at(profile, pitch_mm)
    unit = TABLE_1["width"] * (0.001 + np.array(TABLE_1["falloff"]))

    def left(log_stretch):
        return left_by(quadrants, edges, TABLE_1["strength"], np.exp(log_stretch) * unit)

    tried = np.linspace(math.log(5.0), math.log(5000.0), 200)
    best = tried[int(np.argmin([left(each) for each in tried]))]
    step = tried[1] - tried[0]
    found = minimize_scalar(
        left, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-8}
    )
    return math.exp(found.x), float(found.fun)


def left_by_parameters(profile, pitch_mm, parameters):
    """Return what parameters by channel leave."""
    quadrants, edges = quadrants_at(profile, pitch_mm)
    scales = [scale_of(each["width"], each["falloff"]) for each in parameters]
    return left_by(quadrants, edges, [each["strength"] for each in parameters], scales)


def fitted(profile, pitch_mm, **by_hand):
    """Parameters by channel, and what they leave."""
    result = fit_falloff(profile, mm_per_pixel=pitch_mm, support_mm=SUPPORT_MM, **by_hand)
    parameters = list(result.kernel.parameters.values())
    return parameters, left_by_parameters(profile, pitch_mm, parameters)


def section():
    """Return the section's text."""
    profile = simulate_deon_skin()
    unit = TABLE_1["width"] * (0.001 + np.array(TABLE_1["falloff"]))
    scan = []
    for pitch in PITCHES_MM:
        stretch, left = best_stretch(profile, pitch)
        scales = " ".join(f"{each:.2f}" for each in stretch * unit)
        _, best = fitted(profile, pitch)
        scan.append(f"| {pitch:g} | {stretch:.1f} | {scales} | {left:.2%} | {best:.2%} |")
    sets = [
        row("table 1", *fitted(profile, PITCH_MM, **TABLE_1)),
        row("our fit", *fitted(profile, PITCH_MM)),
    ]
    return TEXT.format(
        support=SUPPORT_MM,
        scan="\n".join(scan),
        red=STRETCH * unit[0],
        stretch=STRETCH,
        pitch=PITCH_MM,
        sets="\n".join(sets),
    )


def row(name, parameters, left):
    """One set of parameters as a line of the table."""
    scales = [scale_of(each["width"], each["falloff"]) for each in parameters]
    same = [m / (STRETCH * TABLE_1["width"]) - 0.001 for m in scales]
    columns = [[each["strength"] for each in parameters], [e["falloff"] for e in parameters], same]
    texts = [" ".join(f"{value:.3f}" for value in column) for column in columns]
    return f"| {name} | {parameters[0]['width']:.4f} | {' | '.join(texts)} | {left:.3%} |"


def main():
    """Put the section in its place."""
    put_section("fits.md", "docs/make_falloff.py", section())


if __name__ == "__main__":
    main()
