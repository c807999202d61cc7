"""Write what docs/cascades.md says of distance, and draw its chart: error over the size of a pixel.

python docs/make_distance.py
"""

import numpy as np
from make_cascades import PICTURES, whole_profile
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter
from sections import DOCS, put_section

from sssfit.chart.looks import DASHED, GREY, METHODS, RULE
from sssfit.chart.page import NOTE_SIZE, add_legend, name_axes, new_page, save_figure
from sssfit.fit import fit_pitches, fit_result, fit_taps
from sssfit.kernel import taps_between
from sssfit.measure.score import measure
from sssfit.render import render
from sssfit.render.reference import render_reference
from sssfit.scene.made import make_scene

PITCH_MM = 0.3  # of the single tables
WIDTH_MM = 76.8  # of the pictures: 256 pixels of 0.3 mm
OCTAVES = (-2, -1, 0, 1, 2)
STEPS = np.arange(-8, 9) / 4.0  # log2 of the pixel's size over the table's
CASCADE = "1-1|1-2|2-2|2-2"

TEXT = """skin1, exact profile, pictures of {width:g} mm (at least 256 pixels), mean over the eight
pictures of the 99th percentile of Delta E 2000. One table for pixels of {pitch:g} mm on pixels of
other sizes, and cascades for every octave of pixel sizes, mixed:

| pixel / table's pixel | {heads} |
|---|{rules}|
{rows}

![Error of tables over the size of a pixel](skin1-distance.png)

Within 1 the cascade's single table serves pixels of {least:.2f} to {most:.2f} times its own.

Between two tables an octave apart ({pitches} mm), the mean over the octaves / the worst of
them; two pictures cost the fetches of two tables:

| octaves from the finer table | the nearer table | two pictures mixed | the numbers mixed |
|---|---|---|---|
{between}
"""
STYLES = {
    "cascade, one table": {**METHODS["cascade"].points(5.4), "lw": 1.4},
    "cascade, a table an octave, mixed": {**METHODS["cascade"].points(5.0), "lw": 1.2,
                                          "mfc": "white", "ls": DASHED},
    "pair of passes": {**METHODS["preintegrated"].points(5.0), "lw": 1.2},
    "disk, one frame": {**METHODS["disk"].points(5.0), "lw": 1.2},
}  # fmt: skip


def scenes(mm_per_pixel):
    """Return the eight pictures on so large pixels."""
    rows = max(256, round(WIDTH_MM / mm_per_pixel))
    pixels = {"height": rows, "width": rows, "mm_per_pixel": mm_per_pixel}
    return [make_scene(name, **pixels, **own) for name, own in PICTURES]


def single_tables(profile):
    """Return the tables for one pixel size, of nearly as many fetches, by their names."""
    pair = fit_result(profile, "preintegrated", taps=11, mm_per_pixel=PITCH_MM).kernel
    disk = fit_taps(profile, "disk", taps=24, mm_per_pixel=PITCH_MM).kernel
    return {"pair of passes": pair, "disk, one frame": disk}


def neighbours(step):
    """Return the octaves of the two tables around a pixel size."""
    first = min(int(np.floor(step)), OCTAVES[-1] - 1)
    return first, first + 1


def measured(profile, tables, singles):
    """Return for each pixel size the errors by name, means of the 99th percentiles."""
    found = []
    for step in STEPS:
        pitch = PITCH_MM * 2.0**step
        fine, coarse = (tables[each] for each in neighbours(step))
        share = step - neighbours(step)[0]
        errors = {}
        for scene in scenes(pitch):
            truth = render_reference(scene, profile)

            def seen(picture, scene=scene, truth=truth):
                return measure(picture, truth, mask=scene.mask).delta_e_2000_p99

            own = {name: seen(render(scene, each)) for name, each in singles.items()}
            own["cascade, one table"] = seen(render(scene, tables[0]))
            mixed = taps_between(fine, coarse, pitch)
            own["cascade, a table an octave, mixed"] = seen(render(scene, mixed))
            pictures = render(scene, fine), render(scene, coarse)
            own["nearer"] = seen(pictures[round(share)])
            own["pictures"] = seen((1.0 - share) * pictures[0] + share * pictures[1])
            for name, value in own.items():
                errors.setdefault(name, []).append(value)
        found.append({name: float(np.mean(each)) for name, each in errors.items()})
    return found


