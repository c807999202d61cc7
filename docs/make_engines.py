"""Write the tables and the walks of docs/engines.md, and its chart docs/inversions.png.

python docs/make_engines.py
"""

import importlib
import math

import numpy as np
from engine_walks import STEPS, begin, text
from scipy.special import ndtr
from sections import DOCS, put_section

from sssfit.chart import figure_of
from sssfit.chart.page import save_figure
from sssfit.compare.inversions import compute_inversions
from sssfit.compare.presets import PICTURES, compare_presets
from sssfit.compare.runner import scenes_for
from sssfit.export.presets import preset, preset_of
from sssfit.export.presets.source import source_of
from sssfit.fit import fit_burley
from sssfit.kernel.listing import LISTED, listing
from sssfit.material import Layer, Material, load_material
from sssfit.methods import PRESETS
from sssfit.shapes import diffusion_cdf, s_perpendicular
from sssfit.simulate import simulate_exact
from sssfit.simulate.inversion import invert_reflectance

SCRIPT = "docs/make_engines.py"
ALBEDOS = (0.1, 0.3, 0.5, 0.6, 0.7, 0.75, 0.8, 0.9, 0.95)
COLOURS = (0.05, 0.2, 0.44, 0.8, 0.95)


def table(heads, rows):
    """Return a Markdown table."""
    lines = [f"| {' | '.join(each)} |" for each in (heads, *rows)]
    return "\n".join([lines[0], f"|{'---|' * len(heads)}", *lines[1:]])


def overview():
    """Tabulate the presets: engine, model, what is written, what leads back, and what is lost."""
    rows = []
    for name in PRESETS:
        each = preset(name)
        back = "material" if each.material else "taps, profile" if each.of_taps else "profile"
        engine = each.engine.partition(",")[0].partition(" (")[0]  # the rest heads its walk
        rows.append((f"`{name}`", engine, each.model, each.ending, back, each.lost))
    return table(("preset", "engine", "model", "text", "inverse", "lost"), rows)


def parameters_table(found):
    """Tabulate the parameters of a preset: unit, meaning, and skin1's value."""
    rows = [
        (f"`{each.name}`", each.unit or "-", each.meaning, text(found[each.name]))
        for each in found.preset.fields
    ]
    return table(("parameter", "unit", "meaning", "skin1"), rows)


def origin(place):
    """Return where a formula stands, with a link if it is a repository."""
    repository, _, rest = place.partition(": ")
    if not repository.startswith("github.com/"):
        return place
    return f"[{repository.removeprefix('github.com/')}](https://{repository}), {rest}"


def walk(name, source, record):
    """Return a preset's formulas, its origin, its parameters and the way of skin1 into it."""
    found = preset_of(name, record)
    module = importlib.import_module(PRESETS[name].function.partition(":")[0])
    _, _, formulas = module.__doc__.partition("\n\n")
    origins = "\n".join(f"- {origin(each)}" for each in found.preset.origin)
    steps = "\n".join(f"{k}. {each}" for k, each in enumerate(STEPS[name](source, found), 1))
    return "\n\n".join(
        (
            f"### {found.preset.engine}",
            formulas.strip(),
            f"Origin:\n\n{origins}",
            parameters_table(found),
            f"skin1:\n\n{steps}",
            *(f"Warning: {each}" for each in found.warnings),
        )
    )


def walks():
    """Return the walks into all presets, after what they share."""
    record = simulate_exact(load_material("skin1"))
    source = source_of(record)
    first = "\n".join(f"{k}. {each}" for k, each in enumerate(begin(source), 1))
    parts = [walk(name, source, record) for name in PRESETS]
    head = "Every conversion of skin1 starts from these values (red, green, blue):"
    return "\n\n".join((f"{head}\n\n{first}", *parts))


def burleys_range():
    """Tabulate how far the memo's shape and the best one miss the exact cumulative energy."""
    albedo = invert_reflectance(np.array(ALBEDOS), 1.0).albedo
    names = tuple(f"c{k}" for k in range(len(ALBEDOS)))
    material = Material("range", names, (Layer(1.0, 0.0, 1.0 - albedo, albedo),))
    profile = simulate_exact(material, radius_mm=100.0)
    best = fit_burley(profile).kernel.parameters
    share = profile.cumulative / profile.diffuse_reflectance
    memo = s_perpendicular(ALBEDOS)
    missed = np.abs(diffusion_cdf(profile.r_edges_mm[:, None], memo) - share).max(axis=0)
    rows = [
        (
            f"{ALBEDOS[k]:g}",
            f"{albedo[k]:.4f}",
            f"{memo[k]:.3f}",
            f"{missed[k]:.3f}",
            f"{best[name]['s_per_mm']:.3f}",
            f"{best[name]['cumulative_error']:.3f}",
        )
        for k, name in enumerate(names)
    ]
    heads = ("A", "albedo", "s1(A) l", "misses F by", "best s l", "misses F by")
    return table(heads, rows)


