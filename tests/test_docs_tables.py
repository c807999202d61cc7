"""No table of the documents is kept by hand: each is made by a script, or recomputed by a test.

A made one stands between the marks that docs/sections.py writes, with date and command. Before any
other stands ``<!-- held by FILE::TEST -->``; the tests here recompute the cells that take seconds.
"""

import datetime
import re
import runpy
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from checks_models import BEYOND, DIFFUSE, multipole_against_walk
from edited_skin import compute_editing

from sssfit.choose.choice import choose, mm_per_pixel_at
from sssfit.choose.views import scene_for
from sssfit.compare.guide import compute_guide
from sssfit.compare.sheet import compute_sheet
from sssfit.compare.spectrum import compute_spectrum
from sssfit.errors import SssfitWarning
from sssfit.fit import fit_gaussians, fit_preintegrated, fit_svd
from sssfit.material import load_material, material_names
from sssfit.measure.score import measure
from sssfit.methods import SIMULATIONS
from sssfit.profile import full_kernel
from sssfit.render.reference import render_reference
from sssfit.render.taps import render_taps
from sssfit.shapes import SKIN_VARIANCES_MM2, SKIN_WEIGHTS
from sssfit.simulate import (
    simulate_burley,
    simulate_deon_skin,
    simulate_dipole,
    simulate_dipole_grosjean,
    simulate_exact,
)

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
MADE = re.compile(r"<!-- made by (\S+)(?: (\w+))?, (\d{4}-\d\d-\d\d): (.+) -->")
HELD = re.compile(r"<!-- held by (\S+)::(\w+) -->")


def tables(page):
    """Every table's first line, what holds it, and its rows of cells without the rule."""
    lines = page.read_text(encoding="utf-8").splitlines()
    found, made, last, inside = [], None, "", False
    for number, (line, after) in enumerate(pairwise([*lines, ""]), start=1):
        if match := MADE.fullmatch(line):
            made = match
        elif line.startswith("<!-- end of "):
            made = None
        if not (inside and line.startswith("|")) and not (line.startswith("|") and is_rule(after)):
            inside = False
            last = line or last
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if not inside:
            found.append((f"{page.name}:{number}", made or HELD.fullmatch(last), [cells]))
        elif not is_rule(line):
            found[-1][2].append(cells)
        inside = True
    return found


def is_rule(line):
    """Whether a line is what stands under a table's heads."""
    return line.startswith("|") and set(line) <= set("|-: ")


EVERY = [each for page in PAGES for each in tables(page)]


def table_with(page, *heads):
    """The rows of the table of a page whose first line begins so, as cells."""
    (rows,) = [
        rows
        for place, _, rows in EVERY
        if place.startswith(f"{page}:") and rows[0][: len(heads)] == list(heads)
    ]
    return rows[1:]


def numbers(text):
    """The numbers of a cell."""
    return [float(each) for each in re.findall(r"[-+]?\d*\.?\d+(?:e[-+]?\d+)?", text)]


def digits(text):
    """Half a unit of the last place of a cell's numbers."""
    places = [len(each.partition(".")[2]) for each in re.findall(r"\d*\.?\d+", text)]
    return 0.501 * 10.0 ** -max(places)


def assert_cell(text, values):
    """A cell has these values, to its digits."""
    np.testing.assert_allclose(numbers(text), np.atleast_1d(values), rtol=0, atol=digits(text))


def exact(name):
    return simulate_exact(load_material(name))


@pytest.fixture(scope="module")
def skin1():
    return exact("skin1")


def test_there_are_tables_to_look_at():
    assert len(EVERY) > 50


@pytest.mark.parametrize(("place", "holder"), [each[:2] for each in EVERY])
def test_every_table_is_made_or_held(place, holder):
    assert holder, f"{place}: no script makes this table and no test recomputes it"
    path = ROOT / holder[1]
    assert path.is_file(), f"{place}: {holder[1]}"
    if holder.re is HELD:
        assert f"def {holder[2]}(" in path.read_text(encoding="utf-8"), f"{place}: {holder[2]}"
        return
    assert datetime.date.fromisoformat(holder[3]) >= datetime.date(2026, 11, 22)
    assert holder[4].startswith(f"python {holder[1]}")