def limits(errors):
    """Return between which sizes the single cascade stays within 1, as shares of its own."""
    seen = np.log([each["cascade, one table"] for each in errors])
    middle = STEPS.size // 2
    below = np.interp(0.0, -seen[: middle + 1], STEPS[: middle + 1])
    above = np.interp(0.0, seen[middle:], STEPS[middle:])
    return 2.0**below, 2.0**above


def row(cells):
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def between_rows(errors):
    """Yield a row for each place between two tables."""
    for place in (0.25, 0.5, 0.75):
        own = [each for step, each in zip(STEPS, errors, strict=True) if step % 1.0 == place]
        names = ("nearer", "pictures", "cascade, a table an octave, mixed")
        values = [[each[name] for each in own] for name in names]
        yield row([f"{place:g}", *(f"{np.mean(each):.2f} / {max(each):.2f}" for each in values)])


def chart(errors):
    """Draw error over the size of a pixel."""
    note = (
        "Mean over a disk, edges at 0, 15, 30 and 45 degrees, a head, points and highlights of the "
        "99th percentile of ΔE 2000. One table each, made for pixels of 0.3 mm, its offsets "
        "in mm: a cascade of 22.8 fetches, the pre-integrated pair of passes on 11 taps (22 "
        "fetches), a disk of 24. Dashed: cascades for .075, .15, .3, .6 and 1.2 mm, numbers mixed "
        "between them."
    )
    title = "skin1: tables on pixels of other sizes than their own"
    with new_page(4.6, title, "Exact profile", [note]) as (figure, below):
        handles = [Line2D([], [], **each) for each in STYLES.values()]
        axes = add_legend(below, handles, list(STYLES)).subplots()
        for name, style in STYLES.items():
            axes.plot(2.0**STEPS, [each[name] for each in errors], **style)
        axes.axhline(1.0, color=RULE, lw=0.8, ls=DASHED, zorder=1)
        axes.annotate(
            "just noticeable side by side",
            (0.25, 1.0),
            (0, 3),
            textcoords="offset points",
            size=NOTE_SIZE,
            color=GREY,
        )
        axes.set_xscale("log", base=2)
        axes.set_yscale("log")
        axes.xaxis.set_major_locator(FixedLocator([0.25, 0.5, 1, 2, 4]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())
        name_axes(
            axes,
            "",
            "size of a pixel / size that the table is made for (0.3 mm)",
            "99th percentile of ΔE 2000,\nmean over eight pictures",
        )
    save_figure(figure, DOCS / "skin1-distance.png")


def main():
    """Write the section and draw its chart."""
    profile = whole_profile("skin1")
    pitches = [PITCH_MM * 2.0**each for each in OCTAVES]
    fitted = fit_pitches(profile, "cascade", pitches, stages=CASCADE)
    tables = {OCTAVES[number]: each.kernel for number, each in fitted}
    errors = measured(profile, tables, single_tables(profile))
    shown = [k for k, step in enumerate(STEPS) if step % 0.5 == 0.0]
    least, most = limits(errors)
    text = TEXT.format(
        width=WIDTH_MM,
        pitch=PITCH_MM,
        heads=" | ".join(f"{2.0 ** STEPS[k]:.2g}" for k in shown),
        rules="---|" * (len(shown) - 1) + "---",
        rows="\n".join(row([name, *(f"{errors[k][name]:.2f}" for k in shown)]) for name in STYLES),
        least=least,
        most=most,
        pitches=", ".join(f"{each:g}" for each in pitches),
        between="\n".join(between_rows(errors)),
    )
    put_section("cascades.md", "docs/make_distance.py", text)
    chart(errors)


if __name__ == "__main__":
    main()
