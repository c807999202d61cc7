"""Write the sections of docs/motion.md on lights, and draw their figures.

python docs/make_motion.py table lights fetches    an hour on two cores; or some of them
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from sections import put_section

from sssfit.chart import figure_of
from sssfit.chart.page import save_figure
from sssfit.material import load_material
from sssfit.motion.adaptive import TARGET_VARIANCE
from sssfit.motion.curve import sample_curves
from sssfit.motion.run import moving_light
from sssfit.motion.table import COLUMNS, PUBLISHED, PUBLISHED_COEFFICIENTS, measure_table
from sssfit.scene.load import load_scenes
from sssfit.simulate import simulate_exact

DOCS = Path(__file__).parent
PITCH_MM = 0.3
SCENES = ("head", "edge")
SAMPLERS = ("without", "variates", "ahead")
# Of the curves over targets. What is promised is promised for the strobe.
TARGETS = {
    "strobe": (3e-4, 8e-4, TARGET_VARIANCE, 6e-3, 2e-2),
    "sinusoidal": (3e-4, TARGET_VARIANCE, 1.2e-2),
    "gunshot": (3e-4, TARGET_VARIANCE, 1.2e-2),
}
SAME_FETCHES = 4e-4  # a target at which the sampler with variates takes about 16 samples


def row(cells):
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def skin1():
    """Return the exact profile."""
    return simulate_exact(load_material("skin1"))


def scenes():
    """Return the pictures of 512 x 512 pixels."""
    return load_scenes(list(SCENES), PITCH_MM)


# Table 1

TABLE_TEXT = """The root of the residual's moving variance, mean of the frames 25 to 100. Ours
are medians over {seeds} seeds, with quartiles:

| residual | still | published | moving | published |
|---|---|---|---|---|
{rows}

| coefficient | ours | quartiles | published |
|---|---|---|---|
{coefficients}

The largest deviation from a published value is {deviation:.1f} %. Means over seeds do not exist for
`Res_EMCM` and `Res_hat_EMCM`: a coefficient of few frames is a ratio that has no mean.

![Coefficient, residual and error over the frames, still and moving light](variates.png)
"""
COEFFICIENTS = {
    "still": "optimum, still light",
    "moving": "optimum, moving light",
    "in_frame": "optimum, moving light, variate constant in a frame",
}


def table_section():
    """Measure Table 1, and draw it."""
    found = measure_table()
    save_figure(figure_of(found), DOCS / "variates.png")
    told = found.to_dict()

    def cells(light, name):
        low, high = told["quartiles"][light][name]
        yield f"{told['table'][light][name]:.4f} ({low:.4f} to {high:.4f})"
        yield f"{told['published'][light][name]:.4f}"

    rows = [
        row([f"`{name}`", *(cell for light in PUBLISHED for cell in cells(light, name))])
        for name in COLUMNS
    ]
    coefficients = [
        row(
            [
                COEFFICIENTS[name],
                f"{told['coefficients'][name]:.4f}",
                "{:.4f} to {:.4f}".format(*told["coefficient_quartiles"][name]),
                f"{value}",
            ]
        )
        for name, value in PUBLISHED_COEFFICIENTS.items()
    ]
    return TABLE_TEXT.format(
        seeds=found.seeds,
        rows="\n".join(rows),
        coefficients="\n".join(coefficients),
        deviation=100.0 * found.largest_deviation,
    )


# Lights

LIGHTS_TEXT = """skin1 by the exact profile, 512 x 512 pixels of {pitch:g} mm, 100 frames, of which
means leave out the first 25; seed 1. Samples a pixel at the target variance {target:g}, and samples
saved against the sampler without control variates: at the same target, and at the same error
(median over the errors that both samplers reach, and the least among them):

| scene | light | without | variates | ahead | same target: variates / ahead | same error: \
variates | ahead |
|---|---|---|---|---|---|---|---|
{rows}