def test_a_table_by_hand_is_noticed(tmp_path):
    page = tmp_path / "page.md"
    table = "| a | b |\n|---|---|\n| 1 | 2 |\n"
    made = "<!-- made by docs/x.py, 2026-11-27: python docs/x.py -->\n"
    held = "<!-- held by tests/x.py::test_x -->\n"
    end = "<!-- end of docs/x.py -->\n"
    page.write_text(f"{made}\n{table}\n{end}\n{table}\n{held}\n{table}\nwords\n\n{table}")
    assert [bool(holder) for _, holder, _ in tables(page)] == [True, False, True, False]
    assert tables(page)[0][2] == [["a", "b"], ["1", "2"]]


def test_a_section_goes_into_its_place(tmp_path, monkeypatch):
    import sections

    monkeypatch.setattr(sections, "DOCS", tmp_path)
    page = tmp_path / "page.md"
    page.write_text("# Page\n\nwords\n")
    for text in ("| 1 |", "| 2 |"):
        sections.put_section("page.md", "docs/x.py one", text, "python docs/x.py")
    sections.put_section("page.md", "docs/x.py", "| 3 |")
    today = datetime.date.today().isoformat()
    assert page.read_text() == (
        "# Page\n\nwords\n\n"
        f"<!-- made by docs/x.py one, {today}: python docs/x.py -->\n\n| 2 |\n\n"
        "<!-- end of docs/x.py one -->\n\n"
        f"<!-- made by docs/x.py, {today}: python docs/x.py -->\n\n| 3 |\n\n"
        "<!-- end of docs/x.py -->\n"
    )


def rows_named(page, start):
    """The cells of the rows of a page whose first cell begins so."""
    return [
        row
        for place, _, rows in EVERY
        if place.startswith(f"{page}:")
        for row in rows
        if row[0].startswith(start)
    ]


def test_pages_quote_what_fetches_show():
    """The README and the first advice have the figures of the tables, relatives of cascades too."""
    budgets = {row[0]: row for row in table_with("how-to-choose.md", "fetches at most", "cascade")}
    ours, published = budgets["24"][1], float(budgets["100"][2].split()[0])
    relatives = table_with("cascades.md", "", "structure", "fetches", "passes", "skin1")
    near = [row for row in relatives if float(row[2]) <= 22.0]
    chain, pyramid = (
        min(row[4] for row in near if row[0].startswith(each)) for each in ("one shape", "pyramid")
    )
    readme, advice = (
        " ".join((ROOT / each).read_text("utf-8").split())
        for each in ("README.md", "docs/how-to-choose.md")
    )
    for words in (
        f"The mean 99th percentile of eight pictures, a head among them, is {ours}.",
        f"best published separable kernel within 100 fetches leaves {published:.1f};",
        f"leave {chain} and {pyramid} with 21 fetches",
    ):
        assert words in readme
    as_published = relatives[0]
    assert as_published[0].endswith("as published")
    for words in (
        f"with 24 it leaves {ours}.",
        f"leaves {published:.1f} within 100 fetches.",
        f"leaves {float(as_published[4]):.1f} with {float(as_published[2]):.0f} fetches;",
        f"a chain that we fit leaves {chain}, and a convolution pyramid that we fit {pyramid}.",
    ):
        assert words in advice


def test_readme_quotes_its_pages():
    """The README's table has the figures of the pages it links, cell by cell."""
    (total,) = rows_named("verification.md", "skin1 R: exact against the walk")
    apart = [abs(float(row[3])) for row in table_with("verification.md", "comparison", "ours")]
    (exact,) = rows_named("benchmarks-exact.md", "exact, tolerance 0.0001")
    walk = table_with("benchmarks.md", "material", "one thread")[0]
    (rank,) = rows_named("benchmarks-fit.md", "skin1")[:1]
    passes = rows_named("benchmarks-render.md", "float32, one thread")[0]
    expected = [
        [total[1].partition(",")[0], total[2]],
        [f"{max(apart):.2f}"],
        [exact[2], exact[1]],
        [walk[2]],
        [rank[2]],
        [passes[1]],
    ]
    rows = table_with("README.md", "What", "Figure")
    assert [row[1].split(", ") for row in rows] == expected