def cross_section():
    """Tabulate the skin's red channel as a profile, as a kernel on a line, and in taps."""
    weights, variances = (np.array(each) for each in zip(*LISTED, strict=True))
    on_line = weights / np.sqrt(variances)
    rows = [
        ("the profile in the plane, along an axis", spread(weights, variances), edge(weights)),
        ("its cross section as a kernel", spread(on_line, variances), edge(on_line)),
    ]
    for taps in (25, 17, 11):
        offsets, found = listing(taps, np.ones(1), np.array([0.999]))
        second = 2.0 * float(found[1:, 0] @ offsets**2)
        rows.append((f"{taps} taps of it", math.sqrt(second), taps_edge(offsets, found[:, 0])))
    heads = ("red channel, strength 1", "standard deviation along an axis, mm", "error of an edge")
    return table(heads, [(each, f"{sigma:.3f}", f"{error:.3f}") for each, sigma, error in rows])


X_MM = np.linspace(0.0, 8.0, 4001)


def spread(weights, variances):
    """Return the standard deviation of a mixture of Gaussians on a line [mm]."""
    return math.sqrt(float(weights @ variances / weights.sum()))


def lit(weights):
    """Return the light beside an edge, by a mixture of the listing's Gaussians."""
    variances = np.array([each for _, each in LISTED])
    return ndtr(X_MM[:, None] / np.sqrt(variances)) @ weights / weights.sum()


def edge(weights):
    """Return the largest difference of the light beside an edge from the profile's."""
    wanted = lit(np.array([each for each, _ in LISTED]))
    return float(np.abs(lit(weights) - wanted).max())


def taps_edge(offsets, weights):
    """Return the same of taps, in the middle of their steps."""
    wanted = lit(np.array([each for each, _ in LISTED]))
    ends = np.concatenate(([0.0], offsets))
    middle = 0.5 * (ends[1:] + ends[:-1])
    seen = 0.5 + 0.5 * weights[0] + np.concatenate(([0.0], np.cumsum(weights[1:])))[:-1]
    return float(np.abs(seen - np.interp(middle, X_MM, wanted)).max())


def colours():
    """Tabulate the formula's albedos, the exact ones, and the colours that the formula's have.

    All are for diffuse light, for which the formula was fitted.
    """
    curves = compute_inversions(COLOURS, light="diffuse")
    rows = [
        (
            f"{COLOURS[k]:g}",
            f"{curves.formula[k]:.6f}",
            *(f"{each[k]:.6f}" for each in curves.exact),
            *(f"{each[k]:.3f}" for each in curves.seen[1:]),
        )
        for k in range(len(COLOURS))
    ]
    heads = (
        "C",
        "formula",
        *(f"exact, eta {eta:g}" for eta in curves.etas),
        *(f"seen at eta {eta:g}" for eta in curves.etas[1:]),
    )
    return table(heads, rows)


def mean_free_paths():
    """Tabulate Unreal's distances by its own reading of the coefficients, and matched."""
    rows = []
    for name in ("skin1", "marble"):
        material = load_material(name)
        record = simulate_exact(material)
        for match in ("coefficients", "profile"):
            found = preset_of("unreal", record, match=match)
            path = found["MeanFreePathDistance"] * np.array(found["MeanFreePathColor"])
            rows.append((name, match, text(found["SurfaceAlbedo"], ".3f"), text(path, ".4f")))
    return table(("material", "match", "SurfaceAlbedo", "mean free path, cm"), rows)


SHOWN = ("skin1", "marble")


def shown():
    """Tabulate what engines show of two materials, and draw it of the first."""
    scenes = scenes_for(None, PICTURES, 0.3, size=(256, 256), layer=None, mask=None, seed=1)
    found = [compare_presets(load_material(name), scenes) for name in SHOWN]
    save_figure(figure_of(found[0]), DOCS / "engines-skin1.png")
    heads = ("preset", *(f"{each.material} {name}" for each in found for name in each.pictures))
    errors = [{row.parameters.preset.name: row for row in each.rows} for each in found]
    rows = [
        (
            f"`{name}`",
            *(
                f"{mean:.2f} / {p95:.2f}"
                for each in errors
                for mean, p95 in zip(each[name].mean, each[name].p95, strict=True)
            ),
        )
        for name in errors[0]
    ]
    return table(heads, rows)


def main():
    """Write the sections and the charts."""
    for name, made in (
        ("presets", overview),
        ("walks", walks),
        ("range", burleys_range),
        ("listing", cross_section),
        ("unreal", mean_free_paths),
        ("colours", colours),
        ("shown", shown),
    ):
        put_section("engines.md", f"{SCRIPT} {name}", made(), f"python {SCRIPT}")
    save_figure(figure_of(compute_inversions()), DOCS / "inversions.png")


if __name__ == "__main__":
    main()