Samples and errors under the strobe, by target variance. The error is the root mean square of
radiant exitance, against the true 2D kernel:

| scene | target | without: samples, error | variates: samples, error | ahead: samples, error |
|---|---|---|---|---|
{curves}
"""


def share(value):
    """Return a share in per cent."""
    return f"{100.0 * value:.0f} %"


def still_row(profile, scene):
    """Return the row of still light."""
    found = moving_light(profile, scene, light="still", ways=SAMPLERS)
    samples = [f"{found.track(name).mean_fetches:.2f}" for name in SAMPLERS]
    saved = " / ".join(f"{100.0 * found.saving(name):.1f} %" for name in SAMPLERS[1:])
    return row([scene.name, "still", *samples, saved, "-", "-"])


def light_row(curve):
    """Return the row of a light that changes."""
    k = list(curve.targets).index(TARGET_VARIANCE)
    samples = [curve.samples[name][k] for name in SAMPLERS]
    saved = " / ".join(share(1.0 - each / samples[0]) for each in samples[1:])
    at_error = []
    for name in SAMPLERS[1:]:
        _, found = curve.savings(name)
        at_error.append(f"{share(np.median(found))} ({share(found.min())})")
    return row([curve.scene, curve.light, *(f"{each:.2f}" for each in samples), saved, *at_error])


def curve_rows(curve):
    """Yield a row a target."""
    for k, target in enumerate(curve.targets):
        cells = [f"{curve.samples[n][k]:.2f}, {curve.rmse[n][k]:.4f}" for n in SAMPLERS]
        yield row([curve.scene, f"{target:g}", *cells])


def lights_section():
    """Run the samplers under every light."""
    profile, rows, curves = skin1(), [], []
    for scene in scenes():
        rows.append(still_row(profile, scene))
        for light, targets in TARGETS.items():
            curve = sample_curves(profile, scene, light=light, targets=targets)
            rows.append(light_row(curve))
            curves += curve_rows(curve) if light == "strobe" else []
            print(rows[-1], file=sys.stderr, flush=True)
    return LIGHTS_TEXT.format(
        pitch=PITCH_MM, target=TARGET_VARIANCE, rows="\n".join(rows), curves="\n".join(curves)
    )


# Other renderers

FETCHES_TEXT = """The same scenes under the strobe, at the target variance {target:g}. Fixed
sampling, a separable kernel and a cascade have as many fetches as the sampler with variates took,
or nearly: taps come in pairs. Errors are shares of the root mean square of the true frames:

| scene | renderer | fetches a pixel | error of a frame | fixed samples for that error |
|---|---|---|---|---|
{rows}

![Samples, errors and maps of the head under the strobe](skin1-motion.png)
"""


def fetches_section():
    """Run all renderers, and draw those of the head."""
    profile, rows = skin1(), []
    for scene in scenes():
        found = moving_light(profile, scene, target_variance=SAME_FETCHES)
        if scene.name == SCENES[0]:
            save_figure(figure_of(found), DOCS / "skin1-motion.png")
        fixed = found.track("fixed")
        for each in found.tracks:
            error = f"{100.0 * found.relative(each):.2g} %"
            same = fixed.mean_fetches * (fixed.rmse / each.rmse) ** 2
            cells = [f"{each.mean_fetches:.1f}", error, f"{float(f'{same:.2g}'):,.0f}"]
            rows.append(row([scene.name, each.label, *cells]))
    return FETCHES_TEXT.format(target=SAME_FETCHES, rows="\n".join(rows))


SECTIONS = {
    "table": table_section,
    "lights": lights_section,
    "fetches": fetches_section,
}


def main():
    """Write the sections that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sections", nargs="+", choices=SECTIONS)
    for name in parser.parse_args().sections:
        script = f"docs/make_motion.py {name}"
        put_section("motion.md", script, SECTIONS[name](), f"python {script}")


if __name__ == "__main__":
    main()