def test_pages_say_which_seconds_they_quote():
    """Of the step alone and of the whole command, as the benchmarks have them."""
    (exact,) = rows_named("benchmarks-exact.md", "exact, tolerance 0.0001")
    (solver,) = rows_named("benchmarks-exact.md", "`sssfit simulate skin1 --method exact`")[1:]
    (walk,) = rows_named("benchmarks.md", "`sssfit simulate skin1 --photons 10000000`")
    rates, threads = rows_named("benchmarks.md", "skin1")[:2]
    million = f"{float(rates[2].replace(',', '')) / 1e6:.1f} million photons a second"
    for page, words in (
        ("README.md", f"whole commands take {walk[1]} s for the walk and {solver[1]} s for"),
        ("docs/how-to-choose.md", f"1e7 photons take {threads[2]} s on two cores"),
        ("docs/how-to-choose.md", f"and the exact method {exact[1]} s"),
        ("docs/simulate.md", f"{million} on one core, and {exact[1]} s"),
    ):
        assert words in " ".join((ROOT / page).read_text("utf-8").split()), page


def test_names_are_in_the_program():
    code = "\n".join(
        path.read_text(encoding="utf-8")
        for room in ("sssfit", "cli")
        for path in sorted((ROOT / room).rglob("*.py"))
    )
    names = [
        name
        for place, _, rows in EVERY
        if place.startswith("names.md:") and "Name in code" in rows[0]
        for row in rows[1:]
        for name in re.findall(r"`\.{0,3}(\w+)`", row[1])
    ]
    assert len(names) > 100
    missing = [name for name in names if not re.search(rf"{name}\b", code)]
    assert missing == []


def test_which_pixels(skin1):
    for pitch, pixels, three, six, gaussians in table_with("fits.md", "mm per pixel", "pixels"):
        if pitch == ".034":
            continue  # 1275 x 1275 pixels
        fits = [fit_svd(skin1, rank=n, energy="keep", mm_per_pixel=float(pitch)) for n in (3, 6)]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SssfitWarning)
            fits.append(fit_gaussians(skin1, terms=6, mm_per_pixel=float(pitch)))
        assert numbers(pixels) == [fits[0].kernel.pixels] * 2
        for cell, found in zip((three, six, gaussians), fits, strict=True):
            assert_cell(cell, 100.0 * found.relative_frobenius_error[0])


def test_how_much_the_first_value_holds(skin1):
    profiles = {
        "six Gaussians (d'Eon et al. 2007)": simulate_deon_skin(),
        "skin1, dipole": simulate_dipole(load_material("skin1")),
        "skin1, exact": skin1,
    }
    rows = table_with("fits.md", "profile", "mm per pixel")
    for k, (name, profile) in enumerate(profiles.items()):
        assert rows[3 * k][0] == name
        for _, pitch, squared, absolute in rows[3 * k + 1 : 3 * k + 3]:  # .034 takes long
            found = compute_spectrum(profile, mm_per_pixel=float(pitch))
            assert_cell(squared, 100.0 * found.squared_share[0])
            assert_cell(absolute, 100.0 * found.absolute_share[0])


@pytest.mark.filterwarnings("ignore::sssfit.errors.SssfitWarning")
def test_gaussians_of_a_steep_profile(skin1):
    for terms, *cells in table_with("fits.md", "at 0.1 mm", "constrained"):
        given = {"terms": int(terms), "mm_per_pixel": 0.1}
        kept, free = (fit_gaussians(skin1, **given, free_energy=each) for each in (False, True))
        svd = fit_svd(skin1, rank=int(terms), energy="keep", mm_per_pixel=0.1)
        figures = [
            kept.relative_frobenius_error,
            free.relative_frobenius_error,
            -free.energy_error,
            svd.relative_frobenius_error,
        ]
        for cell, values in zip(cells, figures, strict=True):
            assert_cell(cell, 100.0 * values)


def test_the_edge_at_45_degrees(skin1):
    cells = {}
    for first, left, second, right in table_with("fits.md", "material", "", "material"):
        cells |= {first: left, second: right}
    assert set(cells) - {""} == set(material_names(paper=True))
    for name in ("skin1", "marble"):
        profile = exact(name)
        kernel = fit_preintegrated(profile, energy="keep", mm_per_pixel=0.1).kernel
        x, found = np.arange(kernel.pixels), []
        for c in range(3):
            whole = full_kernel(profile.quadrant_kernel(0.1, kernel.half_pixels, channel=c))
            diagonal = np.bincount((x[:, None] + x).ravel(), (kernel.full(c) - whole).ravel())
            found.append(np.abs(np.cumsum(diagonal) - 0.5 * diagonal).max() / whole.sum())
        assert_cell(cells[name], 100.0 * np.array(found))


def test_guided_fits(skin1):
    rows = table_with("fits.md", "", "pre-integrated", "k = 0", "k = 1.55")
    found = compute_guide(skin1, ks=(1.55,), channel="B", mm_per_pixel=0.1)
    figures = (found.centre_share, found.misplaced, None, found.relative_frobenius_error)
    for row, value in zip(rows, (*figures, found.weighted_residual), strict=True):
        if value is not None:
            blue = numbers(row[3])[2]
            assert blue == pytest.approx(value[0], abs=digits(row[3]))


def test_words_of_theory_are_methods():
    heads = [each for rows in (EVERY,) for each in rows if each[0].startswith("theory.md:")]
    dipoles = next(rows for _, _, rows in heads if rows[0][1] == "`dipole`")
    assert {each.strip("`") for each in dipoles[0][1:]} <= set(SIMULATIONS)
    burley = load_material("skin1")
    sigma_t = burley.layers[0].reduced_sigma_t_per_mm
    sigma_tr = np.sqrt(3.0 * burley.layers[0].sigma_a_per_mm * sigma_t)
    scale = {"sigma_t'": sigma_t, "sigma_tr = sqrt(3 sigma_a sigma_t')": sigma_tr}
    for mapping, s, times in table_with("theory.md", "mapping", "s", "times"):
        for reflectance in (0.2, 0.7):
            profile = simulate_burley(
                burley, reflectance=np.full(3, reflectance), mapping=mapping.strip("`")
            )
            # The formula as it is printed: "1.85 - A + 7 \|A - 0.8\|^3".
            formula = re.sub(r"\\\|(.+?)\\\|", r"abs(\1)", s).replace("^", "**")
            formula = re.sub(r"(\d) (abs|\()", r"\1 * \2", formula)
            expected = eval(formula, {"A": reflectance, "abs": abs}) * scale[times]
            np.testing.assert_allclose(profile.meta["settings"]["s_per_mm"], expected, rtol=1e-12)


@pytest.mark.filterwarnings("ignore:stack. .* crosses without a collision")
def test_the_multipole_beside_the_walk():
    rows = table_with("theory.md", "case", "", "walk", "multipole")
    cases = [*DIFFUSE.items(), *BEYOND.items()]
    assert len(rows) == 2 * len(cases)
    for k, (name, material) in enumerate(cases):
        pair = multipole_against_walk(material, name, 20_000)
        for (_, kind, walk, multipole, total, *_), found in zip(
            rows[2 * k : 2 * k + 2], pair, strict=True
        ):
            assert found.what.endswith({"R": "R_d", "T": "T"}[kind])
            assert_cell(multipole, found.total)
            # The walk of the docs is 100 to 500 times as long: this one's noise is all there is.
            assert abs(found.walk_total - float(walk)) < 4.5 * found.walk_total_stderr
            ratio = 100.0 * (float(multipole) / float(walk) - 1.0)
            assert numbers(total)[0] == pytest.approx(ratio, abs=2.0 * digits(total))


def test_models_of_the_eleven_materials():
    rows = table_with("theory.md", "channel", "albedo", "exact total")
    names = [f"{name} {c}" for name in material_names(paper=True) for c in "RGB"]
    assert [row[0] for row in rows] == names
    for name in ("skin1", "ketchup"):
        material, true = load_material(name), exact(name)
        totals = true.diffuse_reflectance
        dipoles = [make(material) for make in (simulate_dipole, simulate_dipole_grosjean)]
        burleys = [
            simulate_burley(material, reflectance=totals, mapping=mapping)
            for mapping in ("perpendicular", "diffuse", "diffuse-mfp")
        ]
        for c, row in enumerate(rows[3 * material_names(paper=True).index(name) :][:3]):
            assert_cell(row[1], material.layers[0].albedo[c])
            assert_cell(row[2], totals[c])
            for cell, model in zip(row[3:5], dipoles, strict=True):
                assert_cell(cell, 100.0 * (model.diffuse_reflectance[c] / totals[c] - 1.0))
            for cell, model in zip(row[5:], (*dipoles, *burleys), strict=True):
                assert_cell(cell, 100.0 * misplaced(model, true, c))


def misplaced(model, true, channel):
    """Half the sum over annuli of differences of shares; what is beyond the grid is one more."""
    shares = [
        np.append(each.annulus_energy[:, channel], each.beyond_grid[channel])
        / each.diffuse_reflectance[channel]
        for each in (model, true)
    ]
    return 0.5 * np.abs(shares[0] - shares[1]).sum()


def test_light_through_slabs():
    ours, listing = table_with("screen-space.md", "s (mm)")
    (heads,) = [rows[0] for _, _, rows in EVERY if rows[0][0] == "s (mm)"]
    red, variances = np.array(SKIN_WEIGHTS)[:, 0], np.array(SKIN_VARIANCES_MM2)
    for k, s_mm in enumerate(map(float, heads[1:]), start=1):
        for row, widths in ((ours, 2.0), (listing, 1.0)):
            through = red @ np.exp(-(s_mm**2) / (widths * variances))
            assert_cell(row[k], 100.0 * through)


def test_figures_of_the_contact_sheet(skin1):
    rows = {row[0]: row[2:] for row in table_with("how-to-choose.md", "kernel", "passes", "disk")}
    found = compute_sheet(skin1, scenes=("disk", "edge"), most_terms=1)
    assert [each.label for each in found.rows if each.label not in rows] == ["True kernel"]
    for each in found.rows[:-1]:
        for cell, panel in zip(rows[each.label], each.panels, strict=False):
            assert_cell(cell, [panel.score.delta_e_2000_mean, panel.score.delta_e_2000_p95])


def test_figures_of_the_edits():
    made = runpy.run_path(str(ROOT / "docs" / "make_sheets.py"))
    page = (ROOT / "docs" / "how-to-choose.md").read_text(encoding="utf-8")
    assert made["editing_rows"](compute_editing()) in page, "run: python docs/make_sheets.py"


@pytest.mark.slow
def test_a_choice_for_the_head_is_none_for_edges_and_points():
    material, pitch = load_material("chicken1"), mm_per_pixel_at(600.0, 30.0, 1080)
    scenes = {name: scene_for(name, pitch, (1080, 1920)) for name in ("head", "edge", "points")}
    choices = {
        name: choose(material, mm_per_pixel=pitch, scene=each) for name, each in scenes.items()
    }
    head, edge, points = choices.values()

    def p95(name):
        truth = render_reference(scenes[name], head.profile)
        return measure(render_taps(scenes[name], head.fit.kernel), truth).delta_e_2000_p95

    stages = [each.fit.kernel.structure for each in choices.values()]
    text = " ".join((ROOT / "docs" / "how-to-choose.md").read_text(encoding="utf-8").split())
    assert (
        f"takes {stages[0]}, whose 95th percentile is {head.chosen.error:.2f} on the head, but "
        f"{p95('edge'):.1f} on an edge at 30 degrees and {p95('points'):.1f} on points."
    ) in text
    assert (
        f"it takes {stages[1]} or {stages[2]}, for hardly more fetches "
        f"({edge.chosen.fetches:.1f} and {points.chosen.fetches:.1f} in place of "
        f"{head.chosen.fetches:.2f})"
    ) in text


@pytest.mark.parametrize(
    ("name", "metres", "column"),
    [
        ("skin1", 20.0, 1),
        pytest.param("ketchup", 20.0, 2, marks=pytest.mark.slow),
        pytest.param("skin1", 5.0, 3, marks=pytest.mark.slow),
    ],
)
def test_choices_by_distance(name, metres, column):
    made = runpy.run_path(str(ROOT / "docs" / "make_choices.py"))
    rows = {row[0]: row[1:] for row in table_with("how-to-choose.md", "", "mm per pixel")}
    expected = {f"{name}, {each:g} m" for name in made["MATERIALS"] for each in made["DISTANCES_M"]}
    assert set(rows) == expected
    asked = list(made["ASKED"].values())
    pitch = mm_per_pixel_at(1000.0 * metres, 30.0, 1080)
    view = {"mm_per_pixel": pitch, "distance_mm": 1000.0 * metres}
    found = made["words"](load_material(name), view, asked[column - 1])
    assert rows[f"{name}, {metres:g} m"][column] == found.replace("\\|", "|"), (
        "run: python docs/make_choices.py"
    )
